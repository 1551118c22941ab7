//! Meshes and handles, as files that we and the peers read.
//!
//! The format, little-endian: three u64 (vertices, faces, handles), positions (three f64 each),
//! faces (three u32 each), handle vertices (u32), their targets (three f64 each).

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use cotan::Mesh;
use cotan::prelude::*;
use cotan::shapes::{VertexOrder, irregular};

/// The two jobs on one mesh.
pub(crate) struct Jobs {
    pub(crate) num_vertices: usize,
    /// 32 points, spread over the surface.
    pub(crate) points: PathBuf,
    /// 2 % of the vertices: both ends along z.
    pub(crate) regions: PathBuf,
}

impl Jobs {
    pub(crate) fn write(
        folder: &Path,
        size: usize,
        numbering: VertexOrder,
    ) -> std::io::Result<Self> {
        let shape = irregular::<f64>(size, numbering, 6);
        let jobs = Self {
            num_vertices: shape.num_vertices(),
            points: folder.join(format!("points_{size}.job")),
            regions: folder.join(format!("regions_{size}.job")),
        };
        write(&jobs.points, &shape, &point_handles(&shape))?;
        write(&jobs.regions, &shape, &region_handles(&shape))?;
        Ok(jobs)
    }
}

pub(crate) type Moves = Vec<(VertexId, Point3<f64>)>;

/// The contents of a file.
#[derive(Clone)]
pub(crate) struct Job {
    pub(crate) positions: Positions<f64>,
    pub(crate) faces: Vec<[u32; 3]>,
    pub(crate) moves: Moves,
}

/// The extreme vertices in 32 directions of a spiral; the upper half is bent aside.
fn point_handles(shape: &Mesh<f64>) -> Moves {
    const COUNT: usize = 32;
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let mut directions: Vec<Vector3<f64>> = Vec::new();
    for k in 0..COUNT {
        let z = 1.0 - (2 * k + 1) as f64 / COUNT as f64;
        let (sin, cos) = (golden * k as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        directions.push(Vector3::new(radius * cos, radius * sin, z));
    }
    let mut best = [(f64::NEG_INFINITY, VertexId::new(0)); COUNT];
    for (v, p) in shape.positions().iter() {
        let unit = p.coords.normalize();
        for (best, direction) in best.iter_mut().zip(&directions) {
            let cosine = unit.dot(direction);
            if cosine > best.0 {
                *best = (cosine, v);
            }
        }
    }
    best.iter()
        .map(|&(_, v)| (v, bent(&shape.positions()[v])))
        .collect()
}

fn bent(p: &Point3<f64>) -> Point3<f64> {
    let turn = Isometry3::rotation(Vector3::y() * (0.5 * p.z.max(0.0)));
    turn * p
}

/// The lowest hundredth fixed, the highest rotated by 30° and shifted.
fn region_handles(shape: &Mesh<f64>) -> Moves {
    let mut by_z: Vec<VertexId> = shape.connectivity().vertices().collect();
    by_z.sort_unstable_by(|&a, &b| shape.positions()[a].z.total_cmp(&shape.positions()[b].z));
    let count = (by_z.len() / 100).max(3);
    let motion = Isometry3::new(Vector3::new(0.4, 0.0, 0.1), Vector3::y() * 0.5);
    let fixed = by_z[..count].iter().map(|&v| (v, shape.positions()[v]));
    let moved = by_z[by_z.len() - count..].iter();
    fixed
        .chain(moved.map(|&v| (v, motion * shape.positions()[v])))
        .collect()
}

fn write(path: &Path, shape: &Mesh<f64>, moves: &Moves) -> std::io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    let counts = [shape.positions().len(), shape.num_faces(), moves.len()];
    for count in counts {
        out.write_all(&(count as u64).to_le_bytes())?;
    }
    let point = |out: &mut BufWriter<File>, p: &Point3<f64>| {
        p.iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))
    };
    for p in shape.positions().values() {
        point(&mut out, p)?;
    }
    for f in shape.connectivity().faces() {
        for v in shape.connectivity().triangle(f) {
            out.write_all(&(v.index() as u32).to_le_bytes())?;
        }
    }
    for (v, _) in moves {
        out.write_all(&(v.index() as u32).to_le_bytes())?;
    }
    for (_, p) in moves {
        point(&mut out, p)?;
    }
    out.flush()
}

impl Job {
    pub(crate) fn read(path: &Path) -> std::io::Result<Self> {
        let mut file = BufReader::new(File::open(path)?);
        let mut counts = [0; 3];
        for count in &mut counts {
            *count = u64::from_le_bytes(bytes(&mut file)?) as usize;
        }
        let [num_vertices, num_faces, num_handles] = counts;
        let positions = (0..num_vertices)
            .map(|_| point(&mut file))
            .collect::<std::io::Result<Vec<_>>>()?;
        let mut faces = vec![[0; 3]; num_faces];
        for corner in faces.as_flattened_mut() {
            *corner = u32::from_le_bytes(bytes(&mut file)?);
        }
        let mut moves = Vec::with_capacity(num_handles);
        for _ in 0..num_handles {
            let vertex = u32::from_le_bytes(bytes(&mut file)?);
            moves.push((VertexId::new(vertex as usize), Point3::origin()));
        }
        for (_, target) in &mut moves {
            *target = point(&mut file)?;
        }
        Ok(Self {
            positions: positions.into_iter().collect(),
            faces,
            moves,
        })
    }
}

fn point(file: &mut impl Read) -> std::io::Result<Point3<f64>> {
    let mut p = Point3::origin();
    for x in p.iter_mut() {
        *x = f64::from_le_bytes(bytes(file)?);
    }
    Ok(p)
}

fn bytes<const N: usize>(file: &mut impl Read) -> std::io::Result<[u8; N]> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}
