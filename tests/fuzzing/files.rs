//! Files of all formats: read or refused, written back in full, converted.

use cotan_io::{
    Attributes, COLOR, CornerProperty, Document, FaceList, Format, LabelKind, Labels, Limits, NONE,
    NORMAL, Property, Repair, UV, Values, Weld, read,
};
use nalgebra::Point3;

use super::draw::Draw;

/// Limits that keep each fuzzing run short.
pub(super) fn limits() -> Limits {
    Limits {
        max_bytes: 1 << 20,
        max_vertices: 1 << 14,
        max_faces: 1 << 15,
        max_corners: 1 << 16,
        max_memory: 64 << 20,
        ..Limits::default()
    }
}

/// Reads the bytes as a file of `format` (unless they announce another one) and checks all
/// invariants of the document.
pub fn read_as(data: &[u8], format: Format) {
    match read(data, Some(format), &limits()) {
        Ok(document) => check(&document, data),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

fn check(document: &Document, bytes: &[u8]) {
    let Some(own) = document.format() else {
        panic!("a document that was read has a format");
    };
    let num_vertices = document.positions().len();
    assert!(num_vertices > 0);
    for p in document.positions() {
        assert!(p.iter().all(|x| x.is_finite()), "{p}");
    }
    for polygon in document.faces().iter() {
        assert!(polygon.len() >= 3 && polygon.iter().all(|&v| (v as usize) < num_vertices));
    }
    let same = write(document, own);
    // A compressed file is written uncompressed.
    assert!(
        same == bytes || bytes.starts_with(b"\x1f\x8b"),
        "{own} changed"
    );

    if let Ok(attributes) = document.attributes() {
        let attributes = attributes.into_owned();
        let made = Document::new(document.positions().to_vec(), document.faces().clone())
            .and_then(|made| made.with_attributes(attributes));
        made.unwrap_or_else(|error| panic!("attributes of {own}: {error}"));
        for format in Format::ALL {
            document.losses(format);
            convert(document, format);
        }
    }
    move_all(document, own);
    repair(document);
}

fn write(document: &Document, format: Format) -> Vec<u8> {
    document
        .write(format)
        .unwrap_or_else(|error| panic!("{format}: {error}"))
}

/// Returns `true` if a file written as `format` looks like another format; a comment may hold any
/// bytes.
pub(super) fn announces_another(bytes: &[u8], format: Format) -> bool {
    Format::from_content(bytes).is_some_and(|found| found != format)
}

fn has_nodes(document: &Document) -> bool {
    matches!(document.format(), Some(Format::Gltf | Format::Glb))
}

/// Checks that every format holds the surface or reports that its number type cannot.
fn convert(document: &Document, format: Format) {
    let Ok(bytes) = document.write(format) else {
        return;
    };
    if announces_another(&bytes, format) {
        return;
    }
    let triangles = document.faces().num_triangles();
    let again = match read(bytes, Some(format), &Limits::default()) {
        Ok(again) => again,
        Err(error) => {
            assert!(triangles == 0, "{format}: {error}");
            return;
        }
    };
    // In the new file each further instance of a mesh has faces of its own, after all others.
    let has_instances = has_nodes(document) && !has_nodes(&again);
    let found = again.faces().num_triangles();
    assert!(
        found == triangles || has_instances && found > triangles,
        "as {format}"
    );
    let (expected, mut found) = (places(document), places(&again));
    let is_plain = document.faces().iter().all(|polygon| polygon.len() == 3);
    match format {
        Format::Obj | Format::Ply | Format::Off => {
            found.truncate(expected.len());
            assert_eq!(found, expected, "as {format}");
        }
        // Polygons are cut in formats of triangles.
        _ if !is_plain || has_instances => {}
        // Materials may change the order of faces, and the transform of a node rounds
        // differently.
        Format::Gltf | Format::Glb => {
            let largest =
                |points: &[Point3<f64>]| points.iter().map(|p| p.coords.amax()).fold(0.0, f64::max);
            let most = 1e-6 * largest(&expected);
            for axis in 0..3 {
                let sorted = |points: &[Point3<f64>]| {
                    let mut numbers: Vec<f64> = points.iter().map(|p| p[axis]).collect();
                    numbers.sort_by(f64::total_cmp);
                    numbers
                };
                for (a, b) in sorted(&found).iter().zip(sorted(&expected)) {
                    assert!((a - b).abs() <= most, "{a} is not {b} as {format}");
                }
            }
        }
        _ => {
            let single = |p: &Point3<f64>| p.map(|x| f64::from(x as f32));
            let expected: Vec<_> = expected.iter().map(single).collect();
            assert_eq!(found, expected, "as {format}");
        }
    }
}

/// Checks that moved vertices are read back and that nothing else changes.
fn move_all(document: &Document, own: Format) {
    let Ok(surface) = document.surface_in_pieces(Weld::AsFormat) else {
        return;
    };
    assert!(surface.mesh().is_triangle_mesh());
    surface
        .mesh()
        .validate()
        .unwrap_or_else(|error| panic!("{error}"));
    let mut moved = document.clone();
    let positions = surface
        .positions()
        .map(|p| p.map(|x| (x * 0.5).round() + 1.0));
    moved
        .set_positions(&surface, &positions)
        .unwrap_or_else(|error| panic!("{error}"));
    // The number type may be too small, and a normal may be NaN.
    let Ok(bytes) = moved.write(own) else { return };
    if announces_another(&bytes, own) {
        return;
    }
    let again = read(bytes, Some(own), &limits()).unwrap_or_else(|error| panic!("{own}: {error}"));
    assert_eq!(again.faces().num_corners(), moved.faces().num_corners());
    let is_local = matches!(own, Format::Gltf | Format::Glb);
    if own != Format::Stl {
        for (a, b) in again.positions().iter().zip(moved.positions()) {
            // A round trip through the transform of a node loses nothing but rounding.
            let scale = b.coords.amax().max(1.0);
            let close = (a - b).amax() <= 1e-3 * scale;
            assert!(close || is_local, "{a} is not {b}");
        }
    }
}

/// Checks that repairing everything leaves a surface or nothing, whatever the faces are.
fn repair(document: &Document) {
    let Ok(repaired) = Repair::all().apply(document) else {
        return;
    };
    let document = repaired.document;
    if !document.faces().is_empty() {
        let surface = document.surface_with(Weld::AsFormat);
        surface.unwrap_or_else(|error| panic!("after repair: {error}"));
    }
}

/// Writes a document with attributes of all kinds in every format and reads it back.
pub fn document_roundtrip(data: &[u8]) {
    let mut draw = Draw::new(data);
    let Some(document) = arbitrary(&mut draw) else {
        return;
    };
    for format in Format::ALL {
        let Ok(bytes) = document.write(format) else {
            continue;
        };
        let again = match read(bytes.as_slice(), Some(format), &Limits::default()) {
            Ok(again) => again,
            Err(error) => {
                // A file of triangles cannot be empty.
                assert!(document.faces().is_empty(), "{format}: {error}");
                continue;
            }
        };
        assert_eq!(again.format(), Some(format));
        let attributes = again
            .attributes()
            .unwrap_or_else(|error| panic!("{format}: {error}"));
        assert_eq!(
            again.faces().num_triangles(),
            document.faces().num_triangles()
        );
        if matches!(format, Format::Obj | Format::Ply | Format::Off) {
            assert_eq!(again.faces(), document.faces(), "{format}");
            assert_eq!(again.positions(), document.positions(), "{format}");
            if document.losses(format).is_empty() {
                let expected = document
                    .attributes()
                    .unwrap_or_else(|error| panic!("{error}"));
                assert_same(&expected, &attributes, format);
            }
        }
        assert!(write(&again, format) == bytes, "{format} changed");
        // A second round trip loses nothing more.
        let made = Document::new(again.positions().to_vec(), again.faces().clone())
            .and_then(|made| made.with_attributes(attributes.into_owned()))
            .unwrap_or_else(|error| panic!("{format}: {error}"));
        let twice = read(write(&made, format), Some(format), &Limits::default())
            .unwrap_or_else(|error| panic!("{format}: {error}"));
        if matches!(format, Format::Gltf | Format::Glb) {
            // Faces shared by two materials are read with separate vertices.
            assert_eq!(places(&twice), places(&again), "{format}");
            continue;
        }
        assert_eq!(twice.positions(), again.positions(), "{format}");
        assert_eq!(twice.faces(), again.faces(), "{format}");
    }
}

/// The positions of all corners, face by face.
fn places(document: &Document) -> Vec<Point3<f64>> {
    let corners = document.faces().corners().iter();
    corners.map(|&v| document.positions()[v as usize]).collect()
}

/// Checks that numbers, names and comments are the same, whatever type and table they are stored
/// in.
fn assert_same(expected: &Attributes, found: &Attributes, format: Format) {
    let numbers = |p: &Property| -> Vec<f64> {
        let unit = unit(&p.name, &p.values);
        (0..p.values.len())
            .filter_map(|i| Some(p.values.get(i)? / unit))
            .collect()
    };
    for (expected, found) in [
        (&expected.vertices, &found.vertices),
        (&expected.faces, &found.faces),
    ] {
        // If the format does not allow a name, comparing the numbers suffices.
        let mut left: Vec<_> = found
            .iter()
            .map(|p| (p.name.as_str(), numbers(p)))
            .collect();
        // OBJ stores these per corner.
        let at_corners =
            |p: &Property| format == Format::Obj && [NORMAL, UV].contains(&p.name.as_str());
        for p in expected
            .iter()
            .filter(|p| !p.values.is_empty() && !at_corners(p))
        {
            let mut take = |wanted: &[f64]| {
                // Colours stored as integers are written as fractions with 32-bit precision.
                let fraction = |name: &str, other: &Vec<f64>| {
                    p.name == COLOR
                        && name == COLOR
                        && other.len() == wanted.len()
                        && other.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6)
                };
                let same = |(name, other): &(&str, Vec<f64>)| {
                    close(other, wanted, &p.values) || fraction(name, other)
                };
                let at = left.iter().position(same);
                at.map(|at| left.swap_remove(at)).is_some()
            };
            // An attribute without standard component names may be stored as one property per
            // component.
            let numbers = numbers(p);
            let column = |k: usize| -> Vec<f64> {
                let values = (0..p.values.len()).skip(k).step_by(p.components);
                values.filter_map(|i| p.values.get(i)).collect()
            };
            let is_there = take(&numbers) || (0..p.components).all(|k| take(&column(k)));
            assert!(is_there, "{format}: {p:?} is not in {found:?}");
        }
    }
    for p in &expected.corners {
        let used = p.indices.iter().any(|&i| i != NONE);
        let values = |p: &CornerProperty| -> Vec<f64> {
            let number = |i: u32, k: usize| match i {
                NONE => f64::INFINITY,
                i => p
                    .values
                    .get(i as usize * p.components + k)
                    .unwrap_or(f64::NAN),
            };
            let corners = p.indices.iter();
            corners
                .flat_map(|&i| (0..p.components).map(move |k| (i, k)))
                .map(|(i, k)| number(i, k))
                .collect()
        };
        match found.corner(&p.name) {
            Some(found) => assert!(
                close(&values(found), &values(p), &p.values),
                "{format}: {found:?} {p:?}"
            ),
            None => assert!(!used, "{format}: there is no {}", p.name),
        }
    }
    for l in &expected.labels {
        let name = |l: &Labels, face: usize| l.names.get(l.faces[face] as usize).cloned();
        for face in 0..l.faces.len() {
            let found = found.label(l.kind).and_then(|found| name(found, face));
            assert_eq!(
                found,
                name(l, face),
                "{format}: {:?} of face {face}",
                l.kind
            );
        }
    }
    assert_eq!(found.comments, expected.comments, "{format}");
}

/// The value that represents 1: integer colours are fractions of the type's largest value.
fn unit(name: &str, values: &Values) -> f64 {
    match values {
        _ if name != COLOR => 1.0,
        Values::I8(_) => i8::MAX.into(),
        Values::U8(_) => u8::MAX.into(),
        Values::I16(_) => i16::MAX.into(),
        Values::U16(_) => u16::MAX.into(),
        Values::I32(_) => i32::MAX.into(),
        Values::U32(_) => u32::MAX.into(),
        _ => 1.0,
    }
}

fn close(a: &[f64], b: &[f64], of: &Values) -> bool {
    // Text formats write as many digits of a 32-bit number as reading it back requires.
    let is_single = matches!(of, Values::F32(_));
    let same = |(a, b): (&f64, &f64)| {
        a == b || a.is_nan() && b.is_nan() || is_single && (*a as f32) == (*b as f32)
    };
    a.len() == b.len() && a.iter().zip(b).all(same)
}

/// A small document, or `None` if its faces are refused.
fn arbitrary(draw: &mut Draw<'_>) -> Option<Document> {
    let num_vertices = 3 + draw.below(20);
    let positions = (0..num_vertices)
        .map(|_| Point3::new(draw.real(), draw.real(), draw.real()))
        .collect();
    let faces: FaceList = (0..draw.below(20))
        .map(|_| -> Vec<u32> {
            let degree = 3 + draw.below(4);
            (0..degree)
                .map(|_| draw.below(num_vertices) as u32)
                .collect()
        })
        .collect();
    let mut attributes = Attributes::default();
    let (num_faces, num_corners) = (faces.len(), faces.num_corners());
    for _ in 0..draw.below(5) {
        add_attribute(
            draw,
            &mut attributes,
            [num_vertices, num_faces, num_corners],
        );
    }
    Document::new(positions, faces)
        .ok()?
        .with_attributes(attributes)
        .ok()
}

fn add_attribute(draw: &mut Draw<'_>, attributes: &mut Attributes, counts: [usize; 3]) {
    let [num_vertices, num_faces, num_corners] = counts;
    match draw.below(7) {
        0 => {
            let property = property(draw, num_vertices);
            let name = property.name.as_str();
            if attributes.vertex(name).is_none() && attributes.corner(name).is_none() {
                attributes.vertices.push(property);
            }
        }
        1 => {
            let property = property(draw, num_faces);
            if attributes.face(&property.name).is_none() {
                attributes.faces.push(property);
            }
        }
        2 | 3 => {
            let (name, components) = [(UV, 2), (NORMAL, 3), (UV, 3)][draw.below(3)];
            if attributes.corner(name).is_some() || attributes.vertex(name).is_some() {
                return;
            }
            let table = 1 + draw.below(5);
            attributes.corners.push(CornerProperty {
                name: name.into(),
                components,
                values: values(draw, table * components),
                indices: (0..num_corners)
                    .map(|_| match draw.below(table + 1) {
                        0 => NONE,
                        i => i as u32 - 1,
                    })
                    .collect(),
            });
        }
        4 | 5 => {
            let kinds = [
                LabelKind::Object,
                LabelKind::Group,
                LabelKind::Material,
                LabelKind::Smoothing,
            ];
            let kind = kinds[draw.below(4)];
            if attributes.label(kind).is_some() {
                return;
            }
            let names: Vec<String> = (0..1 + draw.below(3)).map(|_| draw.name()).collect();
            let faces = (0..num_faces)
                .map(|_| match draw.below(names.len() + 1) {
                    0 => NONE,
                    i => i as u32 - 1,
                })
                .collect();
            attributes.labels.push(Labels { kind, names, faces });
        }
        _ => {
            let name = draw.name();
            attributes.comments.push(name);
        }
    }
}

fn property(draw: &mut Draw<'_>, count: usize) -> Property {
    let (name, components) = match draw.below(5) {
        0 => (NORMAL.to_owned(), 3),
        1 => (COLOR.to_owned(), 3 + draw.below(2)),
        2 => (UV.to_owned(), 2),
        _ => (draw.name(), 1),
    };
    Property {
        values: values(draw, count * components),
        name,
        components,
    }
}

fn values(draw: &mut Draw<'_>, count: usize) -> Values {
    match draw.below(4) {
        0 => Values::U8((0..count).map(|_| draw.byte()).collect()),
        1 => Values::I32((0..count).map(|_| draw.u32() as i32).collect()),
        // Larger values would become infinite in 32 bits, which is not allowed in a colour.
        2 => Values::F32(
            (0..count)
                .map(|_| draw.real().clamp(f32::MIN.into(), f32::MAX.into()) as f32)
                .collect(),
        ),
        _ => Values::F64((0..count).map(|_| draw.real()).collect()),
    }
}
