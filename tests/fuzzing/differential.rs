//! Compares our OBJ reader with tobj on files that both accept.

#[path = "../../crates/io/tests/obj_filter/mod.rs"]
mod obj_filter;

use cotan_io::{Format, read};
use obj_filter::{agree, for_tobj, read_by_tobj};

use super::files::limits;

/// Checks that positions and faces are those that tobj reads.
pub fn obj_differential(data: &[u8]) {
    // Content that announces another format is not read as an OBJ.
    let is_obj = Format::from_content(data).is_none() && !data.starts_with(b"\x1f\x8b");
    let Some((filtered, num_vertices)) = for_tobj(data).filter(|_| is_obj) else {
        return;
    };
    let ours = read(data, Some(Format::Obj), &limits());
    let (Ok(ours), Some((positions, faces))) = (ours, read_by_tobj(&filtered, num_vertices)) else {
        return;
    };
    assert_eq!(ours.positions().len(), positions.len());
    for (ours, theirs) in ours.positions().iter().zip(&positions) {
        let same = ours.iter().zip(theirs).all(|(&x, &y)| agree(x, y));
        assert!(same, "{ours} {theirs:?}");
    }
    assert_eq!(ours.faces().iter().collect::<Vec<_>>(), faces);
}
