mod brush;
mod handles;
mod opening;
mod parts;
mod sequences;

use std::path::{Path, PathBuf};

use cotan::halfedge::VertexId;
use cotan::linear::Hold;
use cotan::smooth::{SmoothMethod, SmoothOptions, smooth};
use cotan::{Handles, Surface};
use cotan_io::Document;
use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::command::{Job, Over};
use crate::files::Fingerprint;
use crate::handle::Role;
use crate::record::SceneRecord;
use crate::selection::Combine;
use crate::settings::{Follow, Influence, Smooth};

fn project_bytes(model: &Model) -> Vec<u8> {
    crate::files::project_bytes(model).unwrap()
}

/// A bar of 16 × 4 × 4 squares in a folder of its own.
struct Place {
    folder: tempfile::TempDir,
    mesh: PathBuf,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mesh = folder.path().join("bar.obj");
        let bar = cotan::shapes::bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
        let document = Document::from_mesh(bar.connectivity(), bar.positions()).unwrap();
        cotan_io::save(&document, &mesh).unwrap();
        Self { folder, mesh }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn open(&self) -> Workspace {
        open(&self.mesh)
    }
}

fn open(path: &Path) -> Workspace {
    let mut workspace = Workspace::start(|| {}).unwrap();
    let path = path.to_owned();
    workspace.apply(Command::Open { path });
    let effects = workspace.finish();
    assert!(
        matches!(effects.as_slice(), [Effect::Opened(_)]),
        "{effects:?}"
    );
    workspace
}

/// Applies commands one after the other and waits for their results. Nothing must go wrong.
fn run(workspace: &mut Workspace, commands: impl IntoIterator<Item = Command>) {
    for command in commands {
        let mut effects = workspace.apply(command.clone());
        effects.extend(workspace.finish());
        let problem = effects.iter().find(|effect| {
            matches!(
                effect,
                Effect::Told(_) | Effect::Asked { .. } | Effect::AskedForFile
            )
        });
        assert!(problem.is_none(), "{command:?}: {problem:?}");
    }
}

/// The vertices at one end of the bar.
fn end(workspace: &Workspace, side: f64) -> Command {
    let original = workspace.model().unwrap().original();
    let at_end = original.iter().filter(|(_, p)| p.x * side > 1.99);
    Command::Select {
        vertices: at_end.map(|(v, _)| v).collect(),
        how: Combine::Replace,
    }
}

/// Fixes one end of the bar, and makes a handle of the other.
fn hold_ends(workspace: &mut Workspace) {
    let (left, right) = (end(workspace, -1.0), end(workspace, 1.0));
    let fix = Command::MakeHandle { role: Role::Fixed };
    let hold = Command::MakeHandle {
        role: Role::Movable,
    };
    run(workspace, [left, fix, right, hold]);
}

/// A bar has no noise, and the default would leave it alone.
fn rounding(strength: f64) -> Smooth {
    Smooth {
        method: SmoothMethod::Curvature,
        strength,
        ..Smooth::default()
    }
}

fn lift(by: f64) -> Command {
    let turn = Vector3::new(0.0, 0.3, 0.0);
    Command::MoveHandle {
        handle: 1,
        motion: Isometry3::new(Vector3::new(0.0, 0.0, by), turn).to_homogeneous(),
        turn,
    }
}

fn scene(workspace: &Workspace) -> Scene {
    workspace.scene().unwrap().clone()
}

fn label(workspace: &Workspace) -> String {
    let history = workspace.model().unwrap().history();
    history.present().label.clone()
}

fn exported(workspace: &mut Workspace, place: &Place) -> Vec<u8> {
    let path = place.path("exported.obj");
    let export = Command::ExportMesh {
        path: path.clone(),
        over: Over::Any,
    };
    run(workspace, [export]);
    std::fs::read(path).unwrap()
}

#[test]
fn a_drag_is_a_step_whose_shape_is_that_of_the_job() {
    let place = Place::new();
    let mut workspace = place.open();
    hold_ends(&mut workspace);
    let before = scene(&workspace);
    workspace.apply(Command::Grab { handle: 1 });
    for step in 1..=5 {
        let motion = Isometry3::new(Vector3::z() * 0.1 * f64::from(step), Vector3::zeros());
        workspace.apply(Command::Drag {
            motion: motion.to_homogeneous(),
        });
        workspace.poll();
    }
    run(&mut workspace, [Command::Drop]);
    let after = scene(&workspace);
    assert!(after.is_settled && label(&workspace) == "Move A");
    let model = workspace.model().unwrap();
    let job = cotan::deform(
        model.surface(model.original()),
        &crate::job_handles(after.handles(), &[]),
        &crate::editor_options(),
    )
    .unwrap();
    let pairs = after.shape.values().zip(job.positions.values());
    let farthest = pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(farthest < 4e-6, "{farthest:e}");
    run(&mut workspace, [Command::Undo]);
    assert_eq!(scene(&workspace), before);
    run(&mut workspace, [Command::Redo]);
    assert!(scene(&workspace).shape.is(&after.shape));
    // The files are equal byte by byte.
    let last = exported(&mut workspace, &place);
    run(&mut workspace, [Command::GoTo { step: 0 }]);
    let first = exported(&mut workspace, &place);
    assert_eq!(first, std::fs::read(&place.mesh).unwrap());
    assert!(last != first && !workspace.is_changed());
    run(&mut workspace, [Command::GoTo { step: 5 }]);
    assert_eq!(exported(&mut workspace, &place), last);
    // A drag that is cancelled leaves nothing.
    workspace.apply(Command::Grab { handle: 1 });
    workspace.apply(Command::Drag {
        motion: nalgebra::Matrix4::identity(),
    });
    run(&mut workspace, [Command::CancelDrag]);
    assert_eq!(scene(&workspace), after);
}

#[test]
fn smoothing_leaves_fixed_regions_and_what_is_not_selected() {
    let place = Place::new();
    let mut workspace = place.open();
    let original = workspace.model().unwrap().original().clone();
    let left = end(&workspace, -1.0);
    let fix = Command::MakeHandle { role: Role::Fixed };
    let smooth_it = || Command::AdjustSmooth {
        smooth: rounding(0.5),
    };
    run(&mut workspace, [left, fix, smooth_it()]);
    let smoothed = scene(&workspace).shape;
    let (mut moved, mut fixed) = (0, 0);
    for (v, p) in original.iter() {
        match p.x < -1.99 {
            true => {
                assert_eq!(smoothed[v], *p, "{v:?} is fixed");
                fixed += 1;
            }
            false => moved += usize::from(smoothed[v] != *p),
        }
    }
    assert!(fixed > 20 && moved > 20);
    // Without anything fixed it is the library's job.
    run(
        &mut workspace,
        [Command::Undo, Command::Undo, Command::Undo, smooth_it()],
    );
    let surface = Surface::assume_checked(workspace.model().unwrap().mesh(), &original);
    let options = SmoothOptions::default().method(SmoothMethod::Curvature);
    let job = smooth(surface, &Handles::new(), &options).unwrap();
    assert_eq!(*scene(&workspace).shape, job.positions);
    // With a selection only that moves, and a mask does the same.
    let half = original.iter().filter(|(_, p)| p.x > 0.5).map(|(v, _)| v);
    let select = Command::Select {
        vertices: half.collect(),
        how: Combine::Replace,
    };
    run(&mut workspace, [Command::Undo, select, smooth_it()]);
    let selected = scene(&workspace).shape;
    let is_still = |shape: &Shape| {
        let all = original.iter();
        all.filter(|(_, p)| p.x <= 0.5).all(|(v, p)| shape[v] == *p)
    };
    assert!(is_still(&selected) && selected != original);
    let name = "half".to_owned();
    let mask = Command::MakeMask { name };
    run(&mut workspace, [Command::Undo, mask, smooth_it()]);
    assert_eq!(scene(&workspace).shape, selected);
    assert!(scene(&workspace).selection().is_empty());
    // Details are restricted in the same way.
    run(&mut workspace, [Command::Undo]);
    run(&mut workspace, [Command::ScaleDetails { factor: 1.5 }]);
    let scaled = scene(&workspace).shape;
    assert!(is_still(&scaled) && scaled != original);
}

#[test]
fn a_slider_starts_from_the_shape_before_it_and_follows_undo() {
    let place = Place::new();
    let mut workspace = place.open();
    let adjust = |strength| Command::AdjustSmooth {
        smooth: rounding(strength),
    };
    run(&mut workspace, [adjust(0.9)]);
    let strong = scene(&workspace).shape;
    run(&mut workspace, [adjust(0.2), adjust(0.9)]);
    assert_eq!(scene(&workspace).shape, strong);
    assert_eq!(workspace.model().unwrap().history().index(), 1);
    run(&mut workspace, [Command::ScaleDetails { factor: 2.0 }]);
    let doubled = scene(&workspace).shape;
    run(
        &mut workspace,
        [0.5, 2.0].map(|factor| Command::ScaleDetails { factor }),
    );
    assert_eq!(scene(&workspace).shape, doubled);
    assert_eq!(scene(&workspace).settings().detail, 2.0);
    run(&mut workspace, [Command::Undo]);
    assert_eq!(scene(&workspace).settings().detail, 1.0);
    assert_eq!(scene(&workspace).settings().smooth, rounding(0.9));
    run(&mut workspace, [Command::Undo]);
    assert_eq!(scene(&workspace).settings().smooth, Smooth::default());
}

#[test]
fn the_sphere_leaves_what_is_fixed() {
    let place = Place::new();
    let mut workspace = place.open();
    let left = end(&workspace, -1.0);
    run(&mut workspace, [Command::MapToSphere]);
    let sphere = workspace.shown().unwrap().clone();
    assert!(!workspace.is_changed() && workspace.morph().unwrap().share() == 1.0);
    run(&mut workspace, [Command::LeaveMorph]);
    let fix = Command::MakeHandle { role: Role::Fixed };
    run(&mut workspace, [left, fix, Command::MapToSphere]);
    run(&mut workspace, [Command::Morph { share: 0.5 }]);
    let half = workspace.shown().unwrap().clone();
    run(&mut workspace, [Command::KeepMorph]);
    let kept = scene(&workspace);
    assert_eq!(kept.shape, half);
    assert!(kept.rest.is(&kept.shape));
    for (v, p) in workspace.model().unwrap().original().iter() {
        let expected = match p.x < -1.99 {
            true => *p,
            false => p + (sphere[v] - p) * 0.5,
        };
        assert!((kept.shape[v] - expected).norm() < 1e-12);
    }
}

#[test]
fn a_project_brings_everything_back() {
    let place = Place::new();
    let mut workspace = place.open();
    hold_ends(&mut workspace);
    let name = "upper arm".to_owned();
    let influence = Some(Influence::default());
    let follow = Follow {
        influence,
        ..Follow::default()
    };
    let (left, right) = (end(&workspace, -1.0), end(&workspace, 1.0));
    run(
        &mut workspace,
        [
            Command::RenameHandle { handle: 1, name },
            Command::SetFollow { follow },
            lift(0.4),
            left,
            Command::MakeMask {
                name: "left".to_owned(),
            },
            right,
            Command::GrowSelection,
        ],
    );
    let losses = workspace.model().unwrap().losses().join("; ");
    assert!(
        losses.contains("Mask left") || losses.contains("the shape"),
        "{losses}"
    );
    assert!(
        losses.contains("upper arm") && losses.contains("left"),
        "{losses}"
    );
    let path = place.path("arm.cotan");
    let over = Over::Own;
    let save = Command::SaveAs {
        path: path.clone(),
        over,
    };
    run(&mut workspace, [save]);
    assert!(!workspace.is_changed());
    let bytes = std::fs::read(&path).unwrap();
    let read = open(&path);
    assert_eq!(scene(&read), scene(&workspace));
    assert_eq!(read.model().unwrap().file().name, "bar.obj");
    assert!(!read.is_changed());
    // The same model gives the same bytes, also in the second generation.
    assert_eq!(project_bytes(read.model().unwrap()), bytes);
    // Saving goes on in the project, and the mesh beside it is untouched.
    let mut read = read;
    let before = std::fs::read(&place.mesh).unwrap();
    run(&mut read, [lift(0.2), Command::Save]);
    assert_ne!(std::fs::read(&path).unwrap(), bytes);
    assert_eq!(std::fs::read(&place.mesh).unwrap(), before);
    assert_eq!(scene(&open(&path)), scene(&read));
}

#[test]
fn a_damaged_project_is_refused() {
    let place = Place::new();
    let mut workspace = place.open();
    hold_ends(&mut workspace);
    run(&mut workspace, [lift(0.4)]);
    let bytes = project_bytes(workspace.model().unwrap());
    let path = place.path("a.cotan");
    std::fs::write(&path, &bytes).unwrap();
    let fingerprint = Fingerprint::of(&path).unwrap();
    let limits = cotan_io::Limits::default();
    let read = |bytes: &[u8]| crate::files::read_project(&path, bytes, fingerprint, &limits);
    read(&bytes).unwrap();
    for end in (0..bytes.len()).step_by(41) {
        assert!(read(&bytes[..end]).is_err(), "{end}");
    }
    let small = cotan_io::Limits {
        max_bytes: 2000,
        ..limits
    };
    let refused = crate::files::read_project(&path, &bytes, fingerprint, &small);
    assert!(refused.is_err());
}

#[test]
fn saving_confirms_with_the_path_and_asks_before_it_replaces() {
    let place = Place::new();
    let mut workspace = place.open();
    hold_ends(&mut workspace);
    run(&mut workspace, [lift(0.4)]);
    let effects = workspace.apply(Command::Save);
    assert!(matches!(&effects[0], Effect::Written(path) if *path == place.mesh));
    assert!(!workspace.is_changed());
    std::fs::write(&place.mesh, "v 0 0 0\n").unwrap();
    run(&mut workspace, [Command::Undo]);
    let effects = workspace.apply(Command::Save);
    let [Effect::Asked { command, .. }] = effects.as_slice() else {
        panic!("{effects:?}");
    };
    run(&mut workspace, [command.clone()]);
    assert!(!workspace.is_changed());
}
