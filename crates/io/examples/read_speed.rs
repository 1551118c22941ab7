//! How fast files of a mesh of about a million vertices are read, beside other readers and beside
//! copying the bytes; one and two threads. Medians of interleaved runs and the best of them, and
//! the memory that is taken at most while a file is read, its bytes among it.
//!
//! `cargo run --release -p cotan-io --example read_speed [runs] [reader]`, the latter to run only
//! the readers whose names hold that word.

use std::fmt::Write as _;
use std::hint::black_box;
use std::time::Instant;

use cotan_io::{Document, Limits, read};

/// Vertices along one side of the grid.
const SIDE: usize = 1000;

type Error = Box<dyn std::error::Error>;

fn main() -> Result<(), Error> {
    let runs = std::env::args().nth(1).map_or(Ok(7), |n| n.parse())?;
    let wanted = std::env::args().nth(2).unwrap_or_default();
    println!("median of {runs} runs");
    for (name, decimals, style) in [
        ("OBJ, v and f, 6 decimals", 6, Corners::Plain),
        ("OBJ, v, vt, vn and f, 6 decimals", 6, Corners::Full),
        ("OBJ, v and f, all digits", 17, Corners::Plain),
    ] {
        let file = obj(decimals, style);
        let mut readers = obj_readers()?;
        readers.retain(|(name, _)| name.contains(&wanted));
        measure(name, &file, runs, &readers)?;
    }
    Ok(())
}

/// What the corners of an OBJ refer to.
#[derive(Clone, Copy, PartialEq)]
enum Corners {
    /// `v`
    Plain,
    /// `v/vt/vn`
    Full,
}

/// A wavy grid with two triangles a cell.
fn obj(decimals: usize, corners: Corners) -> Vec<u8> {
    let mut out = String::new();
    let grid = || (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i as f64, j as f64)));
    // Writing to a String cannot fail.
    for (i, j) in grid() {
        let (x, y) = (i / 999.0 - 0.5, j / 999.0 - 0.5);
        let z = 0.1 * (20.0 * x).sin() * (20.0 * y).cos();
        let _ = if decimals < 17 {
            writeln!(out, "v {x:.decimals$} {y:.decimals$} {z:.decimals$}")
        } else {
            writeln!(out, "v {x} {y} {z}")
        };
    }
    if corners == Corners::Full {
        for (i, j) in grid() {
            let _ = writeln!(out, "vt {:.decimals$} {:.decimals$}", i / 999.0, j / 999.0);
        }
        for (i, j) in grid() {
            let (x, y) = ((0.02 * i).cos() / 2.0, (0.02 * j).sin() / 2.0);
            let z = (1.0 - x * x - y * y).sqrt();
            let _ = writeln!(out, "vn {x:.4} {y:.4} {z:.4}");
        }
    }
    for i in 0..SIDE - 1 {
        for j in 0..SIDE - 1 {
            let a = i * SIDE + j + 1;
            for [a, b, c] in [[a, a + SIDE, a + 1], [a + 1, a + SIDE, a + SIDE + 1]] {
                let _ = match corners {
                    Corners::Plain => writeln!(out, "f {a} {b} {c}"),
                    Corners::Full => writeln!(out, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}"),
                };
            }
        }
    }
    out.into_bytes()
}

/// Reads a file and gives the number of its vertices.
type Reader = (&'static str, Box<dyn Fn(Vec<u8>) -> Result<usize, Error>>);

fn cotan(threads: usize) -> Result<Reader, Error> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()?;
    let name = match threads {
        1 => "cotan, one thread",
        _ => "cotan, two threads",
    };
    let read = move |bytes: Vec<u8>| -> Result<usize, Error> {
        let document: Document = pool.install(|| read(bytes, None, &Limits::default()))?;
        Ok(black_box(&document).positions().len())
    };
    Ok((name, Box::new(read)))
}

fn obj_readers() -> Result<Vec<Reader>, Error> {
    let tobj = |bytes: Vec<u8>| -> Result<usize, Error> {
        // Neither triangulated nor merged: the least work that it can be asked for.
        let options = tobj::LoadOptions::default();
        let loaded = tobj::load_obj_buf(&mut &bytes[..], &options, |_| {
            Err(tobj::LoadError::OpenFileFailed)
        })?;
        let positions = loaded.0.iter().map(|m| m.mesh.positions.len() / 3);
        Ok(positions.sum())
    };
    Ok(vec![cotan(1)?, cotan(2)?, ("tobj", Box::new(tobj))])
}

fn measure(name: &str, file: &[u8], runs: usize, readers: &[Reader]) -> Result<(), Error> {
    let megabytes = file.len() as f64 / 1e6;
    println!("\n{name}: {megabytes:.0} MB");
    let mut copies = Vec::new();
    let mut times = vec![Vec::new(); readers.len()];
    let mut peaks = vec![None; readers.len()];
    let mut counts = vec![0; readers.len()];
    for _ in 0..runs {
        let clock = Instant::now();
        drop(black_box(black_box(file).to_vec()));
        copies.push(clock.elapsed().as_secs_f64());
        for (k, (_, read)) in readers.iter().enumerate() {
            let before = resident("VmRSS:");
            let bytes = file.to_vec();
            // From here on the peak counts anew.
            let _ = std::fs::write("/proc/self/clear_refs", "5");
            let clock = Instant::now();
            counts[k] = read(bytes)?;
            times[k].push(clock.elapsed().as_secs_f64());
            let peak = resident("VmHWM:").zip(before);
            peaks[k] = peaks[k].max(peak.map(|(peak, before)| peak.saturating_sub(before)));
        }
    }
    let row = |name: &str, times: &mut [f64], rest: &str| {
        let middle = median(times);
        let speed = megabytes / middle;
        let best = megabytes / times[0];
        println!(
            "  {name:20} {speed:6.0} MB/s {:8.1} ms   best {best:6.0} MB/s{rest}",
            1e3 * middle
        );
    };
    row("copying the bytes", &mut copies, "");
    for (k, (name, _)) in readers.iter().enumerate() {
        let peak = peaks[k].map_or("unknown".to_owned(), |kilobytes| {
            format!("{:.0} MB", kilobytes as f64 * 1.024e-3)
        });
        let rest = format!("   {} vertices, {peak} at most", counts[k]);
        row(name, &mut times[k], &rest);
    }
    Ok(())
}

/// Kilobytes that the system says this process has, where it says so.
fn resident(what: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(what))?;
    line.split_whitespace().next()?.parse().ok()
}

/// The median; the times are sorted afterwards.
fn median(times: &mut [f64]) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    times[times.len() / 2]
}
