//! How fast PLY files are read, beside copying their bytes and beside `ply-rs`.
//!
//! `cargo run --release -p cotan-io --example ply_speed [rounds]`
//!
//! Rounds take turns, so that a busy machine slows all alike; medians are printed.

use std::fmt::Write as _;
use std::hint::black_box;
use std::time::Instant;

use cotan_io::{Document, Format, Limits, read};
use ply_rs::parser::Parser;
use ply_rs::ply::DefaultElement;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let rounds = match std::env::args().nth(1) {
        Some(rounds) => rounds.parse()?,
        None => 9,
    };
    let large = Grid { side: 1000 };
    let small = Grid { side: 200 };
    let singles = large.binary(|x| (x as f32).to_le_bytes().to_vec(), "float");
    let doubles = large.binary(|x| x.to_le_bytes().to_vec(), "double");
    let text = large.text();
    let rich = large.rich();
    let file = tempfile::NamedTempFile::new()?;
    std::fs::write(file.path(), &singles)?;
    let small_bytes = small.binary(|x| (x as f32).to_le_bytes().to_vec(), "float");

    let parse = |bytes: Vec<u8>| read(bytes, Some(Format::Ply), &Limits::default());
    let document = parse(singles.clone())?;
    println!(
        "{} vertices, {} faces",
        document.positions().len(),
        document.faces().len()
    );
    drop(document);
    let mut times: Vec<(&str, usize, Vec<f64>)> = Vec::new();
    for _ in 0..rounds {
        let mut measure = |name: &'static str, size: usize, work: &mut dyn FnMut()| {
            let clock = Instant::now();
            work();
            let seconds = clock.elapsed().as_secs_f64();
            match times.iter_mut().find(|(n, ..)| *n == name) {
                Some((.., all)) => all.push(seconds),
                None => times.push((name, size, vec![seconds])),
            }
        };
        for (copy, whole, bytes) in [
            ("float: copy of the bytes", "float: read", &singles),
            ("double: copy of the bytes", "double: read", &doubles),
            ("text: copy of the bytes", "text: read", &text),
        ] {
            measure(copy, bytes.len(), &mut || {
                black_box(bytes.to_vec());
            });
            // The bytes are given away, as when they come from a file.
            let given = bytes.clone();
            let mut given = Some(given);
            let mut document: Option<Document> = None;
            measure(whole, bytes.len(), &mut || {
                document = given.take().and_then(|bytes| parse(bytes).ok());
            });
            if whole == "float: read" {
                let document = document.as_ref().ok_or("not read")?;
                measure("float: write unchanged", bytes.len(), &mut || {
                    black_box(document.write(Format::Ply).is_ok());
                });
            }
        }
        measure("file: read and copied", singles.len(), &mut || {
            let copy = std::fs::read(file.path()).map(|bytes| (bytes.clone(), bytes));
            black_box(copy.is_ok());
        });
        measure("file: loaded", singles.len(), &mut || {
            black_box(cotan_io::load(file.path()).is_ok());
        });
        let kept = parse(rich.clone())?;
        measure("rich: attributes", rich.len(), &mut || {
            black_box(kept.attributes().is_ok());
        });
        let mut moved = parse(singles.clone())?;
        for v in 0..moved.positions().len() {
            let raised = moved.positions()[v].map(|x| x + 0.5);
            moved.set_position(v, raised)?;
        }
        measure("float: write all moved", singles.len(), &mut || {
            black_box(moved.write(Format::Ply).is_ok());
        });
        measure("1/25: ply-rs", small_bytes.len(), &mut || {
            let ply = Parser::<DefaultElement>::new().read_ply(&mut small_bytes.as_slice());
            black_box(ply.is_ok());
        });
        let given = small_bytes.clone();
        let mut given = Some(given);
        measure("1/25: read", small_bytes.len(), &mut || {
            black_box(given.take().map(parse).is_some());
        });
    }
    for (name, size, all) in &mut times {
        all.sort_by(f64::total_cmp);
        let median = all[all.len() / 2];
        println!(
            "{name:26} {:8.2} ms {:8.0} MB/s",
            1e3 * median,
            *size as f64 / median / 1e6
        );
    }
    Ok(())
}

/// A wavy square of side² vertices, two triangles a cell.
struct Grid {
    side: usize,
}

impl Grid {
    fn points(&self) -> impl Iterator<Item = [f64; 3]> {
        let side = self.side;
        (0..side * side).map(move |i| {
            let (x, y) = ((i % side) as f64 * 0.01, (i / side) as f64 * 0.01);
            [x, y, (3.0 * x).sin() * (2.0 * y).cos()]
        })
    }

    fn faces(&self) -> impl Iterator<Item = [usize; 3]> {
        let side = self.side;
        (0..(side - 1) * (side - 1)).flat_map(move |i| {
            let a = i / (side - 1) * side + i % (side - 1);
            [[a, a + 1, a + side], [a + 1, a + side + 1, a + side]]
        })
    }

    fn header(&self, encoding: &str, number: &str) -> String {
        let num_vertices = self.side * self.side;
        let num_faces = 2 * (self.side - 1) * (self.side - 1);
        format!(
            "ply\nformat {encoding} 1.0\nelement vertex {num_vertices}\nproperty {number} x\n\
             property {number} y\nproperty {number} z\nelement face {num_faces}\n\
             property list uchar int vertex_indices\nend_header\n"
        )
    }

    fn binary(&self, number: impl Fn(f64) -> Vec<u8>, name: &str) -> Vec<u8> {
        let mut bytes = self.header("binary_little_endian", name).into_bytes();
        for x in self.points().flatten() {
            bytes.extend(number(x));
        }
        for face in self.faces() {
            bytes.push(3);
            for v in face {
                bytes.extend((v as i32).to_le_bytes());
            }
        }
        bytes
    }

    /// With normals, colours and texture coordinates of the corners.
    fn rich(&self) -> Vec<u8> {
        let text = self
            .header("binary_little_endian", "float")
            .replace(
                "float z\n",
                "float z\nproperty float nx\nproperty float ny\nproperty float nz\n\
                 property uchar red\nproperty uchar green\nproperty uchar blue\n",
            )
            .replace(
                "end_header",
                "property list uchar float texcoord\nend_header",
            );
        let mut bytes = text.into_bytes();
        for p in self.points() {
            for x in p.into_iter().chain([0.0, 0.6, 0.8]) {
                bytes.extend((x as f32).to_le_bytes());
            }
            bytes.extend([1, 2, 3]);
        }
        for face in self.faces() {
            bytes.push(3);
            for v in face {
                bytes.extend((v as i32).to_le_bytes());
            }
            bytes.push(6);
            for v in face {
                for x in [v % self.side, v / self.side] {
                    bytes.extend((x as f32).to_le_bytes());
                }
            }
        }
        bytes
    }

    fn text(&self) -> Vec<u8> {
        let mut text = self.header("ascii", "float");
        for [x, y, z] in self.points() {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{x:.6} {y:.6} {z:.6}");
        }
        for [a, b, c] in self.faces() {
            let _ = writeln!(text, "3 {a} {b} {c}");
        }
        text.into_bytes()
    }
}
