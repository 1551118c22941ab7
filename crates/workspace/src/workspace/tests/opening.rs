//! Opening: the sample, repaired files, files that are no manifold, handles files.

use super::*;
use crate::handle::Origin;

/// Opens a file with a command, and returns the notes about it.
fn opened_by(workspace: &mut Workspace, command: Command) -> String {
    let mut effects = workspace.apply(command);
    effects.extend(workspace.finish());
    let mut notes = Vec::new();
    let mut is_open = false;
    for effect in effects {
        match effect {
            Effect::Opened(_) => is_open = true,
            Effect::Told(Notice::Note(text)) => notes.push(text),
            other => panic!("{other:?}"),
        }
    }
    assert!(is_open);
    notes.join("\n")
}

fn write(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// Two tetrahedra that share their vertex 3, and a degenerate face.
const TOUCHING: &str = "\
v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 2\nv 1 0 2\nv 0 1 2
f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4
f 5 6 7\nf 5 4 6\nf 6 4 7\nf 7 4 5
";

fn pull(vertex: usize, by: f64) -> [Command; 3] {
    let select = Command::Select {
        vertices: vec![VertexId::new(vertex)],
        how: Combine::Replace,
    };
    let role = Role::Movable;
    let motion = nalgebra::Matrix4::new_translation(&Vector3::new(0.0, by, 0.0));
    let turn = Vector3::zeros();
    let handle = 0;
    [
        select,
        Command::MakeHandle { role },
        Command::MoveHandle {
            handle,
            motion,
            turn,
        },
    ]
}

/// Saves a project and opens it: the scene and the bytes must be the same.
fn comes_back(workspace: &mut Workspace, path: PathBuf) -> Workspace {
    let over = Over::Own;
    let save = Command::SaveAs {
        path: path.clone(),
        over,
    };
    run(workspace, [save]);
    let mut read = Workspace::start(|| {}).unwrap();
    opened_by(&mut read, Command::Open { path: path.clone() });
    assert_eq!(scene(&read), scene(workspace));
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!(project_bytes(read.model().unwrap()), bytes);
    read
}

#[test]
fn the_sample_is_kept_beside_the_journal_and_has_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut workspace = Workspace::start(|| {}).unwrap();
    workspace
        .keep_journal(&folder.path().join("autosaves"))
        .unwrap();
    assert!(opened_by(&mut workspace, Command::OpenSample).is_empty());
    let model = workspace.model().unwrap();
    assert!(!model.has_file() && model.mesh().num_vertices() > 1000);
    assert_eq!(model.file().path, folder.path().join("sample.obj"));
    assert!(workspace.recent().files().is_empty());
    let effects = workspace.apply(Command::Save);
    assert!(matches!(effects.as_slice(), [Effect::AskedForFile]));
}

#[test]
fn opened_and_saved_files_are_remembered() {
    let place = Place::new();
    let folder = place.path("autosaves");
    let mut workspace = Workspace::start(|| {}).unwrap();
    workspace.keep_journal(&folder).unwrap();
    let path = place.mesh.clone();
    opened_by(&mut workspace, Command::Open { path });
    let project = place.path("bar.cotan");
    let over = Over::Own;
    let save = Command::SaveAs {
        path: project.clone(),
        over,
    };
    run(&mut workspace, [save]);
    let expected = [project, place.mesh.clone()];
    assert_eq!(workspace.recent().files(), expected);
    let mut next = Workspace::start(|| {}).unwrap();
    next.keep_journal(&folder).unwrap();
    assert_eq!(next.recent().files(), expected);
    // A file that cannot be opened leaves nothing open, and the list stays.
    let path = place.path("none.obj");
    next.apply(Command::Open { path });
    let effects = next.finish();
    assert!(matches!(
        effects.as_slice(),
        [Effect::Told(Notice::Error(_))]
    ));
    assert!(next.model().is_none());
    assert_eq!(next.recent().files(), expected);
}

#[test]
fn discarded_changes_are_not_asked_about_and_leave_no_journal() {
    let place = Place::new();
    let folder = place.path("autosaves");
    let mut workspace = place.open();
    workspace.keep_journal(&folder).unwrap();
    hold_ends(&mut workspace);
    run(&mut workspace, [lift(0.3)]);
    let journals = || {
        let entries = std::fs::read_dir(&folder).unwrap().map(Result::unwrap);
        let is_one = |path: &PathBuf| path.extension().is_some_and(|e| e == "autosave");
        entries.map(|e| e.path()).filter(is_one).count()
    };
    assert!(workspace.is_changed() && journals() == 1);
    run(&mut workspace, [Command::Discard]);
    assert!(!workspace.is_changed() && journals() == 0);
    // What comes after is a change again.
    run(&mut workspace, [lift(0.4)]);
    assert!(workspace.is_changed() && journals() == 1);
}

#[test]
fn the_open_boundary_is_fixed_around_other_handles_and_let_go() {
    let folder = tempfile::tempdir().unwrap();
    let sheet = cotan::shapes::bumpy_plane::<f64>([1.0, 1.0], [6, 6], 0.1);
    let document = Document::from_mesh(sheet.connectivity(), sheet.positions()).unwrap();
    let path = folder.path().join("sheet.obj");
    cotan_io::save(&document, &path).unwrap();
    let mut workspace = open(&path);
    let mesh = sheet.connectivity();
    let rim: Vec<VertexId> = mesh.vertices().filter(|&v| mesh.is_rim_vertex(v)).collect();
    run(
        &mut workspace,
        pull(rim[0].index(), 0.0).into_iter().take(2),
    );
    run(&mut workspace, [Command::FixBoundary]);
    let now = scene(&workspace);
    let boundary = now.boundary_handle().unwrap();
    assert_eq!(now.handles()[boundary].vertices, rim[1..]);
    assert_eq!(now.handles()[boundary].role, Role::Fixed);
    run(&mut workspace, [Command::FreeBoundary]);
    assert_eq!(scene(&workspace).boundary_handle(), None);
    assert_eq!(scene(&workspace).handles().len(), 1);
    // Letting go of what is not held changes nothing.
    let steps = workspace.model().unwrap().history().index();
    run(&mut workspace, [Command::FreeBoundary]);
    assert_eq!(workspace.model().unwrap().history().index(), steps);
}

#[test]
fn handles_are_exported_and_imported_for_the_command_line() {
    let place = Place::new();
    let mut workspace = place.open();
    hold_ends(&mut workspace);
    run(&mut workspace, [lift(0.3)]);
    let soft = Command::SetHold {
        handle: 0,
        hold: Hold::Soft(7.0),
    };
    run(&mut workspace, [soft]);
    let before = scene(&workspace);
    let path = place.path("handles.json");
    let export = Command::ExportHandles { path: path.clone() };
    let effects = workspace.apply(export);
    assert!(
        matches!(effects.as_slice(), [Effect::Written(_)]),
        "{effects:?}"
    );
    run(&mut workspace, [Command::RemoveAllHandles]);
    run(&mut workspace, [Command::ImportHandles { path }]);
    let now = scene(&workspace);
    let held = |scene: &Scene| -> Vec<_> {
        let groups = scene.handles().iter();
        groups
            .map(|g| (g.vertices.clone(), g.role, g.hold, g.job_motion()))
            .collect()
    };
    assert_eq!(held(&now), held(&before));
    for (v, p) in before.shape.iter() {
        assert!((now.shape[v] - p).norm() < 1e-6);
    }
    let path = place.path("letter.json");
    std::fs::write(&path, "Dear reader").unwrap();
    let effects = workspace.apply(Command::ImportHandles { path });
    assert!(matches!(
        effects.as_slice(),
        [Effect::Told(Notice::Error(_))]
    ));
    assert_eq!(scene(&workspace), now);
}

#[test]
fn faces_that_are_no_manifold_are_deformed_saved_and_recovered() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data/autosaves");
    let path = write(folder.path(), "touching.obj", TOUCHING);
    let mut workspace = Workspace::start(|| {}).unwrap();
    workspace.keep_journal(&data).unwrap();
    let open = Command::Open { path: path.clone() };
    let note = opened_by(&mut workspace, open);
    assert!(note.contains("vertex 3"), "{note}");
    let fix = Command::Select {
        vertices: vec![VertexId::new(0)],
        how: Combine::Replace,
    };
    let fixed = Command::MakeHandle { role: Role::Fixed };
    run(&mut workspace, [fix, fixed]);
    // The vertex that two fans share: one handle holds all its copies, and they move as one.
    let [select, make, _] = pull(3, 0.0);
    let moved = Command::MoveHandle {
        handle: 1,
        motion: nalgebra::Matrix4::new_translation(&Vector3::y()),
        turn: Vector3::zeros(),
    };
    run(&mut workspace, [select, make, moved]);
    let mesh = workspace.model().unwrap().mesh().clone();
    let now = scene(&workspace);
    assert_eq!(now.handles()[1].vertices.len(), 2);
    assert_eq!(mesh.num_vertices(), 8);
    for (copy, row) in mesh.copies() {
        assert_eq!(now.shape[copy], now.shape[row]);
    }
    assert!((now.shape[VertexId::new(3)].y - 1.0).abs() < 1e-12);
    let influence = Some(Influence::default());
    let follow = Follow {
        influence,
        ..Follow::default()
    };
    run(&mut workspace, [Command::SetFollow { follow }]);
    let shape = scene(&workspace).shape;
    assert!(mesh.copies().all(|(copy, row)| shape[copy] == shape[row]));
    // A crash, a project, and the mesh itself bring it back.
    let to = folder.path().join("crash");
    std::fs::create_dir_all(&to).unwrap();
    for entry in std::fs::read_dir(&data).unwrap() {
        let from = entry.unwrap().path();
        if from.extension().is_some_and(|e| e == "autosave") {
            std::fs::copy(&from, to.join("1.autosave")).unwrap();
        }
    }
    let mut next = Workspace::start(|| {}).unwrap();
    let left = next.keep_journal(&to).unwrap().left.remove(0);
    next.recover(left).unwrap();
    assert_eq!(scene(&next), scene(&workspace));
    comes_back(&mut workspace, folder.path().join("touching.cotan"));
    let mesh_path = folder.path().join("out.obj");
    let over = Over::Own;
    let export = Command::ExportMesh {
        path: mesh_path.clone(),
        over,
    };
    run(&mut workspace, [export]);
    let saved = cotan_io::load(&mesh_path).unwrap();
    assert_eq!(saved.positions()[3], shape[VertexId::new(3)]);
}

#[test]
fn a_repaired_mesh_of_any_format_comes_back_from_its_project_and_journal() {
    let folder = tempfile::tempdir().unwrap();
    let document = cotan_io::load(write(folder.path(), "a.obj", TOUCHING)).unwrap();
    for format in cotan_io::Format::ALL {
        let name = format!("touching.{}", format.extension());
        let path = folder.path().join(&name);
        cotan_io::save(&document, &path).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let data = folder.path().join(format!("{name}-data/autosaves"));
        let mut workspace = Workspace::start(|| {}).unwrap();
        workspace.keep_journal(&data).unwrap();
        let note = opened_by(&mut workspace, Command::OpenRepaired { path: path.clone() });
        assert!(note.contains("split vertex"), "{name}: {note}");
        let model = workspace.model().unwrap();
        assert_eq!(model.mesh().components().count(), 2, "{name}");
        assert!(!model.mesh().has_copies());
        // The last one is a copy that the repair has made.
        let last = model.mesh().num_vertices() - 1;
        run(&mut workspace, pull(last, 0.5));
        let to = folder.path().join(format!("{name}-crash"));
        std::fs::create_dir_all(&to).unwrap();
        for entry in std::fs::read_dir(&data).unwrap() {
            let from = entry.unwrap().path();
            if from.extension().is_some_and(|e| e == "autosave") {
                std::fs::copy(&from, to.join("1.autosave")).unwrap();
            }
        }
        let mut next = Workspace::start(|| {}).unwrap();
        let left = next.keep_journal(&to).unwrap().left.remove(0);
        next.recover(left).unwrap();
        assert_eq!(scene(&next), scene(&workspace), "{name}");

        let project = folder.path().join(format!("{name}.cotan"));
        let read = comes_back(&mut workspace, project);
        let (read, model) = (read.model().unwrap(), workspace.model().unwrap());
        let changes = |model: &Model| format!("{:?}", model.file().changes);
        assert_eq!(changes(read), changes(model), "{name}");
        assert!(scene(&workspace).handles()[0].origin == Origin::Rest);
        assert_eq!(std::fs::read(&path).unwrap(), bytes);
    }
}
