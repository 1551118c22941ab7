//! Rewriting of an OBJ file: its own bytes, with moved vertices and rotated normals replaced.

use crate::number;
use crate::obj::ObjFile;
use crate::obj::rebuild::ends_open;
use crate::obj::statement::{Statement, Statements, corner, normal_part, resolve};
use crate::source::{Moves, TextPatch};
use crate::text;

/// Returns the bytes of the file with the changes made in place.
///
/// Added normals follow the last `vn`. Corners further down that count back from the latest
/// normal get absolute indices, so that they keep their meaning.
pub(super) fn rewrite(file: &ObjFile, moves: &Moves<'_>) -> Vec<u8> {
    let changes = &moves.normals.corners;
    let turns = !(changes.changed.is_empty() && changes.added.is_empty());
    if !turns && !moves.moved.contains(&true) {
        return file.bytes.clone();
    }
    let mut writer = Writer {
        patch: TextPatch::new(&file.bytes),
        moves,
        vertex: 0,
        normal: 0,
        num_normals: file.counts.normals(),
        changed: changes.changed.iter().peekable(),
        corner: 0,
        corners: changes.corners.iter().peekable(),
        line_end: line_end(&file.bytes),
    };
    for statement in Statements::new(&file.bytes, text::after_bom(&file.bytes), 0) {
        match statement.keyword() {
            b"v" => writer.vertex(&statement),
            b"vn" if turns => writer.normal(&statement),
            b"f" if turns => writer.face(&statement),
            _ => {}
        }
    }
    writer.patch.finish()
}

/// The ending of the first line of a text.
pub(super) fn line_end(bytes: &[u8]) -> &'static str {
    match memchr::memchr2(b'\n', b'\r', bytes) {
        Some(at) if bytes[at..].starts_with(b"\r\n") => "\r\n",
        Some(at) if bytes[at] == b'\r' => "\r",
        _ => "\n",
    }
}

type Peek<'a, T> = std::iter::Peekable<std::slice::Iter<'a, T>>;

struct Writer<'a> {
    patch: TextPatch<'a>,
    moves: &'a Moves<'a>,
    vertex: usize,
    normal: usize,
    num_normals: usize,
    changed: Peek<'a, (u32, [f64; 3])>,
    corner: u32,
    corners: Peek<'a, (u32, u32)>,
    line_end: &'static str,
}

impl Writer<'_> {
    fn vertex(&mut self, statement: &Statement<'_>) {
        let vertex = self.vertex;
        self.vertex += 1;
        if self.moves.moved.get(vertex) == Some(&true) {
            self.numbers(statement, self.moves.mesh.positions[vertex].into());
        }
    }

    fn numbers(&mut self, statement: &Statement<'_>, numbers: [f64; 3]) {
        for (token, x) in statement.arguments().zip(numbers) {
            let start = statement.start + token.start;
            self.patch.replace(start, token.text.len(), |out| {
                number::push_f64(out, x);
            });
        }
    }

    fn normal(&mut self, statement: &Statement<'_>) {
        let normal = self.normal;
        self.normal += 1;
        let change = self.changed.next_if(|(entry, _)| *entry as usize == normal);
        if let Some(&(_, numbers)) = change {
            self.numbers(statement, numbers);
        }
        let added = &self.moves.normals.corners.added;
        if self.normal < self.num_normals || added.is_empty() {
            return;
        }
        let line_end = self.line_end;
        // The last line of the file need not have a line ending.
        let is_ended = statement.start + statement.text.len() < statement.end;
        let is_open = !is_ended && ends_open(statement.text);
        self.patch.replace(statement.end, 0, |out| {
            if is_open {
                // Its backslash continues it with an empty line.
                out.push_str(line_end);
            }
            for (k, numbers) in added.iter().enumerate() {
                if k > 0 || !is_ended {
                    out.push_str(line_end);
                }
                out.push_str("vn");
                for &x in numbers {
                    out.push(' ');
                    number::push_f64(out, x);
                }
            }
            if is_ended {
                out.push_str(line_end);
            }
        });
    }

    fn face(&mut self, statement: &Statement<'_>) {
        let added = self.moves.normals.corners.added.len();
        for token in statement.arguments() {
            let number = self.corner;
            self.corner = self.corner.wrapping_add(1);
            let change = self.corners.next_if(|(corner, _)| *corner == number);
            let entry = match change {
                Some(&(_, entry)) => entry,
                None if self.normal == self.num_normals && added > 0 => {
                    let index = corner(token.text).and_then(|c| c.normal);
                    match index.filter(|&index| index < 0) {
                        Some(index) => match resolve(index, self.normal, self.num_normals) {
                            Some(entry) => entry,
                            None => continue,
                        },
                        None => continue,
                    }
                }
                None => continue,
            };
            if let Some((start, text)) = normal_part(token) {
                self.patch
                    .replace(statement.start + start, text.len(), |out| {
                        number::push_integer(out, u64::from(entry) + 1);
                    });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use crate::attributes::NORMAL;
    use crate::document::Document;
    use crate::format::Format;
    use crate::limits::Limits;

    fn read(text: &str) -> Document {
        crate::obj::open(text.as_bytes().to_vec(), &Limits::default()).unwrap()
    }

    fn written(document: &Document) -> String {
        String::from_utf8(document.write(Format::Obj).unwrap()).unwrap()
    }

    /// Two squares that share an edge, the right one folded up. Its corners with the shared
    /// normal get new ones.
    #[test]
    fn normals_turn_in_place_and_new_ones_follow_the_last() {
        let vertices = "v 0 0 0\r\nv 1 0 0\r\nv 2 0 0\r\nv 0 1 0\r\nv 1 1 0\r\nv 2 1 0\r\n";
        let text = format!(
            "{vertices}vn  0 0 1.0 # up\r\nf 1//-1 2//1 5//1 4//-1\r\nvt 1 1\r\nvn 0 0 1\r\n\
             f 2/1/-1 \\\r\n3/-1/-1 6//2 5//2 # right\r\nf 1//-2 2 5"
        );
        let mut document = read(&text);
        document
            .set_position(2, Point3::new(1.0, 0.0, 1.0))
            .unwrap();
        document
            .set_position(5, Point3::new(1.0, 1.0, 1.0))
            .unwrap();
        let turned = document.attributes().unwrap().into_owned();
        let text = written(&document);
        let again = read(&text);
        let found = again.attributes().unwrap().into_owned();
        assert_eq!(found, turned);
        assert!(found.corner(NORMAL).unwrap().values.len() > 6);
        assert!(
            text.contains("vn  0 0 1.0 # up\r\nf 1//-1 2//3 5//"),
            "{text}"
        );
        // After the new normals, a relative index would refer to a different one.
        assert!(text.ends_with("# right\r\nf 1//1 2 5"), "{text}");
        assert!(text.contains("f 2/1/2 \\\r\n3/-1/"), "{text}");
        assert_eq!(text.matches("vn ").count(), text.matches("vn").count());
        assert_eq!(text.matches('\n').count(), text.matches("\r\n").count());
    }

    #[test]
    fn a_last_normal_without_a_line_end_gets_one() {
        let mut document = read(
            "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nf 1//1 2//1 5//1 4//1\n\
             f 2//1 3//1 6//1 5//1\nvn 0 0 1",
        );
        document
            .set_position(2, Point3::new(1.0, 0.0, 1.0))
            .unwrap();
        document
            .set_position(5, Point3::new(1.0, 1.0, 1.0))
            .unwrap();
        let text = written(&document);
        assert!(
            text.contains("vn 0 0 1\nvn ") && !text.ends_with('\n'),
            "{text}"
        );
        let found = read(&text).attributes().unwrap().into_owned();
        assert_eq!(found, document.attributes().unwrap().into_owned());
    }

    #[test]
    fn without_a_move_not_a_byte_changes() {
        let text =
            "\u{feff}v 0 0 0\r\nv 1 0 0\rv 0 1 0\n\nvn 0 0 1\nf 1//1 2//1 \\\n 3//-1 \nfoo\\";
        let mut document = read(text);
        assert_eq!(written(&document), text);
        assert_eq!(document.warnings().len(), 1);
        document
            .set_position(0, Point3::new(1.0, 0.0, 0.0))
            .unwrap();
        document.set_position(0, Point3::origin()).unwrap();
        assert_eq!(written(&document), text);
    }
}
