use super::*;
use crate::file::read;
use crate::limits::Limits;
use nalgebra::Vector3;

// Vertex 1 is used by no face.
const FILE: &str = "v 0 0 0\nv 9 9 9\nv 1.10 0 0\nv 1 1 0\nv 0 1 0\nf 1 3 4 5\n";

fn document() -> Document {
    read(FILE, None, &Limits::default()).unwrap()
}

#[test]
fn the_maps_lead_there_and_back() {
    let processing = document().surface().unwrap();
    assert_eq!(
        (
            processing.mesh().num_vertices(),
            processing.mesh().num_faces()
        ),
        (4, 2)
    );
    assert_eq!(processing.vertex(1), None);
    assert_eq!(processing.vertex(5), None);
    for v in processing.mesh().vertices() {
        assert_eq!(processing.vertex(processing.document_vertex(v)), Some(v));
    }
    for f in processing.mesh().faces() {
        assert_eq!(processing.document_face(f), 0);
    }
}

#[test]
fn only_moved_vertices_are_written() {
    let mut document = document();
    let processing = document.surface().unwrap();
    let mut positions = processing.positions().map(|p| p.map(|x| x as f32));
    document.set_positions(&processing, &positions).unwrap();
    assert_eq!(document.write(Format::Obj).unwrap(), FILE.as_bytes());

    positions[processing.vertex(4).unwrap()] += Vector3::new(0.0, 0.5, 0.0);
    document.set_positions(&processing, &positions).unwrap();
    let written = String::from_utf8(document.write(Format::Obj).unwrap()).unwrap();
    assert_eq!(written, FILE.replace("v 0 1 0", "v 0 1.5 0"));

    // A move can be undone.
    document
        .set_positions(&processing, processing.positions())
        .unwrap();
    assert_eq!(document.write(Format::Obj).unwrap(), FILE.as_bytes());
}

#[test]
fn positions_that_do_not_fit_change_nothing() {
    let mut document = document();
    let processing = document.surface().unwrap();
    let mut positions = processing.positions().map(|p| p * 2.0);
    positions[processing.vertex(4).unwrap()].y = f64::NAN;
    let error = document.set_positions(&processing, &positions).unwrap_err();
    assert!(
        matches!(error, IoError::NonFinitePosition { vertex: 4 }),
        "{error}"
    );
    let short = Positions::from_vec(vec![Point3::<f64>::origin(); 3]);
    assert!(document.set_positions(&processing, &short).is_err());
    assert!(document.set_position(5, Point3::origin()).is_err());
    assert_eq!(document.write(Format::Obj).unwrap(), FILE.as_bytes());
}

#[test]
fn defects_are_named_in_the_numbers_of_the_file() {
    let file = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 2 3 4 5\nf 3 4 5\n";
    let document = read(file, None, &Limits::default()).unwrap();
    let error = document.surface().unwrap_err().to_string();
    assert!(
        error.contains("faces 0 and 1") && error.contains("vertex 2"),
        "{error}"
    );
}

#[test]
fn a_document_made_in_memory_is_checked() {
    let points = vec![
        Point3::origin(),
        Point3::new(1.0, 0.0, 0.0),
        Point3::new(0.0, 1.0, 0.0),
    ];
    let made = |faces: &[&[u32]]| Document::new(points.clone(), faces.iter().collect());
    assert!(made(&[&[0, 1, 2]]).is_ok());
    assert!(matches!(
        made(&[&[0, 1]]),
        Err(IoError::FaceCorners { face: 0, degree: 2 })
    ));
    assert!(matches!(
        made(&[&[0, 1, 3]]),
        Err(IoError::FaceVertex { vertex: 3, .. })
    ));
    assert!(matches!(
        Document::new(vec![Point3::new(0.0, f64::NAN, 0.0)], FaceList::new()),
        Err(IoError::NonFinitePosition { vertex: 0 })
    ));
    assert!(matches!(
        Document::new(Vec::new(), FaceList::new()),
        Err(IoError::Empty)
    ));
    let points_only = Document::new(points, FaceList::new()).unwrap();
    assert!(matches!(
        points_only.surface(),
        Err(IoError::NoFaces { num_vertices: 3 })
    ));
}
