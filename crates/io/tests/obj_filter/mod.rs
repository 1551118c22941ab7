//! Filtering of OBJ files so that tobj's result can be compared with ours.
//!
//! tobj numbers vertices by first use, drops those that no face uses, makes one model of every
//! object, group and material, does not support continued lines, and panics on some references to
//! `vt` and `vn`. It is therefore given only positions and faces, preceded by a one-vertex face
//! for every vertex, which preserves their order.

/// Returns the positions and faces of a file for tobj, and the number of vertices. The result has
/// `v` lines with their first three words and `f` lines with the vertices of their corners, both
/// without comments, after a face `f i` for every vertex.
///
/// Returns `None` if a line has a form on which the two readers need not agree: continued, ended
/// by a lone carriage return, or with bytes other than printable ASCII in a vertex or face.
pub(crate) fn for_tobj(text: &[u8]) -> Option<(Vec<u8>, usize)> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let mut num_vertices = 0;
    let mut body = Vec::new();
    for line in text.split(|&b| b == b'\n') {
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        if line.ends_with(b"\\") || line.contains(&b'\r') {
            return None;
        }
        let line = line.split(|&b| b == b'#').next().unwrap_or(line);
        let words: Vec<&[u8]> = line
            .split(|&b| b <= b' ')
            .filter(|word| !word.is_empty())
            .collect();
        let (keyword, kept): (&[u8], Vec<&[u8]>) = match words.split_first() {
            Some((&b"v", rest)) => {
                num_vertices += 1;
                (b"v", rest.iter().take(3).copied().collect())
            }
            Some((&b"f", rest)) => (b"f", rest.iter().copied().map(vertex).collect()),
            _ => continue,
        };
        if !line
            .iter()
            .all(|&b| b == b'\t' || (b' '..=b'~').contains(&b))
        {
            return None;
        }
        body.extend_from_slice(keyword);
        for word in kept {
            body.push(b' ');
            body.extend_from_slice(word);
        }
        body.push(b'\n');
    }
    let mut text = Vec::new();
    for vertex in 1..=num_vertices {
        text.extend_from_slice(format!("f {vertex}\n").as_bytes());
    }
    text.append(&mut body);
    Some((text, num_vertices))
}

/// The part of a corner before its first slash.
fn vertex(word: &[u8]) -> &[u8] {
    word.split(|&b| b == b'/').next().unwrap_or_default()
}

/// The result of tobj for a file: positions and the vertices of the faces.
pub(crate) type Mesh = (Vec<[f32; 3]>, Vec<Vec<u32>>);

/// Reads the output of [`for_tobj`]; `None` if tobj rejects it.
pub(crate) fn read_by_tobj(text: &[u8], num_vertices: usize) -> Option<Mesh> {
    let options = tobj::LoadOptions::default();
    let (models, _) = tobj::load_obj_buf(&mut &text[..], &options, |_| {
        Err(tobj::LoadError::OpenFileFailed)
    })
    .ok()?;
    let [model] = models.as_slice() else {
        return None;
    };
    let mesh = &model.mesh;
    let mut corners = mesh.indices.iter().copied();
    let mut faces = mesh.face_arities.iter().map(|&degree| {
        let degree = usize::try_from(degree).unwrap_or(usize::MAX);
        corners.by_ref().take(degree).collect::<Vec<u32>>()
    });
    let points: Vec<_> = faces.by_ref().take(num_vertices).collect();
    let in_order = (0u32..).zip(&points).all(|(v, face)| face == &[v]);
    let positions = mesh.positions.as_chunks::<3>().0.to_vec();
    (in_order && points.len() == num_vertices).then(|| (positions, faces.collect()))
}

/// Returns `true` if a 32-bit coordinate is consistent with a 64-bit one.
pub(crate) fn agree(double: f64, single: f32) -> bool {
    if single.is_infinite() {
        return double.abs() >= f64::from(f32::MAX) && double.is_sign_positive() == (single > 0.0);
    }
    let step = double.abs() * f64::from(f32::EPSILON) + f64::from(f32::from_bits(1));
    (double - f64::from(single)).abs() <= step
}
