//! Describes the contents of a mesh file, manifold or not.
//!
//! Topology and defects come from [`Document::inspect`]. Areas and angles are measured on the
//! polygonal surface, or on the same faces with separate corners, which always form a surface.

use std::collections::{BTreeMap, BTreeSet};

use cotan::DeformOptions;
use cotan::geometry::{AngleStatistics, BoundingBox, Surface, negative_cotangent_share};
use cotan_io::{Document, IoError, ProcessingMesh, Weld};
use cotan_tool::part_names::PartNames;
use serde::Serialize;

use crate::parts::{self, PartFields};
use crate::report::{Defect, listed};

/// One part of a file that has several.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub(crate) struct Part {
    pub(crate) name: String,
    pub(crate) vertices: usize,
    pub(crate) faces: usize,
}

/// A connected component, a part for `cotan deform`.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(crate) struct ComponentPart {
    /// Its number in the order of the file.
    pub(crate) part: usize,
    /// The name of its node, object, group or material; may be empty.
    pub(crate) name: String,
    pub(crate) vertices: usize,
    /// The parts that it follows if the one with the largest area drives.
    pub(crate) follows: Vec<usize>,
}

/// The output of `cotan info`.
#[derive(Debug, Serialize)]
pub(crate) struct Inspection {
    pub(crate) file: String,
    pub(crate) format: Option<String>,
    /// Irregularities of the file that did not prevent reading it.
    pub(crate) warnings: Vec<String>,
    /// The meshes of the file, if it has several.
    pub(crate) parts: Vec<Part>,
    /// The names of the attributes of vertices, corners and faces.
    pub(crate) attributes: Vec<String>,
    pub(crate) vertices: usize,
    /// Vertices that no face uses.
    pub(crate) unreferenced_vertices: usize,
    /// The number of faces in the file, and the number of faces per corner count.
    pub(crate) faces: usize,
    pub(crate) corners: BTreeMap<usize, usize>,
    /// Triangles that the faces are cut into.
    pub(crate) triangles: usize,
    /// Edges of the file's faces.
    pub(crate) edges: usize,
    pub(crate) boundary_edges: usize,
    pub(crate) components: usize,
    /// The components, if there are several and the mesh is manifold.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) component_parts: Vec<ComponentPart>,
    pub(crate) manifold: bool,
    pub(crate) closed: bool,
    /// V − E + F of the used vertices and the file's faces.
    pub(crate) euler_characteristic: i64,
    /// The numbers of holes and of topological handles over all components, if the mesh is
    /// manifold.
    pub(crate) boundary_loops: Option<usize>,
    pub(crate) genus: Option<i64>,
    pub(crate) bounding_box: Bounds,
    pub(crate) area: Option<f64>,
    /// The enclosed volume; `null` unless closed and manifold.
    pub(crate) volume: Option<f64>,
    pub(crate) angles: Option<Angles>,
    pub(crate) edge_lengths: Option<Lengths>,
    /// The share of edges with cot α + cot β < 0, if the mesh is manifold.
    pub(crate) negative_cotangent_share: Option<f64>,
    pub(crate) degenerate_faces: usize,
    /// A description of what welding would join.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) weldable: Option<String>,
    /// The reason why no half-edge mesh can be built, if so.
    pub(crate) problem: Option<String>,
    /// The number of defects of each kind.
    pub(crate) defect_counts: BTreeMap<&'static str, usize>,
    /// The first defects of each kind.
    pub(crate) defects: Vec<Defect>,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Bounds {
    pub(crate) min: [f64; 3],
    pub(crate) max: [f64; 3],
    pub(crate) diagonal: f64,
}

/// Angles in degrees.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Angles {
    pub(crate) min_degrees: f64,
    pub(crate) max_degrees: f64,
    pub(crate) mean_smallest_degrees: f64,
}

#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Lengths {
    pub(crate) min: f64,
    pub(crate) mean: f64,
    pub(crate) max: f64,
}

/// Inspects a document that was read from `file`. Lists at most `limit` defects of each kind.
pub(crate) fn inspect(
    file: String,
    document: &Document,
    weld: Weld,
    limit: usize,
) -> Result<Inspection, IoError> {
    let found = document.inspect(weld)?;
    let processing = document.surface_with(weld);
    let problem = processing.as_ref().err().map(|error| match error {
        // The cure is listed with the defects.
        IoError::NotManifold(error) => error.to_string(),
        error => error.to_string(),
    });
    let (defect_counts, defects) = listed(&found.defects, limit);
    let degenerate: BTreeSet<_> = found
        .defects
        .iter()
        .filter_map(|defect| match defect {
            cotan_io::Defect::ZeroArea { face } | cotan_io::Defect::RepeatedVertex { face, .. } => {
                Some(face)
            }
            _ => None,
        })
        .collect();
    let unreferenced = cotan_io::DefectKind::UnreferencedVertex;
    let mut inspection = Inspection {
        file,
        format: document.format().map(|format| format.to_string()),
        warnings: document
            .warnings()
            .iter()
            .map(ToString::to_string)
            .collect(),
        parts: parts(document),
        attributes: attributes(document),
        vertices: document.positions().len(),
        unreferenced_vertices: found.count(unreferenced),
        faces: document.faces().len(),
        corners: degrees(document),
        triangles: document.faces().num_triangles(),
        edges: found.num_edges,
        boundary_edges: found.num_boundary_edges,
        components: found.components.len(),
        component_parts: Vec::new(),
        manifold: problem.is_none(),
        closed: found.is_closed(),
        euler_characteristic: found.euler_characteristic(),
        boundary_loops: None,
        genus: None,
        bounding_box: bounds(document),
        area: None,
        volume: None,
        angles: None,
        edge_lengths: found
            .edge_lengths
            .map(|[min, mean, max]| Lengths { min, mean, max }),
        negative_cotangent_share: None,
        degenerate_faces: degenerate.len(),
        weldable: document
            .weldable(weld)?
            .map(|weldable| weldable.to_string()),
        problem,
        defect_counts,
        defects,
    };
    if let Ok(processing) = &processing {
        inspection.measure_manifold(processing, found.num_boundaries);
        inspection.component_parts = component_parts(document, processing)?;
    }
    let has_polygons = document.faces().num_triangles() > document.faces().len();
    match processing {
        // The triangulation that other commands work on, in which neighbouring faces are cut
        // consistently.
        Ok(processing) if has_polygons => inspection.measure_triangles(&processing),
        _ => {
            if let Some(soup) = soup(document) {
                inspection.measure_triangles(&soup);
            }
        }
    }
    Ok(inspection)
}

fn parts(document: &Document) -> Vec<Part> {
    let part = |part: &cotan_io::Part| Part {
        name: part.name.clone(),
        vertices: part.vertices.len(),
        faces: part.faces.len(),
    };
    match document.parts() {
        [_] => Vec::new(),
        parts => parts.iter().map(part).collect(),
    }
}

/// The components with their names and the parts that they follow; none for a single one.
fn component_parts(
    document: &Document,
    processing: &ProcessingMesh,
) -> Result<Vec<ComponentPart>, IoError> {
    let survey = cotan::survey(processing.surface(), &DeformOptions::default());
    let Ok(survey) = survey else {
        return Ok(Vec::new());
    };
    if survey.is_empty() {
        return Ok(Vec::new());
    }
    let names = PartNames::new(document, processing)?;
    let parts = parts::fields(&survey, &names).into_iter();
    let part = |part: PartFields| ComponentPart {
        part: part.part,
        name: part.name,
        vertices: part.vertices,
        follows: part.follows,
    };
    Ok(parts.map(part).collect())
}

/// Names of the attributes, or the reason why they cannot be read.
fn attributes(document: &Document) -> Vec<String> {
    let attributes = match document.attributes() {
        Ok(attributes) => attributes,
        Err(error) => return vec![format!("not readable: {error}")],
    };
    let mut names = Vec::new();
    let mut property = |element: &str, name: &str, components: usize| {
        names.push(match components {
            0 | 1 => format!("{element} {name}"),
            n => format!("{element} {name} ({n})"),
        });
    };
    for p in &attributes.vertices {
        property("vertex", &p.name, p.components);
    }
    for p in &attributes.faces {
        property("face", &p.name, p.components);
    }
    for p in &attributes.corners {
        property("corner", &p.name, p.components);
    }
    for labels in &attributes.labels {
        let kind = format!("{:?}", labels.kind).to_lowercase();
        names.push(format!(
            "{} of kind {kind}",
            crate::report::counted(labels.names.len(), "label")
        ));
    }
    names
}

impl Inspection {
    /// Adds this welding to the options that cure the defects, which were found with it.
    pub(crate) fn cure_with(&mut self, weld: Weld) {
        for defect in &mut self.defects {
            defect.cure_with(weld);
        }
    }

    fn measure_manifold(&mut self, processing: &ProcessingMesh, loops: usize) {
        self.boundary_loops = Some(loops);
        // V − E + F = 2 C − 2 g − B, summed over the components.
        let (components, loops) = (self.components as i64, loops as i64);
        self.genus = Some((2 * components - loops - self.euler_characteristic) / 2);
        if let Ok(surface) = Surface::new(processing.mesh(), processing.positions()) {
            self.negative_cotangent_share = Some(negative_cotangent_share(&surface));
            self.volume = self.closed.then(|| surface.volume());
        }
    }

    fn measure_triangles(&mut self, soup: &ProcessingMesh) {
        let Ok(surface) = Surface::new(soup.mesh(), soup.positions()) else {
            return;
        };
        self.area = Some(surface.area());
        let AngleStatistics {
            min,
            max,
            mean_smallest,
        } = surface.angle_statistics();
        self.angles = Some(Angles {
            min_degrees: min.to_degrees(),
            max_degrees: max.to_degrees(),
            mean_smallest_degrees: mean_smallest.to_degrees(),
        });
    }
}

/// The document's polygons, cut into triangles that share no vertices.
fn soup(document: &Document) -> Option<ProcessingMesh> {
    let positions = document
        .faces()
        .iter()
        .flatten()
        .map(|&v| document.positions()[v as usize]);
    let mut next = 0..;
    let faces = document
        .faces()
        .iter()
        .map(|polygon| -> Vec<u32> { next.by_ref().take(polygon.len()).collect() });
    Document::new(positions.collect(), faces.collect())
        .ok()?
        .surface()
        .ok()
}

fn degrees(document: &Document) -> BTreeMap<usize, usize> {
    let mut degrees = BTreeMap::new();
    for polygon in document.faces().iter() {
        *degrees.entry(polygon.len()).or_default() += 1;
    }
    degrees
}

fn bounds(document: &Document) -> Bounds {
    // A document has at least one vertex.
    let bounds = BoundingBox::of(document.positions()).map(|b| (b.min, b.max, b.diagonal()));
    let (min, max, diagonal) = bounds.unwrap_or_default();
    Bounds {
        min: min.into(),
        max: max.into(),
        diagonal,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cotan_io::{Limits, read};

    fn inspect_obj(text: &str) -> Inspection {
        inspect(
            "test.obj".into(),
            &read(text, None, &Limits::default()).unwrap(),
            Weld::AsFormat,
            20,
        )
        .unwrap()
    }

    const TETRAHEDRON: &str =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

    #[test]
    fn a_closed_mesh() {
        let tetrahedron = inspect_obj(TETRAHEDRON);
        assert!(tetrahedron.closed && tetrahedron.manifold);
        assert_eq!(
            (tetrahedron.genus, tetrahedron.boundary_loops),
            (Some(0), Some(0))
        );
        assert_eq!(
            (tetrahedron.edges, tetrahedron.euler_characteristic),
            (6, 2)
        );
        assert!((tetrahedron.volume.unwrap() - 1.0 / 6.0).abs() < 1e-12);
        assert!(tetrahedron.defects.is_empty());
    }

    #[test]
    fn an_open_quad_with_an_unreferenced_vertex() {
        let quad = inspect_obj("v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 9 9 9\nf 1 2 3 4\n");
        assert_eq!(
            (quad.boundary_loops, quad.genus, quad.components),
            (Some(1), Some(0), 1)
        );
        assert_eq!(
            (quad.triangles, quad.corners[&4], quad.unreferenced_vertices),
            (2, 1, 1)
        );
        assert!((quad.area.unwrap() - 4.0).abs() < 1e-12);
        assert_eq!((quad.closed, quad.volume), (false, None));
        let kinds: Vec<_> = quad.defects.iter().map(|d| d.kind).collect();
        assert_eq!(kinds, ["hole", "unreferenced vertex"]);
        assert_eq!(quad.defects[1].vertices, [4]);
    }

    #[test]
    fn defects_are_listed_with_their_elements() {
        let fin = inspect_obj(&format!("{TETRAHEDRON}v 0 0 -1\nf 1 2 5\n"));
        assert!(!fin.manifold && fin.problem.is_some() && fin.genus.is_none());
        let edge = fin
            .defects
            .iter()
            .find(|d| d.kind == "non-manifold edge")
            .unwrap();
        assert_eq!(
            (edge.vertices.as_slice(), edge.faces.len()),
            ([0, 1].as_slice(), 3)
        );

        let turned = inspect_obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n");
        assert_eq!(turned.defects[0].kind, "inconsistent orientation");
        assert_eq!(turned.defects[0].faces, [0, 1]);

        let bow_tie =
            inspect_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3\nf 1 4 5\n");
        assert_eq!(bow_tie.defects[0].kind, "several fans");
        assert_eq!(bow_tie.defects[0].vertices, [0]);

        let flat = inspect_obj("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 1 2\n");
        assert_eq!(flat.degenerate_faces, 2);
        assert_eq!(flat.defect_counts["repeated vertex"], 1);
    }
}
