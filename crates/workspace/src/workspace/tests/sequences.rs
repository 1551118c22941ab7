//! Recovery after every command, and random sequences of commands.

use super::*;
use crate::brush::Brush;
use crate::mirror::Mirror;

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
        1 => Just(Command::HideSelection),
        1 => Just(Command::HideOthers),
        1 => Just(Command::ShowAll),
        1 => index.clone().prop_map(|handle| Command::ActivateToo { handle }),
        2 => index.clone().prop_map(|handle| Command::AddToHandle { handle }),
        1 => index.clone().prop_map(|handle| Command::TakeFromHandle { handle }),
        1 => prop::option::of(0..300_usize).prop_map(|v| Command::SetPivot {
            vertex: v.map(VertexId::new)
        }),
        1 => (0..3_usize, any::<bool>()).prop_map(|(axis, is_on)| Command::SetMirror {
            mirror: is_on.then(|| Mirror {
                point: Vector3::zeros(),
                normal: Vector3::ith(axis, 1.0),
            })
        }),
        1 => Just(Command::MirrorSelection),
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
        Just(Some(Job::Paint(Brush::default()))),
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
