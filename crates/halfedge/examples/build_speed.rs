//! Measures `HalfedgeMesh::from_faces` on a torus of a million triangles, with the vertices and
//! faces in the order of the grid and in random order:
//! `cargo run --release -p cotan-halfedge --example build_speed`.

use std::time::Instant;

use cotan_halfedge::{BuildError, HalfedgeMesh};

/// Points along each of the two circles of the torus; 2 · 708² is slightly above a million.
const SIDE: u32 = 708;
/// Only the fastest run counts: the others also measure other load on the machine.
const RUNS: usize = 5;

fn main() -> Result<(), BuildError> {
    let mut faces = torus();
    report("grid order", &faces)?;
    let mut random = SplitMix(1);
    let numbers = random.permutation(SIDE * SIDE);
    for corner in faces.iter_mut().flatten() {
        *corner = numbers[*corner as usize];
    }
    report("random vertices, grid faces", &faces)?;
    let order = random.permutation(faces.len() as u32);
    let shuffled: Vec<_> = order.iter().map(|&f| faces[f as usize]).collect();
    report("random vertices, random faces", &shuffled)
}

fn report(order: &str, faces: &[[u32; 3]]) -> Result<(), BuildError> {
    let mut best = f64::INFINITY;
    for _ in 0..RUNS {
        let start = Instant::now();
        let mesh = HalfedgeMesh::from_faces((SIDE * SIDE) as usize, faces)?;
        best = best.min(start.elapsed().as_secs_f64());
        std::hint::black_box(mesh);
    }
    let per_face = best * 1e9 / faces.len() as f64;
    println!("{order:30} {:8.1} ms  {per_face:6.1} ns a face", best * 1e3);
    Ok(())
}

/// A square grid closed in both directions, with each square cut into two triangles.
fn torus() -> Vec<[u32; 3]> {
    let at = |i: u32, j: u32| (i % SIDE) * SIDE + j % SIDE;
    let squares = (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i, j)));
    squares
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

/// The SplitMix64 generator, sufficient for a reproducible shuffle.
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn permutation(&mut self, len: u32) -> Vec<u32> {
        let mut numbers: Vec<u32> = (0..len).collect();
        for i in (1..numbers.len()).rev() {
            numbers.swap(i, (self.next() % (i as u64 + 1)) as usize);
        }
        numbers
    }
}
