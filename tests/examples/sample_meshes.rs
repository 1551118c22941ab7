//! Writes the sample meshes of the book (`docs/book`) to a folder.
//!
//! ```text
//! cargo run --release -p cotan-tests --example sample_meshes -- models
//! ```

use std::error::Error;
use std::path::{Path, PathBuf};

use cotan::nalgebra::Point3;
use cotan::prelude::*;
use cotan::shapes::{self, VertexOrder};
use cotan::smooth::with_normal_noise;
use cotan_io::{Attributes, Document, FaceList, LabelKind, Labels, Property, Values, save};

type Outcome = Result<(), Box<dyn Error>>;

fn main() -> Outcome {
    let folder = std::env::args_os().nth(1).map(PathBuf::from);
    let folder = folder.ok_or("usage: sample_meshes FOLDER")?;
    std::fs::create_dir_all(&folder)?;
    plain(&folder)?;
    noisy(&folder)?;
    star_shaped(&folder)?;
    painted(&folder)?;
    dressed(&folder)?;
    assembled(&folder)?;
    damaged(&folder)?;
    scanned(&folder)
}

/// Shapes as the library makes them.
fn plain(folder: &Path) -> Outcome {
    write(folder, "creature.obj", &shapes::creature(64))?;
    write(folder, "bar.obj", &shapes::bar([6.0, 1.0, 1.0], [36, 6, 6]))?;
    write(folder, "rod.obj", &shapes::cylinder(0.5, 6.0, 36, 48))?;
    write(folder, "ball.obj", &shapes::icosphere(4))?;
    write(folder, "torus.obj", &shapes::torus(1.0, 0.4, 64, 32))?;
    write(
        folder,
        "sheet.obj",
        &shapes::bumpy_plane([2.0, 1.0], [60, 30], 0.1),
    )?;
    let bar = shapes::bar::<f64>([6.0, 1.0, 1.0], [36, 6, 6]);
    let dense_at_the_left = |x: f64| 6.0 * (x / 6.0 + 0.5).powf(1.7) - 3.0;
    let uneven = |p: &Point3<f64>| Point3::new(dense_at_the_left(p.x), p.y, p.z);
    let uneven = bar.with_positions(bar.positions().map(uneven))?;
    write(folder, "uneven.obj", &uneven)?;
    let scattered = shapes::irregular(10_000, VertexOrder::Random, 1);
    write(folder, "blob.ply", &scattered)
}

/// A part with sharp edges, clean and as a bad scanner would see it.
fn noisy(folder: &Path) -> Outcome {
    let part = shapes::bar::<f64>([3.0, 2.0, 1.0], [36, 24, 12]);
    let surface = part.surface();
    let noise = with_normal_noise(&surface, 0.2 * surface.mean_edge_length(), 1);
    write(folder, "part.obj", &part)?;
    write(folder, "part_noisy.obj", &part.with_positions(noise)?)
}

/// Shapes around the origin: two to morph from one to the other, and one with dimples.
fn star_shaped(folder: &Path) -> Outcome {
    let ball = shapes::icosphere::<f64>(5);
    let spike = |p: &Point3<f64>| p * (1.0 + 0.8 * p.coords.amax().powi(24));
    let urchin = ball.with_positions(ball.positions().map(spike))?;
    write(folder, "urchin.obj", &urchin)?;
    let ball = shapes::icosphere::<f64>(4);
    let stretch = |p: &Point3<f64>| Point3::new(p.x, p.y, 1.5 * p.z + 0.3 * p.z * p.z);
    let egg = ball.with_positions(ball.positions().map(stretch))?;
    write(folder, "egg.obj", &egg)?;
    // Dimples, to be carried to other shapes.
    let ball = shapes::icosphere::<f64>(5);
    let waves = |p: &Point3<f64>| p.coords.iter().map(|x| (18.0 * x).sin()).sum::<f64>();
    let dimpled = ball.with_positions(ball.positions().map(|p| p * (1.0 + 0.012 * waves(p))))?;
    write(folder, "dimples.obj", &dimpled)
}

/// A ball whose vertices carry the mean curvature that they are to have.
fn painted(folder: &Path) -> Outcome {
    let ball = shapes::icosphere::<f64>(4);
    let curvature = |p: &Point3<f64>| 1.0 + 8.0 * (16.0 * p.y).sin();
    let property = Property {
        name: "mean_curvature".to_owned(),
        components: 1,
        values: Values::F64(ball.positions().values().map(curvature).collect()),
    };
    let attributes = Attributes {
        vertices: vec![property],
        ..Attributes::default()
    };
    let document = Document::from_mesh(ball.connectivity(), ball.positions())?;
    save(
        &document.with_attributes(attributes)?,
        folder.join("painted.ply"),
    )?;
    Ok(())
}

/// The creature with two eyes and a blanket: four parts with names.
fn dressed(folder: &Path) -> Outcome {
    let body = shapes::creature::<f64>(64);
    let surface = body.surface();
    let normals = surface.vertex_normals();
    let head = Point3::new(0.86, 1.58, 0.0);
    let mut positions: Vec<Point3<f64>> = body.positions().values().copied().collect();
    let mut faces = triangles(&body);
    let mut names = vec![0; faces.len()];
    for side in [-1.0, 1.0] {
        let look = Vector3::new(0.8, 0.3, 0.6 * side).normalize();
        let seat = body
            .positions()
            .values()
            .filter(|p| (*p - head).norm() < 0.6)
            .max_by(|a, b| (*a - head).dot(&look).total_cmp(&(*b - head).dot(&look)))
            .ok_or("the creature has no head")?;
        let ball = shapes::icosphere::<f64>(2);
        let eye = ball.positions().map(|p| seat + p.coords * 0.08);
        let first = positions.len() as u32;
        positions.extend(eye.values());
        faces.extend(triangles(&ball).iter().map(|f| f.map(|v| v + first)));
        names.resize(faces.len(), 1);
    }
    let is_covered = |v: &u32| {
        let v = VertexId::new(*v as usize);
        let p = body.positions()[v];
        p.x > -0.6 && p.x < 0.4 && normals[v].y > 0.3 && p.y < 1.4
    };
    let covered: Vec<[u32; 3]> = triangles(&body)
        .into_iter()
        .filter(|f| f.iter().all(is_covered))
        .collect();
    let mut copy = vec![None; body.num_vertices()];
    for face in covered {
        let face = face.map(|v| {
            *copy[v as usize].get_or_insert_with(|| {
                let v = VertexId::new(v as usize);
                positions.push(body.positions()[v] + normals[v] * 0.03);
                positions.len() as u32 - 1
            })
        });
        faces.push(face);
    }
    names.resize(faces.len(), 2);
    let labels = Labels {
        kind: LabelKind::Object,
        names: ["body", "eye", "blanket"].map(String::from).to_vec(),
        faces: names,
    };
    let attributes = Attributes {
        labels: vec![labels],
        ..Attributes::default()
    };
    let document = Document::new(positions, faces.iter().collect::<FaceList>())?;
    save(
        &document.with_attributes(attributes)?,
        folder.join("dressed.obj"),
    )?;
    Ok(())
}

/// Models of many parts: a plate with screws, a jaw with teeth, and an arm of four pieces.
fn assembled(folder: &Path) -> Outcome {
    let moved = |mesh: &Mesh<f64>, by: [f64; 3]| {
        mesh.with_positions(mesh.positions().map(|p| p + Vector3::from(by)))
    };
    let plate = shapes::bar::<f64>([4.0, 2.0, 0.2], [48, 24, 3]);
    let screw = shapes::bar::<f64>([0.12, 0.12, 0.24], [2, 2, 3]);
    let mut parts = vec![("plate", plate)];
    for k in 0..32 {
        let [x, y] = [
            0.45 * f64::from(k % 8) - 1.575,
            0.45 * f64::from(k / 8) - 0.675,
        ];
        parts.push(("screw", moved(&screw, [x, y, 0.12])?));
    }
    save_parts(folder, "screws.obj", &parts)?;

    let bent = |mesh: &Mesh<f64>| {
        let on_arc = |p: &Point3<f64>| {
            let (sin, cos) = (p.x / 1.5).sin_cos();
            Point3::new((1.5 + p.y) * sin, (1.5 + p.y) * cos, p.z)
        };
        mesh.with_positions(mesh.positions().map(on_arc))
    };
    let tooth = shapes::bar::<f64>([0.2, 0.16, 0.4], [3, 3, 5]);
    let jaw = shapes::bar::<f64>([4.0, 0.4, 0.4], [60, 6, 6]);
    let mut parts = vec![("jaw", bent(&jaw)?)];
    for k in -5..=5 {
        let seated = moved(&tooth, [0.3 * f64::from(k), 0.0, 0.3])?;
        parts.push(("tooth", bent(&seated)?));
    }
    save_parts(folder, "jaw.obj", &parts)?;

    let piece = shapes::bar::<f64>([1.0, 0.4, 0.4], [20, 8, 8]);
    let names = ["shoulder", "upper", "lower", "hand"];
    let pieces = (0..4).map(|k| moved(&piece, [1.04 * f64::from(k), 0.0, 0.0]));
    let pieces = pieces.collect::<Result<Vec<_>, _>>()?;
    let parts: Vec<_> = names.into_iter().zip(pieces).collect();
    save_parts(folder, "arm.obj", &parts)
}

/// Meshes as the objects of one file.
fn save_parts(folder: &Path, name: &str, parts: &[(&str, Mesh<f64>)]) -> Outcome {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    let mut labels = Labels {
        kind: LabelKind::Object,
        names: Vec::new(),
        faces: Vec::new(),
    };
    for (name, part) in parts {
        let first = positions.len() as u32;
        positions.extend(part.positions().values().copied());
        faces.extend(triangles(part).iter().map(|f| f.map(|v| v + first)));
        let label = labels.names.iter().position(|known| known == name);
        let label = label.unwrap_or_else(|| {
            labels.names.push((*name).to_owned());
            labels.names.len() - 1
        });
        labels.faces.resize(faces.len(), label as u32);
    }
    let attributes = Attributes {
        labels: vec![labels],
        ..Attributes::default()
    };
    let document = Document::new(positions, faces.iter().collect::<FaceList>())?;
    save(&document.with_attributes(attributes)?, folder.join(name))?;
    Ok(())
}

/// What scanners and converters leave behind: holes, turned faces, duplicates, specks.
fn damaged(folder: &Path) -> Outcome {
    let ball = shapes::icosphere::<f64>(4);
    let positions: Vec<_> = ball.positions().values().copied().collect();
    let faces: Vec<[u32; 3]> = triangles(&ball);
    let middle = |f: &[u32; 3]| {
        let sum: Vector3<f64> = f.iter().map(|&v| positions[v as usize].coords).sum();
        sum / 3.0
    };
    let is_kept = |f: &&[u32; 3]| {
        let place = middle(f);
        [Vector3::x(), Vector3::new(0.0, 0.6, 0.8)]
            .iter()
            .all(|hole| (place - hole).norm() > 0.45)
    };
    let open: Vec<[u32; 3]> = faces.iter().filter(is_kept).copied().collect();
    let document = Document::new(positions.clone(), open.iter().collect::<FaceList>())?;
    save(&document, folder.join("holes.obj"))?;

    // One face in twenty looks inward, one is there twice, and a tetrahedron floats nearby.
    let mut damaged = open;
    for face in damaged.iter_mut().step_by(20) {
        face.swap(0, 1);
    }
    damaged.push(damaged[7]);
    let speck = shapes::tetrahedron::<f64>();
    let first = positions.len() as u32;
    let mut positions = positions;
    let placed = |p: &Point3<f64>| Point3::from(0.1 * p.coords + Vector3::new(1.2, 0.0, 0.0));
    positions.extend(speck.positions().values().map(placed));
    damaged.extend(triangles(&speck).iter().map(|f| f.map(|v| v + first)));
    let document = Document::new(positions, damaged.iter().collect::<FaceList>())?;
    save(&document, folder.join("damaged.obj"))?;
    Ok(())
}

/// The creature as a bad scanner would see it: noise, a hole in its back, a floating speck.
fn scanned(folder: &Path) -> Outcome {
    let body = shapes::creature::<f64>(64);
    let surface = body.surface();
    let noisy = with_normal_noise(&surface, 0.2 * surface.mean_edge_length(), 2);
    let back = Point3::new(0.0, 1.0, 0.0);
    let is_seen = |face: &[u32; 3]| {
        let p = body.positions()[VertexId::new(face[0] as usize)];
        (p - back).norm() > 0.2
    };
    let mut faces = triangles(&body);
    faces.retain(is_seen);
    let mut positions: Vec<Point3<f64>> = noisy.values().copied().collect();
    let speck = shapes::tetrahedron::<f64>();
    let first = positions.len() as u32;
    let place = Vector3::new(1.4, 0.5, 0.0);
    positions.extend(speck.positions().values().map(|p| p * 0.05 + place));
    faces.extend(triangles(&speck).iter().map(|f| f.map(|v| v + first)));
    let document = Document::new(positions, faces.iter().collect::<FaceList>())?;
    save(&document, folder.join("scan.obj"))?;
    Ok(())
}

fn triangles(mesh: &Mesh<f64>) -> Vec<[u32; 3]> {
    let corners = mesh.to_triangles();
    corners
        .chunks_exact(3)
        .map(|f| [f[0], f[1], f[2]])
        .collect()
}

fn write(folder: &Path, name: &str, mesh: &Mesh<f64>) -> Outcome {
    let document = Document::from_mesh(mesh.connectivity(), mesh.positions())?;
    save(&document, folder.join(name))?;
    Ok(())
}
