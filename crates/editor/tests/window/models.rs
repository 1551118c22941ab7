//! Meshes for the stories, each copied to a temporary folder.

use std::path::{Path, PathBuf};

use cotan::geometry::{Positions, Surface};
use cotan_io::{Document, ProcessingMesh};
use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};
use tempfile::TempDir;

/// A folder with a mesh, also used for the program's data.
pub(crate) struct Place {
    pub(crate) folder: TempDir,
    pub(crate) mesh: PathBuf,
    pub(crate) document: Document,
    pub(crate) surface: ProcessingMesh,
}

impl Place {
    /// The built-in creature.
    pub(crate) fn with_creature() -> Self {
        let shape = cotan::shapes::creature::<f64>(32);
        let document = Document::from_mesh(shape.connectivity(), shape.positions()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let mesh = folder.path().join("creature.obj");
        cotan_io::save(&document, &mesh).unwrap();
        Self::of(folder, mesh)
    }

    /// A mesh of the optional collection next to the project.
    pub(crate) fn with_shared(name: &str) -> Option<Self> {
        let source = cotan_testing::shared(&format!("meshes/{name}"))?;
        let folder = tempfile::tempdir().unwrap();
        let mesh = folder.path().join(name);
        // Copies the contents only, because the original may be read-only.
        std::fs::write(&mesh, std::fs::read(source).unwrap()).unwrap();
        Some(Self::of(folder, mesh))
    }

    fn of(folder: TempDir, mesh: PathBuf) -> Self {
        let document = cotan_io::load(&mesh).unwrap();
        let surface = document.surface().unwrap();
        Self {
            folder,
            mesh,
            document,
            surface,
        }
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    /// The largest distance of the mesh in a file from a shape, relative to the diagonal of the
    /// bounding box.
    ///
    /// If there is an axis, the best rotation about it is applied first.
    pub(crate) fn distance(
        &self,
        file: &Path,
        shape: &Positions<f64>,
        axis: Option<[Point3<f64>; 2]>,
    ) -> f64 {
        let mut expected = self.document.clone();
        expected.set_positions(&self.surface, shape).unwrap();
        let found = cotan_io::load(file).unwrap();
        assert_eq!(found.positions().len(), expected.positions().len());
        let pairs = || found.positions().iter().zip(expected.positions());
        let turn = match axis {
            Some([a, b]) => best_turn(pairs(), a, Unit::new_normalize(b - a)),
            None => Isometry3::identity(),
        };
        let distances = pairs().map(|(p, q)| (turn * p - q).norm());
        let rest = Surface::new(self.surface.mesh(), self.surface.positions());
        distances.fold(0.0, f64::max) / rest.unwrap().bounding_box().diagonal()
    }
}

/// The rotation about an axis that brings the first of each pair nearest to the second.
fn best_turn<'a>(
    pairs: impl Iterator<Item = (&'a Point3<f64>, &'a Point3<f64>)>,
    on: Point3<f64>,
    axis: Unit<Vector3<f64>>,
) -> Isometry3<f64> {
    let across = |p: &Point3<f64>| {
        let way = p - on;
        way - axis.into_inner() * axis.dot(&way)
    };
    let (mut sine, mut cosine) = (0.0, 0.0);
    for (p, q) in pairs {
        let (p, q) = (across(p), across(q));
        sine += axis.dot(&p.cross(&q));
        cosine += p.dot(&q);
    }
    let turn = UnitQuaternion::from_axis_angle(&axis, sine.atan2(cosine));
    let shift = on - turn * on;
    Isometry3::from_parts(shift.into(), turn)
}

/// The autosaves below a folder that was passed as `COTAN_EDITOR_DATA`.
pub(crate) fn autosaves(data: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(data.join("autosaves")) else {
        return Vec::new();
    };
    let all = entries.map(|entry| entry.unwrap().path());
    all.filter(|path| path.extension().is_some_and(|e| e == "autosave"))
        .collect()
}
