//! The unit sphere as an icosahedron whose faces are subdivided into f² triangles.

use nalgebra::{Point3, Vector3};

use super::sphere::{ICOSAHEDRON_FACES, icosahedron_points};

/// Points and faces of the geodesic sphere of frequency f ≥ 1: 10·f² + 2 vertices, in order of
/// the icosahedron's faces and of the rows within each face.
pub(super) fn geodesic(frequency: usize) -> (Vec<Vector3<f64>>, Vec<[u32; 3]>) {
    let corners = icosahedron_points();
    let mut net = Net {
        frequency,
        points: Vec::with_capacity(10 * frequency * frequency + 2),
        corners: [None; 12],
        edges: [[None; 12]; 12],
    };
    let mut faces = Vec::with_capacity(20 * frequency * frequency);
    let mut rows = [Vec::new(), Vec::new()];
    for face in ICOSAHEDRON_FACES {
        for i in 0..=frequency {
            let [above, row] = &mut rows;
            row.clear();
            row.extend((0..=i).map(|j| net.number(&corners, face, i, j)));
            for j in 0..i {
                faces.push([above[j], row[j], row[j + 1]]);
                if j > 0 {
                    faces.push([above[j - 1], row[j], above[j]]);
                }
            }
            rows.swap(0, 1);
        }
    }
    (net.points, faces)
}

/// The points created so far, with lookup tables of those on corners and edges of the
/// icosahedron.
struct Net {
    frequency: usize,
    points: Vec<Vector3<f64>>,
    corners: [Option<u32>; 12],
    /// Indexed by two corners, the lower one first: the indices of the points from it to the
    /// other.
    edges: [[Option<u32>; 12]; 12],
}

impl Net {
    /// The index of the point in row i, column j of a face. Row 0 is the first corner; the last
    /// row runs from the second corner to the third.
    fn number(&mut self, corners: &[Point3<f64>], face: [u32; 3], i: usize, j: usize) -> u32 {
        let f = self.frequency;
        let [a, b, c] = face.map(|v| v as usize);
        match (f - i, i - j, j) {
            (_, 0, 0) => self.corner(corners, a),
            (0, _, 0) => self.corner(corners, b),
            (0, 0, _) => self.corner(corners, c),
            (0, _, j) => self.on_edge(corners, b, c, j),
            (_, i, 0) => self.on_edge(corners, a, b, i),
            (_, 0, j) => self.on_edge(corners, a, c, j),
            (k, l, m) => {
                let [k, l, m] = [k, l, m].map(|x| x as f64);
                let p = corners[a].coords * k + corners[b].coords * l + corners[c].coords * m;
                self.push(p)
            }
        }
    }

    fn corner(&mut self, corners: &[Point3<f64>], corner: usize) -> u32 {
        if let Some(number) = self.corners[corner] {
            return number;
        }
        let number = self.push(corners[corner].coords);
        self.corners[corner] = Some(number);
        number
    }

    /// The point `at` steps from corner a towards corner b, strictly between them.
    fn on_edge(&mut self, corners: &[Point3<f64>], a: usize, b: usize, at: usize) -> u32 {
        let (low, high, at) = match a < b {
            true => (a, b, at),
            false => (b, a, self.frequency - at),
        };
        let first = match self.edges[low][high] {
            Some(first) => first,
            None => {
                let first = self.points.len() as u32;
                for step in 1..self.frequency {
                    let share = step as f64 / self.frequency as f64;
                    self.push(corners[low].coords.lerp(&corners[high].coords, share));
                }
                self.edges[low][high] = Some(first);
                first
            }
        };
        first + at as u32 - 1
    }

    fn push(&mut self, p: Vector3<f64>) -> u32 {
        self.points.push(p.normalize());
        self.points.len() as u32 - 1
    }
}
