//! Benchmark of loading files of a mesh with a million vertices, in comparison with other readers
//! and with reading and copying the bytes. Also measures the construction of the half-edge mesh
//! and the peak memory of loading. Reports medians of interleaved runs, all in one process.
//!
//! `cargo run --release -p cotan-io --example read_speed [RUNS] [FILE] [READER]`. With FILE and
//! READER, only files and readers whose names contain these words are run.

use std::fmt::Write as _;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

use cotan_io::{Document, FaceList, Format, load};
use nalgebra::Point3;
use ply_rs::parser::Parser;
use ply_rs::ply::DefaultElement;

/// Number of vertices along one side of the grid.
const SIDE: usize = 1000;

type Error = Box<dyn std::error::Error>;

/// Loads a file and returns the number of its vertices.
type Reader = (&'static str, fn(&Path) -> Result<usize, Error>);

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let runs = arguments.next().map_or(Ok(7), |n| n.parse())?;
    let [file, reader] = [arguments.next(), arguments.next()].map(Option::unwrap_or_default);
    let folder = tempfile::tempdir()?;
    println!("medians of {runs} runs, {SIDE} x {SIDE} vertices");
    for (name, extension, bytes, others) in files() {
        if !name.contains(&file) {
            continue;
        }
        let path = folder.path().join("mesh").with_extension(extension);
        std::fs::write(&path, bytes()?)?;
        let mut readers: Vec<Reader> = vec![
            ("bytes read and copied", copy),
            ("cotan, one thread", |path| cotan(path, 1)),
            ("cotan, two threads", |path| cotan(path, 2)),
        ];
        readers.extend(others);
        readers.retain(|(name, _)| name.contains(&reader));
        measure(name, &path, runs, &readers)?;
    }
    build(runs)
}

/// A file: its name, its extension, a function that creates its bytes, and the readers in
/// addition to cotan.
type File = (
    &'static str,
    &'static str,
    Box<dyn Fn() -> Result<Vec<u8>, Error>>,
    Vec<Reader>,
);

fn files() -> Vec<File> {
    let by_tobj: Reader = ("tobj", tobj);
    let by_ply_rs: Reader = ("ply-rs, its default elements", ply_rs);
    let by_gltf: Reader = ("gltf, its readers", gltf);
    vec![
        (
            "OBJ, v and f, 6 decimals",
            "obj",
            Box::new(|| Ok(obj(6, Corners::Plain))),
            vec![by_tobj],
        ),
        (
            "OBJ, v, vt, vn and f",
            "obj",
            Box::new(|| Ok(obj(6, Corners::Full))),
            vec![by_tobj],
        ),
        (
            "OBJ, v and f, all digits",
            "obj",
            Box::new(|| Ok(obj(17, Corners::Plain))),
            vec![by_tobj],
        ),
        (
            "PLY, binary, float",
            "ply",
            Box::new(|| Ok(float_ply())),
            vec![by_ply_rs],
        ),
        (
            "PLY, binary, double",
            "ply",
            Box::new(|| written(Format::Ply)),
            vec![by_ply_rs],
        ),
        (
            "GLB",
            "glb",
            Box::new(|| written(Format::Glb)),
            vec![by_gltf],
        ),
        (
            "STL, binary",
            "stl",
            Box::new(|| written(Format::Stl)),
            vec![],
        ),
    ]
}

fn points() -> impl Iterator<Item = [f64; 3]> {
    (0..SIDE * SIDE).map(|k| {
        let (x, y) = (
            (k / SIDE) as f64 / 999.0 - 0.5,
            (k % SIDE) as f64 / 999.0 - 0.5,
        );
        [x, y, 0.1 * (20.0 * x).sin() * (20.0 * y).cos()]
    })
}

fn triangles() -> impl Iterator<Item = [u32; 3]> {
    let side = SIDE as u32;
    (0..side - 1).flat_map(move |i| {
        (0..side - 1).flat_map(move |j| {
            let a = i * side + j;
            [[a, a + side, a + 1], [a + 1, a + side, a + side + 1]]
        })
    })
}

/// The grid as written by cotan.
fn written(format: Format) -> Result<Vec<u8>, Error> {
    let faces: FaceList = triangles().collect();
    let document = Document::new(points().map(Point3::from).collect(), faces)?;
    Ok(document.write(format)?)
}

fn float_ply() -> Vec<u8> {
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\n\
         property float y\nproperty float z\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        SIDE * SIDE,
        2 * (SIDE - 1) * (SIDE - 1)
    )
    .into_bytes();
    for x in points().flatten() {
        out.extend_from_slice(&(x as f32).to_le_bytes());
    }
    for triangle in triangles() {
        out.push(3);
        triangle
            .iter()
            .for_each(|v| out.extend_from_slice(&v.to_le_bytes()));
    }
    out
}

/// The references of OBJ corners.
#[derive(Clone, Copy, PartialEq)]
enum Corners {
    /// `v`
    Plain,
    /// `v/vt/vn`
    Full,
}

fn obj(decimals: usize, corners: Corners) -> Vec<u8> {
    let mut out = String::new();
    // Writing to a String cannot fail.
    for [x, y, z] in points() {
        let _ = if decimals < 17 {
            writeln!(out, "v {x:.decimals$} {y:.decimals$} {z:.decimals$}")
        } else {
            writeln!(out, "v {x} {y} {z}")
        };
    }
    if corners == Corners::Full {
        for [x, y, _] in points() {
            let _ = writeln!(out, "vt {:.decimals$} {:.decimals$}", x + 0.5, y + 0.5);
        }
        for [x, y, _] in points() {
            let (x, y) = ((9.0 * x).cos() / 2.0, (9.0 * y).sin() / 2.0);
            let z = (1.0 - x * x - y * y).sqrt();
            let _ = writeln!(out, "vn {x:.4} {y:.4} {z:.4}");
        }
    }
    for [a, b, c] in triangles().map(|t| t.map(|v| v + 1)) {
        let _ = match corners {
            Corners::Plain => writeln!(out, "f {a} {b} {c}"),
            Corners::Full => writeln!(out, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}"),
        };
    }
    out.into_bytes()
}

fn copy(path: &Path) -> Result<usize, Error> {
    let bytes = std::fs::read(path)?;
    drop(black_box(black_box(&bytes).to_vec()));
    Ok(0)
}

fn cotan(path: &Path, threads: usize) -> Result<usize, Error> {
    let document = cotan_parallel::on_threads(threads, || load(path))??;
    Ok(black_box(&document).positions().len())
}

/// Neither triangulated nor merged: the minimum work that it can be asked for.
fn tobj(path: &Path) -> Result<usize, Error> {
    let bytes = std::fs::read(path)?;
    let options = tobj::LoadOptions::default();
    let loaded = tobj::load_obj_buf(&mut &bytes[..], &options, |_| {
        Err(tobj::LoadError::OpenFileFailed)
    })?;
    Ok(loaded.0.iter().map(|m| m.mesh.positions.len() / 3).sum())
}

fn ply_rs(path: &Path) -> Result<usize, Error> {
    let bytes = std::fs::read(path)?;
    let ply = Parser::<DefaultElement>::new().read_ply(&mut bytes.as_slice())?;
    Ok(black_box(&ply).payload["vertex"].len())
}

/// The steps of `gltf::import` for a file without images, followed by its readers into vectors.
fn gltf(path: &Path) -> Result<usize, Error> {
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&std::fs::read(path)?)?;
    let blob = blob.unwrap_or_default();
    let mut count = 0;
    for primitive in document.meshes().flat_map(|mesh| mesh.primitives()) {
        let reader = primitive.reader(|_| Some(&blob));
        let positions: Vec<_> = reader.read_positions().into_iter().flatten().collect();
        let indices = reader.read_indices().into_iter();
        let indices: Vec<u32> = indices.flat_map(|indices| indices.into_u32()).collect();
        count += black_box(positions).len();
        black_box(indices);
    }
    Ok(count)
}

fn measure(name: &str, path: &PathBuf, runs: usize, readers: &[Reader]) -> Result<(), Error> {
    let megabytes = std::fs::metadata(path)?.len() as f64 / 1e6;
    println!("\n{name}: {megabytes:.0} MB");
    let mut times = vec![Vec::new(); readers.len()];
    let mut peaks = vec![None; readers.len()];
    for _ in 0..runs {
        for (k, (_, read)) in readers.iter().enumerate() {
            let before = resident("VmRSS:");
            // Resets the peak memory.
            let _ = std::fs::write("/proc/self/clear_refs", "5");
            let clock = Instant::now();
            read(path)?;
            times[k].push(clock.elapsed().as_secs_f64());
            let peak = resident("VmHWM:").zip(before);
            peaks[k] = peaks[k].max(peak.map(|(peak, before)| peak.saturating_sub(before)));
        }
    }
    for (k, (name, _)) in readers.iter().enumerate() {
        let middle = median(&mut times[k]);
        let peak = peaks[k].map_or("unknown".to_owned(), |kilobytes| {
            format!("{:.0} MB", kilobytes as f64 * 1.024e-3)
        });
        println!(
            "  {name:30} {:6.0} MB/s {:8.1} ms   best {:8.1} ms   {peak} at most",
            megabytes / middle,
            1e3 * middle,
            1e3 * times[k][0],
        );
    }
    Ok(())
}

/// Builds the surface of the document: triangulation and half-edges.
fn build(runs: usize) -> Result<(), Error> {
    let document = Document::new(points().map(Point3::from).collect(), triangles().collect())?;
    let mut times = Vec::new();
    for _ in 0..runs {
        let clock = Instant::now();
        black_box(document.surface()?);
        times.push(clock.elapsed().as_secs_f64());
    }
    let middle = median(&mut times);
    let per_face = 1e9 * middle / document.faces().len() as f64;
    println!(
        "\nthe surface of the document: {:.0} ms, {per_face:.0} ns a face",
        1e3 * middle
    );
    Ok(())
}

/// A memory figure of this process in kilobytes, if the system reports it.
fn resident(what: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(what))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Returns the median, and leaves the times sorted.
fn median(times: &mut [f64]) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    times[times.len() / 2]
}
