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
fn what_is_left_behind_is_fixed_by_one_command() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.obj");
    let ball = cotan::shapes::icosphere::<f64>(2);
    let mut points: Vec<_> = ball.positions().values().copied().collect();
    let n = points.len() as u32;
    points.extend(ball.positions().values().map(|p| p + Vector3::x() * 3.0));
    let corners = ball.to_triangles();
    let both = corners.iter().copied().chain(corners.iter().map(|v| v + n));
    let faces: Vec<Vec<u32>> = both
        .collect::<Vec<_>>()
        .chunks(3)
        .map(<[u32]>::to_vec)
        .collect();
    let document = Document::new(points, faces.into_iter().collect()).unwrap();
    cotan_io::save(&document, &path).unwrap();
    let mut workspace = open(&path);
    let select = Command::Select {
        vertices: vec![VertexId::new(3)],
        how: Combine::Replace,
    };
    run(&mut workspace, [select, Command::FixTheRest]);
    let now = scene(&workspace);
    let [rest] = now.handles() else {
        panic!("{:?}", now.handles());
    };
    assert_eq!(rest.vertices.len(), n as usize);
    assert!(rest.vertices.iter().all(|v| now.shape[*v].x > 1.5));
    assert_eq!(now.selection(), [VertexId::new(3)]);
    run(&mut workspace, [Command::SelectLinked]);
    assert_eq!(scene(&workspace).selection().len(), n as usize);
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
    let read = |bytes: &[u8]| crate::files::project_of(&path, bytes, fingerprint, &limits);
    read(&bytes).unwrap();
    for end in (0..bytes.len()).step_by(41) {
        assert!(read(&bytes[..end]).is_err(), "{end}");
    }
    let small = cotan_io::Limits {
        max_bytes: 2000,
        ..limits
    };
    let refused = crate::files::project_of(&path, &bytes, fingerprint, &small);
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

/// Leaves a journal behind, as a process that is killed does.
fn kill(workspace: Workspace, folder: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(folder).unwrap() {
        let from = entry.unwrap().path();
        if from.extension().is_some_and(|e| e == "autosave") {
            std::fs::copy(&from, to.join(from.file_name().unwrap())).unwrap();
        }
    }
    drop(workspace);
}

/// The recovery of a workspace that starts in a folder, or `None` if there is nothing.
fn recovered(folder: &Path) -> Option<Workspace> {
    let mut workspace = Workspace::start(|| {}).unwrap();
    let listing = workspace.keep_journal(folder).unwrap();
    assert!(listing.problems.is_empty(), "{:?}", listing.problems);
    let left = listing.left.into_iter().next()?;
    let effects = workspace.recover(left).unwrap();
    assert!(
        matches!(effects.as_slice(), [Effect::Opened(_)]),
        "{effects:?}"
    );
    workspace.finish();
    Some(workspace)
}

#[test]
fn every_command_is_recovered_as_soon_as_it_was_carried_out() {
    let place = Place::new();
    let folder = place.path("data");
    let mut workspace = place.open();
    workspace.keep_journal(&folder).unwrap();
    let (left, right) = (end(&workspace, -1.0), end(&workspace, 1.0));
    let fix = Command::MakeHandle { role: Role::Fixed };
    let hold = Command::MakeHandle {
        role: Role::Movable,
    };
    let name = "hand".to_owned();
    let commands = [
        left,
        fix,
        right,
        hold,
        lift(0.3),
        Command::Undo,
        Command::Redo,
        Command::RenameHandle { handle: 1, name },
        Command::AdjustSmooth {
            smooth: rounding(0.5),
        },
        Command::Undo,
        lift(0.6),
        Command::GoTo { step: 2 },
        Command::Redo,
    ];
    for (k, command) in commands.into_iter().enumerate() {
        run(&mut workspace, [command]);
        let now = scene(&workspace);
        let to = place.path(&format!("crash-{k}"));
        // The journal of the running process is copied as a crash would leave it.
        std::fs::create_dir_all(&to).unwrap();
        for entry in std::fs::read_dir(&folder).unwrap() {
            let from = entry.unwrap().path();
            if from.extension().is_some_and(|e| e == "autosave") {
                std::fs::copy(&from, to.join("1.autosave")).unwrap();
            }
        }
        match recovered(&to) {
            Some(read) => assert_eq!(scene(&read), now, "{k}"),
            None => assert!(!workspace.is_changed(), "{k}"),
        }
    }
    // The history comes back too.
    let to = place.path("at-last");
    kill(workspace, &folder, &to);
    let mut read = recovered(&to).unwrap();
    assert_eq!(read.model().unwrap().history().labels().count(), 7);
    run(&mut read, [Command::GoTo { step: 0 }]);
    assert!(!read.is_changed());
    drop(read);
    assert!(recovered(&to).is_none());
}

fn commands() -> impl Strategy<Value = Command> {
    let n = 16 * 4 * 4 + 2_usize;
    let vertices = prop::collection::vec(0..n, 0..8);
    let how = prop_oneof![
        Just(Combine::Replace),
        Just(Combine::Add),
        Just(Combine::Subtract)
    ];
    let select = (vertices, how).prop_map(|(vertices, how)| Command::Select {
        vertices: vertices
            .into_iter()
            .map(|v: usize| VertexId::new(v))
            .collect(),
        how,
    });
    let role = prop_oneof![Just(Role::Fixed), Just(Role::Movable)];
    let moved = (0..4_usize, -0.2..0.2_f64).prop_map(|(handle, by)| Command::MoveHandle {
        handle,
        motion: nalgebra::Matrix4::new_translation(&Vector3::new(0.0, by, by)),
        turn: Vector3::zeros(),
    });
    let hold = (0..4_usize, prop::option::of(1.0..100.0_f64)).prop_map(|(handle, weight)| {
        let hold = weight.map_or(Hold::Hard, Hold::Soft);
        Command::SetHold { handle, hold }
    });
    let index = 0..4_usize;
    prop_oneof![
        4 => select,
        1 => Just(Command::SelectAll),
        1 => Just(Command::InvertSelection),
        1 => Just(Command::GrowSelection),
        1 => Just(Command::ShrinkSelection),
        1 => Just(Command::SelectLinked),
        1 => (0.0..2.0_f64).prop_map(|distance| Command::SelectWithin { distance }),
        4 => role.prop_map(|role| Command::MakeHandle { role }),
        1 => Just(Command::FixTheRest),
        1 => index.clone().prop_map(|handle| Command::SelectHandle { handle }),
        1 => index.clone().prop_map(|handle| Command::RemoveHandle { handle }),
        1 => prop::option::of(index.clone()).prop_map(|handle| Command::Activate { handle }),
        1 => index.clone().prop_map(|handle| Command::RenameHandle {
            handle,
            name: "renamed".to_owned()
        }),
        2 => moved,
        1 => hold,
        1 => Just(Command::RemoveAllHandles),
        1 => Just(Command::MakeMask { name: "mask".to_owned() }),
        1 => prop::option::of(index.clone()).prop_map(|mask| Command::UseMask { mask }),
        1 => index.clone().prop_map(|mask| Command::SelectMask { mask }),
        1 => index.prop_map(|mask| Command::RemoveMask { mask }),
        1 => Just(Command::ResetShape),
        1 => (0.0..1.0_f64).prop_map(|strength| Command::SetSmooth {
            smooth: Smooth { strength, ..Smooth::default() }
        }),
        2 => Just(Command::Undo),
        2 => Just(Command::Redo),
        1 => (0..6_usize).prop_map(|step| Command::GoTo { step }),
    ]
}

/// Shapes in place of those of the solver and of jobs, whose numbers do not matter here.
fn results() -> impl Strategy<Value = (Option<Job>, f64)> {
    let job = prop_oneof![
        Just(None),
        Just(Some(Job::Smooth(Smooth::default()))),
        Just(Some(Job::SmoothAgain(Smooth::default()))),
        (0.0..2.0_f64).prop_map(|x| Some(Job::Details(x))),
        (0.0..1.0_f64).prop_map(|x| Some(Job::Morph(x))),
    ];
    (job, -1.0..1.0_f64)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// After any commands: undo leads back to the opened model, redo to where it was, a replay of
    /// the list of commands and a project to the same scene, and the files are equal byte by byte.
    #[test]
    fn any_sequence_of_commands_is_undone_repeated_replayed_and_stored(
        steps in prop::collection::vec((commands(), prop::option::of(results())), 1..24)
    ) {
        let bar = cotan::shapes::bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bar.obj");
        let document = Document::from_mesh(bar.connectivity(), bar.positions()).unwrap();
        cotan_io::save(&document, &path).unwrap();
        let opened = Model::new(crate::files::open(&path).unwrap());
        let mut model = opened.clone();
        let mut list = Vec::new();
        for (command, result) in steps {
            let made = result.map(|(job, by)| {
                let shape = model.scene().shape.map(|p| p + Vector3::z() * by);
                let shape = Shape::new(shape);
                match job {
                    Some(job) => Command::Finish { job, shape },
                    None => Command::Arrive { shape, is_settled: by > 0.0 },
                }
            });
            for command in [Some(command), made].into_iter().flatten() {
                if model.record(&command).is_ok() {
                    list.push(command);
                }
            }
        }
        let last = model.scene().clone();
        let stored = project_bytes(&model);

        // The list alone leads to the same model, also through JSON.
        let json = serde_json::to_string(&list).unwrap();
        let list: Vec<Command> = serde_json::from_str(&json).unwrap();
        let mut replayed = opened.clone();
        for command in &list {
            replayed.record(command).unwrap();
        }
        prop_assert_eq!(replayed.scene(), &last);
        prop_assert_eq!(replayed.history().index(), model.history().index());
        prop_assert_eq!(project_bytes(&replayed), stored.clone());

        // All the way back and forth.
        let steps = model.history().index();
        let mut scenes = vec![last.clone()];
        while model.record(&Command::Undo).unwrap().is_some() {
            scenes.push(model.scene().clone());
        }
        prop_assert_eq!(scenes.len(), steps + 1);
        prop_assert_eq!(&model.scene().rest, &opened.scene().rest);
        for scene in scenes.iter().rev().skip(1) {
            prop_assert!(model.record(&Command::Redo).unwrap().is_some());
            prop_assert_eq!(model.scene(), scene);
        }
        prop_assert_eq!(project_bytes(&model), stored.clone());

        // A project and the record of a journal hold the scene.
        let path = folder.path().join("bar.cotan");
        std::fs::write(&path, &stored).unwrap();
        let read = crate::files::open_project(&path).unwrap();
        prop_assert_eq!(read.scene(), &last);
        prop_assert_eq!(project_bytes(&read), stored);
        let record = serde_json::to_string(&SceneRecord::of(&model)).unwrap();
        let record: SceneRecord = serde_json::from_str(&record).unwrap();
        prop_assert_eq!(record.scene(&opened).unwrap(), last);
    }
}
