//! Writing of handles files, as JSON.

use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;

use cotan_io::{Document, ProcessingMesh};
use nalgebra::{Matrix4, Point3};
use serde::Serialize;

use super::{FileVertices, Goal, Group, GroupMotion, HandlesError};

/// Formats groups as a handles file, one handle per line.
///
/// Their vertices are those of the mesh file.
///
/// Numbers are written so that they read back bit for bit. Groups without vertices are omitted. A
/// non-finite number becomes `null`, which is rejected when it is read.
pub fn to_json(groups: &[Group]) -> String {
    let entries = groups.iter().filter(|group| !group.vertices.is_empty());
    let lines: Vec<String> = entries
        // String keys and number values cannot fail.
        .filter_map(|group| serde_json::to_string(&Entry::of(group)).ok())
        .map(|line| format!("\n  {line}"))
        .collect();
    format!("{{\"handles\": [{}\n]}}\n", lines.join(","))
}

/// Replaces the vertices of a repaired document by those of the original file.
///
/// Copies that a repair made of a vertex become one.
///
/// # Errors
/// [`HandlesError::Copies`] if the copies of a vertex are not all held alike, since a handle on
/// the vertex holds all of them.
pub fn groups_in_file(
    groups: &[Group],
    document: &Document,
    processing: &ProcessingMesh,
    file_vertices: &FileVertices,
) -> Result<Vec<Group>, HandlesError> {
    let rest = document.positions();
    // The goal of each vertex of the surface, and its group.
    let mut goals: HashMap<usize, (usize, [u64; 4])> = HashMap::new();
    for (index, group) in groups.iter().enumerate() {
        for (vertex, goal) in group.goals(rest) {
            goals.insert(vertex, (index, bits(goal)));
        }
    }
    let on_surface = |copy| {
        processing
            .vertex(copy)
            .map(|v| processing.document_vertex(v))
    };
    let mut renumbered = Vec::with_capacity(groups.len());
    for group in groups {
        let mut written: HashSet<usize> = HashSet::new();
        let mut kept = Vec::new();
        for (place, &vertex) in group.vertices.iter().enumerate() {
            let file = file_vertices.vertex(vertex);
            let goal = goals.get(&vertex);
            let copies = file_vertices.in_document(file).filter_map(on_surface);
            for copy in copies {
                if goals.get(&copy) != goal {
                    return Err(HandlesError::Copies { vertex: file });
                }
            }
            if written.insert(file) {
                kept.push((place, file));
            }
        }
        let motion = match &group.motion {
            GroupMotion::To(points) => GroupMotion::To(
                kept.iter()
                    .filter_map(|&(place, _)| points.get(place).copied())
                    .collect(),
            ),
            other => other.clone(),
        };
        renumbered.push(Group {
            vertices: kept.into_iter().map(|(_, file)| file).collect(),
            motion,
            weight: group.weight,
            turn: group.turn,
        });
    }
    Ok(renumbered)
}

fn bits(goal: Goal) -> [u64; 4] {
    match goal {
        Goal::Stay => [0; 4],
        Goal::To(point) => [1, point.x.to_bits(), point.y.to_bits(), point.z.to_bits()],
    }
}

/// A handle in written form, the counterpart of the one read in `json`.
#[derive(Serialize)]
struct Entry<'a> {
    vertices: &'a [usize],
    #[serde(skip_serializing_if = "Option::is_none")]
    fixed: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    transform: Option<Transform>,
    #[serde(skip_serializing_if = "Option::is_none")]
    to: Option<Vec<[f64; 3]>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    weight: Option<f64>,
}

#[derive(Serialize)]
struct Transform {
    matrix: [[f64; 4]; 4],
    /// A rotation vector in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    turn: Option<[f64; 3]>,
}

impl<'a> Entry<'a> {
    fn of(group: &'a Group) -> Self {
        let mut entry = Self {
            vertices: &group.vertices,
            fixed: None,
            transform: None,
            to: None,
            weight: group.weight,
        };
        match &group.motion {
            GroupMotion::Fixed => entry.fixed = Some(true),
            GroupMotion::Matrix(matrix) => {
                entry.transform = Some(Transform {
                    matrix: rows(matrix),
                    turn: group
                        .turn
                        .filter(|turn| turn.norm() > PI)
                        .map(|turn| turn.map(f64::to_degrees).into()),
                });
            }
            GroupMotion::To(points) => entry.to = Some(points.iter().map(triple).collect()),
        }
        entry
    }
}

fn rows(matrix: &Matrix4<f64>) -> [[f64; 4]; 4] {
    [0, 1, 2, 3].map(|i| [0, 1, 2, 3].map(|j| matrix[(i, j)]))
}

fn triple(point: &Point3<f64>) -> [f64; 3] {
    [point.x, point.y, point.z]
}
