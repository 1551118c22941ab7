//! Measures of how well parts follow: the change of their gaps, and their turn against what they
//! touch.

use cotan_flow::nearest_rotation;
use cotan_geometry::Scalar;
use nalgebra::{Matrix3, Point3, Vector3};

use super::contacts::{Contact, SurfacePoint};
use super::passenger::{Passenger, Scene};
use super::plan::Plan;
use super::roles::Role;
use super::turns::{covariance_at, rotation};

/// The role of a part in a deformation, and how well it followed.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct PartReport {
    /// Number of its vertices.
    pub vertices: usize,
    /// Its role.
    pub role: Role,
    /// The parts that it touches or is nearest to, ascending.
    pub follows: Vec<usize>,
    /// Root mean square, over its contacts and by their weights, of the change of the distance
    /// from the point that it touches, over the diagonal of the whole model.
    pub gap_change: f64,
    /// The angle between the rotation that takes its vertices from their original positions best
    /// and that of the corners of the triangles that it touches, in degrees. Of a part that is
    /// tied to others and solved with them: between the two surfaces at their contacts.
    pub turn_degrees: f64,
}

/// Measures all parts.
pub(crate) fn measure<T: Scalar>(
    scene: &Scene<'_>,
    plan: &Plan,
    passengers: &[Passenger<T>],
) -> Vec<PartReport> {
    let parts = scene.model.parts.iter().zip(&plan.roles.roles);
    let mut reports: Vec<PartReport> = parts
        .map(|(part, role)| PartReport::new(part.vertices.len(), *role))
        .collect();
    for passenger in passengers {
        let contacts: Vec<&Contact> = passenger.contacts.iter().collect();
        let report = &mut reports[passenger.part];
        report.note(scene, &contacts);
        let mean = passenger.mean_rotation(scene);
        let [own, on] = [
            own_points(scene, passenger.part),
            touched_points(scene, &contacts),
        ]
        .map(|points| best_rotation(scene, &points, &mean));
        report.turn_degrees = angle(&own, &on).to_degrees();
    }
    let part_of = |contact: &Contact| scene.model.of_vertex[contact.own.corners[0] as usize];
    let mut ties: Vec<&Contact> = plan.ties.iter().collect();
    ties.sort_by_key(|contact| part_of(contact));
    for contacts in ties.chunk_by(|a, b| part_of(a) == part_of(b)) {
        let report = &mut reports[part_of(contacts[0]) as usize];
        report.note(scene, contacts);
        let sides: [fn(&Contact) -> &SurfacePoint; 2] = [|c| &c.own, |c| &c.on];
        let [own, on] = sides.map(|side| {
            let turn =
                |sum, c: &&Contact| sum + covariance_at(scene.model, scene.now, side(c)) * c.weight;
            rotation(&contacts.iter().fold(Matrix3::zeros(), turn))
        });
        report.turn_degrees = angle(&own, &on).to_degrees();
    }
    reports
}

impl PartReport {
    pub(super) fn new(vertices: usize, role: Role) -> Self {
        Self {
            vertices,
            role,
            follows: Vec::new(),
            gap_change: 0.0,
            turn_degrees: 0.0,
        }
    }

    pub(super) fn set_followed(&mut self, parts: impl Iterator<Item = u32>) {
        self.follows = parts.map(|part| part as usize).collect();
        self.follows.sort_unstable();
        self.follows.dedup();
    }

    /// Notes the parts that are followed, and the change of the gaps.
    fn note(&mut self, scene: &Scene<'_>, contacts: &[&Contact]) {
        self.set_followed(contacts.iter().map(|c| c.part));
        let (mut sum, mut total) = (0.0, 0.0);
        for contact in contacts {
            let gap = (contact.own.at(scene.now) - contact.on.at(scene.now)).norm();
            sum += contact.weight * (gap - contact.distance).powi(2);
            total += contact.weight;
        }
        if total > 0.0 && scene.model.diagonal > 0.0 {
            self.gap_change = (sum / total).sqrt() / scene.model.diagonal;
        }
    }
}

/// The vertices of a part, with equal weights.
fn own_points(scene: &Scene<'_>, part: usize) -> Vec<(u32, f64)> {
    let vertices = scene.model.parts[part].vertices.iter();
    vertices.map(|v| (*v, 1.0)).collect()
}

/// The corners of the triangles that contacts touch, by the weights of the contacts. Around a
/// vertex that a contact touches all triangles count.
fn touched_points(scene: &Scene<'_>, contacts: &[&Contact]) -> Vec<(u32, f64)> {
    let mut points: Vec<(u32, f64)> = Vec::new();
    for contact in contacts {
        let [a, b, c] = contact.on.corners;
        let own = [[a, b, c]];
        let triangles = match a == b && b == c {
            true => scene.model.fan(a),
            false => &own,
        };
        let weight = contact.weight / triangles.len().max(1) as f64;
        points.extend(triangles.iter().flatten().map(|v| (*v, weight)));
    }
    points
}

/// The rotation that takes points from their original positions best. Where they are on a line or
/// at a point, which leaves it open, it is as close to `otherwise` as they allow.
fn best_rotation(
    scene: &Scene<'_>,
    points: &[(u32, f64)],
    otherwise: &Matrix3<f64>,
) -> Matrix3<f64> {
    /// Of the squared size of the model: too little to matter to anything that has an extent.
    const SHARE: f64 = 1e-14;
    let rest = scene.model.positions.as_slice();
    let total: f64 = points.iter().map(|(_, weight)| weight).sum();
    let mean = |at: &[Point3<f64>]| {
        let sum: Vector3<f64> = points
            .iter()
            .map(|(v, w)| at[*v as usize].coords * *w)
            .sum();
        sum / total.max(f64::MIN_POSITIVE)
    };
    let (before, after) = (mean(rest), mean(scene.now));
    let mut covariance = Matrix3::zeros();
    for (v, weight) in points {
        let v = *v as usize;
        let (from, to) = (rest[v].coords - before, scene.now[v].coords - after);
        covariance += to * from.transpose() * *weight;
    }
    let size = scene.model.diagonal * scene.model.diagonal * total;
    nearest_rotation(&(covariance + otherwise * (SHARE * size)))
}

/// The angle of the rotation from one to the other, by the chord: an arc cosine loses the digits of
/// small angles.
fn angle(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    2.0 * ((a - b).norm() / 8.0_f64.sqrt()).min(1.0).asin()
}
