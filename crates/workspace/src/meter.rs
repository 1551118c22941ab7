//! Measures the shape that is shown, on a thread of its own: errors, and a field that colours the
//! mesh.
//!
//! Only the newest shape counts: one that arrives during a measurement waits and is replaced by
//! the next.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use cotan::geometry::{Surface, dihedral_changes, singular_values};
use cotan::halfedge::VertexMap;
use cotan::smooth::curvature_field;
use cotan::{ShapeComparison, ShapeErrors};
use cotan_io::ProcessingMesh;
use cotan_tool::ColorScale;

use crate::newest::{Newest, lock};
use crate::shape::Shape;

/// The quantity that colours the mesh.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Field {
    /// A single colour.
    #[default]
    Plain,
    /// The mean curvature.
    Curvature,
    /// The contribution of each vertex to E_p.
    Parameterization,
    /// The contribution of each vertex to E_g.
    Geometry,
    /// The change of the area around each vertex.
    Area,
    /// The largest change of a dihedral angle at each vertex.
    Bending,
    /// The largest σ1 of the faces around each vertex.
    Stretch,
    /// The largest 1/σ2 of the faces around each vertex.
    Compression,
}

impl Field {
    /// All fields, in the order of the list.
    pub const ALL: [Self; 8] = [
        Self::Plain,
        Self::Curvature,
        Self::Parameterization,
        Self::Geometry,
        Self::Area,
        Self::Bending,
        Self::Stretch,
        Self::Compression,
    ];

    /// The name in the list.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plain => "Plain",
            Self::Curvature => "Mean curvature",
            Self::Parameterization => "E_p: angles",
            Self::Geometry => "E_g: details",
            Self::Area => "Area distortion",
            Self::Bending => "Dihedral change",
            Self::Stretch => "Stretch σ1",
            Self::Compression => "Compression 1/σ2",
        }
    }

    fn title(self) -> &'static str {
        match self {
            Self::Plain => "",
            Self::Curvature => "mean curvature, 1 / box",
            Self::Parameterization => "E_p per vertex",
            Self::Geometry => "E_g per vertex, box",
            Self::Area => "ln (area / area before)",
            Self::Bending => "dihedral change, degrees",
            Self::Stretch => "ln σ1",
            Self::Compression => "ln (1 / σ2)",
        }
    }
}

/// A shape to measure.
#[derive(Clone, Debug)]
pub struct Subject {
    /// The mesh.
    pub mesh: Arc<ProcessingMesh>,
    /// The shape to compare with.
    pub original: Shape,
    /// The shape to measure.
    pub shape: Shape,
    /// The field that colours the mesh.
    pub field: Field,
}

/// The result of a measurement.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The shape that was measured.
    pub shape: Shape,
    /// E_p and E_g, or `None` if they cannot be measured.
    pub errors: Option<ShapeErrors>,
    /// The field with its scale and one colour per vertex.
    pub colors: Option<(Field, ColorScale, Vec<[u8; 3]>)>,
}

/// The measuring thread.
#[derive(Debug)]
pub struct Meter {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    subjects: Newest<Subject>,
    reading: Mutex<Option<Reading>>,
    notify: Box<dyn Fn() + Send + Sync>,
}

impl std::fmt::Debug for Shared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Shared").finish_non_exhaustive()
    }
}

impl Meter {
    /// Starts the thread. `notify` is called from it when there is a reading.
    ///
    /// # Errors
    /// Fails if the system cannot start a thread.
    pub fn start(notify: impl Fn() + Send + Sync + 'static) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            subjects: Newest::new(),
            reading: Mutex::default(),
            notify: Box::new(notify),
        });
        let own = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("meter".to_owned())
            .spawn(move || {
                let mut next = own.subjects.wait();
                while let Some(subject) = next {
                    // If a measurement panics, only its reading is lost.
                    let measured = catch_unwind(AssertUnwindSafe(|| own.measure(subject)));
                    next = measured.unwrap_or_else(|_| own.subjects.wait());
                }
            })?;
        Ok(Self {
            shared,
            thread: Some(thread),
        })
    }

    /// Requests a measurement.
    pub fn post(&self, subject: Subject) {
        self.shared.subjects.post(|_| subject);
    }

    /// Takes the newest reading, if it was not taken yet.
    pub fn take(&self) -> Option<Reading> {
        lock(&self.shared.reading).take()
    }
}

impl Drop for Meter {
    fn drop(&mut self) {
        self.shared.subjects.close();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Shared {
    /// Measures shapes as long as they are compared with the same original. Returns the first
    /// subject with another one.
    fn measure(&self, first: Subject) -> Option<Subject> {
        let mesh = Arc::clone(&first.mesh);
        let original = first.original.clone();
        let surface = Surface::new(mesh.mesh(), &original).ok();
        let comparison = surface.and_then(|s| ShapeComparison::new(&s).ok());
        let mut subject = first;
        loop {
            let reading = read(&subject, comparison.as_ref());
            *lock(&self.reading) = Some(reading);
            (self.notify)();
            let next = self.subjects.wait()?;
            if !next.original.is(&original) {
                return Some(next);
            }
            subject = next;
        }
    }
}

fn read(subject: &Subject, comparison: Option<&ShapeComparison<'_, f64>>) -> Reading {
    let fields = comparison.and_then(|c| c.fields(&subject.shape).ok());
    let colors = |values: &VertexMap<f64>, scale: ColorScale| {
        let colors = values.values().map(|&x| match scale.share(x) {
            Some(share) => scale.color_at(share),
            None => [128; 3],
        });
        (subject.field, scale.clone(), colors.collect())
    };
    let title = subject.field.title();
    let signed = |x: &VertexMap<f64>| colors(x, ColorScale::signed(title, x.values().copied()));
    let size = |x: &VertexMap<f64>| colors(x, ColorScale::size(title, x.values().copied()));
    let surface = Surface::new(subject.mesh.mesh(), &subject.shape).ok();
    let colors = match subject.field {
        Field::Plain => None,
        Field::Curvature => surface.map(|surface| {
            let size = surface.bounding_box().longest_side();
            signed(&curvature_field(&surface).map(|h| h * size))
        }),
        Field::Parameterization => fields.as_ref().map(|f| size(&f.parameterization)),
        Field::Geometry => fields.as_ref().map(|f| size(&f.geometry)),
        Field::Area => {
            comparison.and_then(|c| Some(signed(&c.area_log_ratios(&subject.shape).ok()?)))
        }
        Field::Bending => bending(subject).map(|field| size(&field)),
        Field::Stretch => stretch(subject, |[s1, _]| s1.ln()).map(|field| signed(&field)),
        Field::Compression => stretch(subject, |[_, s2]| -s2.ln()).map(|field| signed(&field)),
    };
    Reading {
        shape: subject.shape.clone(),
        errors: fields.map(|fields| fields.errors()),
        colors,
    }
}

/// The largest change of a dihedral angle at the edges of each vertex, in degrees.
fn bending(subject: &Subject) -> Option<VertexMap<f64>> {
    let mesh = subject.mesh.mesh();
    let original = Surface::new(mesh, &subject.original).ok()?;
    let changes = dihedral_changes(&original, &subject.shape).ok()?;
    let at = |v| mesh.outgoing_halfedges(v).filter_map(|h| changes[h.edge()]);
    let greatest = |v| at(v).fold(0.0, f64::max).to_degrees();
    Some(mesh.vertices().map(greatest).collect())
}

/// The maximum of `value` over the singular values of the faces around each vertex; NaN where no
/// face has an area.
fn stretch(subject: &Subject, value: impl Fn([f64; 2]) -> f64) -> Option<VertexMap<f64>> {
    let mesh = subject.mesh.mesh();
    let original = Surface::new(mesh, &subject.original).ok()?;
    let values = singular_values(&original, &subject.shape).ok()?;
    let at = |v| mesh.vertex_faces(v).filter_map(|f| values[f].map(&value));
    let greatest = |v| at(v).fold(f64::NAN, f64::max);
    Some(mesh.vertices().map(greatest).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    /// Measures a sphere stretched to twice its length.
    fn drawn_out(field: Field) -> (ColorScale, Vec<[u8; 3]>) {
        let shape = cotan::shapes::icosphere::<f64>(2);
        let corners = shape.to_triangles();
        let faces = corners.chunks(3).map(<[u32]>::to_vec).collect();
        let points = shape.positions().values().copied().collect();
        let document = cotan_io::Document::new(points, faces).unwrap();
        let mesh = document.surface().unwrap();
        let original = mesh.positions().clone();
        let subject = Subject {
            shape: Shape::new(original.map(|p| Point3::new(2.0 * p.x, p.y, p.z))),
            original: Shape::new(original),
            mesh: Arc::new(mesh),
            field,
        };
        let (of, scale, colors) = read(&subject, None).colors.unwrap();
        assert_eq!(of, field);
        (scale, colors)
    }

    #[test]
    fn stretch_and_bending_colour_the_vertices() {
        for field in [Field::Bending, Field::Stretch, Field::Compression] {
            let (scale, colors) = drawn_out(field);
            assert_eq!((colors.len(), scale.title()), (162, field.title()));
        }
        // ln 2 where the stretch is largest.
        let [low, high] = drawn_out(Field::Stretch).0.range();
        assert!(low == -high && (0.6..0.8).contains(&high), "{high}");
        // Stretching along one axis compresses nothing: σ2 is at least 1 everywhere.
        let [_, high] = drawn_out(Field::Compression).0.range();
        assert!(high < 0.1, "{high}");
        let [low, high] = drawn_out(Field::Bending).0.range();
        assert!(low == 0.0 && high > 1.0, "{high}");
    }
}
