//! Meshes with scattered indices are renumbered for processing, and nowhere else.

use cotan_geometry::Mesh;
use cotan_geometry::shapes::{VertexOrder, irregular};
use cotan_io::{Document, Format, Limits, Numbering, Weld};
use nalgebra::Vector3;

fn scattered() -> Mesh<f64> {
    irregular(5_000, VertexOrder::Random, 3)
}

fn document(shape: &Mesh<f64>) -> Document {
    Document::from_mesh(shape.connectivity(), shape.positions()).expect("a document")
}

#[test]
fn only_scattered_documents_are_renumbered() {
    let natural = irregular(5_000, VertexOrder::Natural, 3);
    let kept = document(&natural).surface().expect("a surface");
    assert!(!kept.is_renumbered());
    let mesh = kept.mesh();
    assert!(
        mesh.vertices()
            .all(|v| kept.document_vertex(v) == v.index())
    );
    assert!(mesh.faces().all(|f| kept.document_face(f) == f.index()));

    let scattered = document(&scattered());
    assert!(scattered.surface().expect("a surface").is_renumbered());
    let as_it_is = scattered.surface_numbered(Weld::AsFormat, Numbering::Document);
    let as_it_is = as_it_is.expect("a surface");
    assert!(!as_it_is.is_renumbered());
    assert!(
        as_it_is
            .mesh()
            .vertices()
            .all(|v| as_it_is.document_vertex(v) == v.index())
    );
    let forced = document(&natural).surface_numbered(Weld::AsFormat, Numbering::Spatial);
    assert!(forced.expect("a surface").is_renumbered());
}

#[test]
fn the_maps_lead_to_the_same_surface() {
    let shape = scattered();
    let document = document(&shape);
    let processing = document.surface().expect("a surface");
    let mesh = processing.mesh();
    for v in mesh.vertices() {
        let own = processing.document_vertex(v);
        assert_eq!(processing.vertex(own), Some(v));
        assert_eq!(processing.positions()[v], document.positions()[own]);
    }
    let mut seen = vec![false; mesh.num_faces()];
    for f in mesh.faces() {
        let face = processing.document_face(f);
        assert!(!std::mem::replace(&mut seen[face], true));
        let corners = mesh
            .triangle(f)
            .map(|v| processing.document_vertex(v) as u32);
        assert_eq!(document.faces().iter().nth(face), Some(&corners[..]));
    }
}

#[test]
fn positions_go_back_to_their_own_vertices() {
    let mut document = document(&scattered());
    let before = document.positions().to_vec();
    let processing = document.surface().expect("a surface");
    let moved = processing
        .positions()
        .map(|p| p + Vector3::new(0.0, p.x, 1.0));
    document
        .set_positions(&processing, &moved)
        .expect("they fit");
    for (p, q) in before.iter().zip(document.positions()) {
        assert_eq!(p + Vector3::new(0.0, p.x, 1.0), *q);
    }
    let file = document.write(Format::Obj).expect("text");
    let again = cotan_io::read(file, None, &Limits::default()).expect("a mesh");
    assert!(again.faces().iter().eq(document.faces().iter()));
}

#[test]
fn defects_are_those_of_the_document() {
    let shape = scattered();
    let mut faces: Vec<[u32; 3]> = shape
        .connectivity()
        .faces()
        .map(|f| shape.connectivity().triangle(f).map(|v| v.index() as u32))
        .collect();
    // Two reversed faces: each gives three edges with the same direction twice.
    for face in [4_000, 70] {
        faces[face].swap(0, 1);
    }
    let points = shape.positions().as_slice().to_vec();
    let broken = Document::new(points, faces.into_iter().collect()).expect("a document");
    let error = |numbering| {
        let built = broken.surface_numbered(Weld::AsFormat, numbering);
        built.expect_err("not oriented").to_string()
    };
    assert_eq!(error(Numbering::Auto), error(Numbering::Document));
    assert_eq!(error(Numbering::Spatial), error(Numbering::Document));
}
