//! Access to the real models and reference cases of the stories, if they are available.
//!
//! They are other people's data, in a folder named `shared` next to the project, and never part of
//! this repository. Without them the stories pass, and are recorded as skipped.

#[cfg(doctest)]
mod book;
pub mod fuzzing;

use cotan::prelude::*;
use cotan_io::{Numbering, ProcessingMesh, Weld};
pub use cotan_testing::{shared, skip};
use serde_json::Value;

/// A model of `shared/meshes`.
pub fn model(name: &str) -> Option<ProcessingMesh> {
    let path = shared(&format!("meshes/{name}"))?;
    let document = cotan_io::load(&path).expect("a model of shared/meshes loads");
    Some(
        document
            // Reference results use the vertex indices of the file.
            .surface_numbered(Weld::AsFormat, Numbering::Document)
            .expect("a model of shared/meshes is a manifold"),
    )
}

/// The closed genus-0 models of `shared/meshes`.
pub fn closed_models() -> [&'static str; 17] {
    [
        "spot.obj",
        "duck.glb",
        "fandisk.obj",
        "fandisk_noisy.obj",
        "cartoon_elephant.obj",
        "dinosaur.obj",
        "venus_33587_derived.ply",
        "venus_50002.off",
        "armadillo.ply",
        "brain.ply",
        "igea.ply",
        "bend_benchmark/cylinder/00-cylinder-original.off",
        "bend_benchmark/cylinder/01-cylinder-primo.off",
        "bend_benchmark/cylinder/02-cylinder-linear_shell.off",
        "bend_benchmark/cylinder/03-cylinder-gradient_editing.off",
        "bend_benchmark/cylinder/04-cylinder-laplacian_editing.off",
        "bend_benchmark/cylinder/05-cylinder-rotation_invariant.off",
    ]
}

/// `shared/reference/deform.json`.
pub fn reference() -> Option<Value> {
    let text = std::fs::read_to_string(shared("reference/deform.json")?).expect("readable");
    Some(serde_json::from_str(&text).expect("valid JSON"))
}

/// The numbers of a JSON array.
pub fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_f64)
        .collect()
}

/// The vertex ids of a JSON array.
pub fn vertex_ids(value: &Value) -> Vec<VertexId> {
    value
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_u64)
        .map(|v| VertexId::new(v as usize))
        .collect()
}

/// The points of a JSON array of triples.
pub fn points(value: &Value) -> Vec<Point3<f64>> {
    value
        .as_array()
        .into_iter()
        .flatten()
        .map(|p| Point3::from_slice(&numbers(p)))
        .collect()
}

/// The mesh's positions in a box of longest side 1 with its lower corner at 0.
pub fn boxed(mesh: &ProcessingMesh) -> Positions<f64> {
    let surface = Surface::new(mesh.mesh(), mesh.positions()).expect("a surface");
    let bounds = surface.bounding_box();
    mesh.positions()
        .map(|p| Point3::from((p - bounds.min) / bounds.longest_side()))
}

/// The edits of `shared/reference/solid`, each with the shape of an elastic body, and the results
/// of other methods by name of the edit.
pub fn solid_cases() -> (Vec<(Case, Positions<f64>)>, Value) {
    let Some(table) = shared("reference/solid/table.json") else {
        return (Vec::new(), Value::Null);
    };
    let text = std::fs::read_to_string(table).expect("readable");
    let table: Value = serde_json::from_str(&text).expect("valid JSON");
    let names = table
        .as_object()
        .into_iter()
        .flatten()
        .map(|(name, _)| name);
    let cases = names.filter_map(|name| solid_case(name)).collect();
    (cases, table)
}

fn solid_case(name: &str) -> Option<(Case, Positions<f64>)> {
    let load = |part: &str| {
        let path = shared(&format!("reference/solid/{name}.{part}.ply"))?;
        let document = cotan_io::load(&path).expect("a reference shape loads");
        let mesh = document.surface_numbered(Weld::AsFormat, Numbering::Document);
        Some(mesh.expect("a reference shape is a manifold"))
    };
    let (mesh, solid) = (load("rest")?, load("solid")?);
    let path = shared(&format!("reference/solid/{name}.handles.txt"))?;
    let text = std::fs::read_to_string(path).expect("readable");
    let (mut vertices, mut targets) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let words: Vec<f64> = line.split_whitespace().flat_map(str::parse).collect();
        if let [v, x, y, z] = words[..] {
            vertices.push(VertexId::new(v as usize));
            targets.push(Point3::new(x, y, z));
        }
    }
    let case = Case {
        name: name.to_owned(),
        positions: mesh.positions().clone(),
        mesh,
        handles: Handles::new().add(vertices, Motion::To(targets)),
        reference: None,
    };
    Some((case, solid.positions().clone()))
}

/// The as-rigid-as-possible energy as defined by libigl and the reference figures: Σ_i Σ_j ⅛ w_ij
/// |e_ij − R_i e⁰_ij|² over the original area.
///
/// It is summed over edges with signed weights and can be negative. [`Quality::arap_energy`] is
/// summed over triangles and cannot.
pub fn arap_energy_by_edges(original: &Surface<'_, f64>, deformed: &Surface<'_, f64>) -> f64 {
    let mesh = original.mesh();
    let mut weights = HalfedgeMap::filled(mesh.num_halfedges(), 0.0);
    let weighed = Cotangent::default().weights(original, &mut weights);
    weighed.expect("a reference mesh has weights");
    let mut energy = 0.0;
    for v in mesh.vertices() {
        let edges = || {
            let halfedges = mesh.outgoing_halfedges(v);
            halfedges.map(|h| {
                (
                    weights[h],
                    original.halfedge_vector(h),
                    deformed.halfedge_vector(h),
                )
            })
        };
        let covariance = edges().map(|(w, a, b)| b * a.transpose() * w).sum();
        let rotation = cotan::flow::nearest_rotation(&covariance);
        let strains = edges().map(|(w, a, b)| w * (b - rotation * a).norm_squared());
        energy += 0.125 * strains.sum::<f64>();
    }
    energy / original.area()
}

/// A deformation to run: a mesh in box units with handles.
pub struct Case {
    /// The name of mesh and drag.
    pub name: String,
    /// The mesh.
    pub mesh: ProcessingMesh,
    /// The positions in box units.
    pub positions: Positions<f64>,
    /// The handles.
    pub handles: Handles<f64>,
    /// The reference entry, if there is one.
    pub reference: Option<Value>,
}

/// The drags of `reference/deform.json`.
pub fn reference_cases() -> Vec<Case> {
    let Some(reference) = reference() else {
        return Vec::new();
    };
    reference["deform"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|entry| {
            let name = entry["mesh"].as_str()?;
            let mesh = model(name)?;
            let positions = boxed(&mesh);
            let handles = Handles::new().add(
                vertex_ids(&entry["handles"]),
                Motion::To(points(&entry["targets"])),
            );
            let name = format!("{name} {}", entry["drag"].as_str()?);
            Some(Case {
                name,
                mesh,
                positions,
                handles,
                reference: Some(entry.clone()),
            })
        })
        .collect()
}

/// The two bend benchmarks (Botsch, Sorkine 2008), with `.sel` and `.def` files next to the
/// model.
pub fn bend_cases() -> Vec<Case> {
    ["bar", "cylinder"]
        .into_iter()
        .filter_map(|name| {
            let folder = format!("bend_benchmark/{name}");
            let mesh = model(&format!("{folder}/00-{name}-original.off"))?;
            let read = |file: String| {
                std::fs::read_to_string(shared(&format!("meshes/{folder}/{file}"))?).ok()
            };
            let words = |text: String| -> Vec<f64> {
                text.lines()
                    .filter(|line| !line.starts_with('#'))
                    .flat_map(str::split_whitespace)
                    .filter_map(|word| word.parse().ok())
                    .collect()
            };
            let status = words(read(format!("{name}.sel"))?);
            let matrix = Matrix4::from_row_slice(&words(read(format!("{name}.def"))?));
            let with = |wanted: f64| {
                status
                    .iter()
                    .enumerate()
                    .filter(|(_, s)| **s == wanted)
                    .map(|(v, _)| VertexId::new(v))
                    .collect::<Vec<_>>()
            };
            let handles = Handles::new().fix(with(0.0)).transform(with(2.0), matrix);
            let positions = mesh.positions().clone();
            Some(Case {
                name: format!("{name} benchmark"),
                mesh,
                positions,
                handles,
                reference: None,
            })
        })
        .collect()
}

/// Deterministic numbers in [-1, 1].
#[derive(Clone, Debug)]
pub struct Draw(u64);

impl Draw {
    /// Starts a sequence.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next number.
    pub fn number(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// A vector of three numbers.
    pub fn vector(&mut self) -> nalgebra::Vector3<f64> {
        nalgebra::Vector3::new(self.number(), self.number(), self.number())
    }

    /// One of `n` vertices.
    pub fn vertex(&mut self, n: usize) -> VertexId {
        VertexId::new((((self.number() + 1.0) * 0.5 * n as f64) as usize).min(n - 1))
    }
}

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
