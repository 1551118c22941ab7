use super::*;

use nalgebra::Point3;

use crate::files::{Fingerprint, OpenedMesh, open};
use crate::model::Model;
use crate::record::SceneRecord;
use crate::shape::Shape;

struct Sandbox {
    folder: tempfile::TempDir,
    opened: OpenedMesh,
    scene: SceneRecord,
}

impl Sandbox {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        let opened = open(&path).unwrap();
        let mut model = Model::new(opened.clone());
        model.record(&arrival()).unwrap();
        Self {
            folder,
            scene: SceneRecord::of(&model),
            opened,
        }
    }

    fn saves(&self) -> PathBuf {
        self.folder.path().join("data/autosaves")
    }

    fn start(&self) -> Autosave {
        Autosave::start(&self.saves()).unwrap()
    }

    fn record(&self) -> Record<'_> {
        Record {
            mesh: &self.opened.path,
            fingerprint: self.opened.fingerprint,
            has_file: true,
            is_repaired: true,
            scene: &self.scene,
        }
    }

    /// The autosaves found by an editor that starts now, expecting no problems.
    fn left(&self) -> Vec<LeftBehind> {
        let listing = list(&self.saves());
        assert!(listing.problems.is_empty(), "{:?}", listing.problems);
        listing.left
    }

    fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.saves()).unwrap();
        let mut names: Vec<String> = entries
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }
}

/// A shape whose bits are easily lost.
fn arrival() -> Command {
    let points = [0.1, -0.0, 5e-324].map(|x| Point3::new(x, 1.0 / 3.0, -x));
    Command::Arrive {
        shape: Shape::new(points.into_iter().collect()),
        is_settled: true,
    }
}

#[test]
fn what_a_process_left_is_found_when_it_no_longer_runs() {
    let sandbox = Sandbox::new();
    assert!(sandbox.left().is_empty());
    let autosave = sandbox.start();
    autosave.begin(&sandbox.record()).unwrap();
    autosave.append(&Command::Undo).unwrap();
    autosave.begin(&sandbox.record()).unwrap();
    autosave.append(&arrival()).unwrap();
    autosave.append(&Command::SelectAll).unwrap();
    assert!(sandbox.left().is_empty(), "it still runs");
    drop(autosave);
    let mut left = sandbox.left();
    let [one] = left.as_slice() else {
        panic!("{left:?}");
    };
    assert_eq!(one.mesh, sandbox.opened.path);
    assert!(one.is_current());
    assert!(one.saved.elapsed().unwrap().as_secs() < 1000);
    assert!(sandbox.left().is_empty(), "it is offered once");
    let recovered = one.read().unwrap();
    assert_eq!(recovered.commands, [arrival(), Command::SelectAll]);
    assert!(recovered.scene == sandbox.scene && recovered.has_file && recovered.is_repaired);
    assert!(!recovered.is_cut);
    let text = |command: &Command| serde_json::to_string(command).unwrap();
    assert_eq!(text(&recovered.commands[0]), text(&arrival()), "every bit");

    std::fs::write(&sandbox.opened.path, "v 0 0 0\n").unwrap();
    assert!(!left[0].is_current());
    left.pop().unwrap().remove().unwrap();
    assert!(sandbox.left().is_empty());
    assert!(sandbox.files().is_empty(), "{:?}", sandbox.files());
}

#[test]
fn a_good_end_leaves_nothing() {
    let sandbox = Sandbox::new();
    let (one, two) = (sandbox.start(), sandbox.start());
    assert_ne!(one.path(), two.path());
    one.begin(&sandbox.record()).unwrap();
    one.remove().unwrap();
    one.remove().unwrap();
    drop((one, two));
    assert!(sandbox.files().is_empty(), "{:?}", sandbox.files());
}

/// Runs in another process, started by [`a_crash_is_survived`].
#[test]
fn crash() {
    let Some(folder) = std::env::var_os("COTAN_TEST_CRASH") else {
        return;
    };
    let sandbox = Sandbox::new();
    let autosave = Autosave::start(Path::new(&folder)).unwrap();
    let _unused = Autosave::start(Path::new(&folder)).unwrap();
    autosave.begin(&sandbox.record()).unwrap();
    let part = autosave.path().with_extension("x.part");
    std::fs::write(part, "half").unwrap();
    std::process::abort();
}

#[test]
fn a_crash_is_survived() {
    let sandbox = Sandbox::new();
    let status = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "files::autosave::tests::crash", "--nocapture"])
        .env("COTAN_TEST_CRASH", sandbox.saves())
        // Temporary files of the process are removed with this sandbox.
        .env("TMPDIR", sandbox.folder.path())
        .output()
        .unwrap();
    assert!(!status.status.success(), "{status:?}");
    let left = sandbox.left();
    assert_eq!(left.len(), 1);
    left[0].read().unwrap();
    // The lock without an autosave and the partly written file are removed.
    assert_eq!(sandbox.files().len(), 2, "{:?}", sandbox.files());
}

#[test]
fn damaged_files_are_told_and_the_others_found() {
    let sandbox = Sandbox::new();
    for _ in 0..2 {
        sandbox.start().begin(&sandbox.record()).unwrap();
    }
    let victim = sandbox.saves().join(&sandbox.files()[0]);
    let whole = std::fs::read(&victim).unwrap();
    for end in (0..whole.len()).step_by(7) {
        std::fs::write(&victim, &whole[..end]).unwrap();
        let listing = list(&sandbox.saves());
        assert_eq!(
            (listing.left.len(), listing.problems.len()),
            (1, 1),
            "{end}"
        );
        let text = listing.problems[0].to_string();
        let name = victim.file_name().unwrap().to_str().unwrap();
        assert!(text.contains(name) && !text.contains('\n'), "{text}");
    }
    // Damaged after it was listed.
    std::fs::write(&victim, &whole).unwrap();
    let left = sandbox.left();
    let index = left.iter().position(|left| left.path() == victim).unwrap();
    for place in (0..whole.len()).step_by(5) {
        let mut changed = whole.clone();
        changed[place] ^= 1;
        std::fs::write(&victim, changed).unwrap();
        let read = left[index].read();
        assert!(
            matches!(read, Err(AutosaveError::Corrupt { .. })),
            "{place}"
        );
    }
    std::fs::remove_file(&victim).unwrap();
    assert!(matches!(
        left[index].read(),
        Err(AutosaveError::Read { .. })
    ));
}

#[test]
fn a_broken_command_ends_the_list_but_not_the_recovery() {
    let sandbox = Sandbox::new();
    let autosave = sandbox.start();
    let begun = autosave.begin(&sandbox.record()).unwrap() as usize;
    let first = autosave.append(&Command::SelectAll).unwrap() as usize;
    autosave.append(&arrival()).unwrap();
    let path = autosave.path().to_owned();
    drop(autosave);
    let whole = std::fs::read(&path).unwrap();
    let left = sandbox.left();
    for end in (begun..whole.len()).step_by(3) {
        std::fs::write(&path, &whole[..end]).unwrap();
        let read = left[0].read().unwrap();
        let expected = usize::from(end >= begun + first);
        assert_eq!(read.commands.len(), expected, "{end}");
        assert_eq!(read.is_cut, end != begun && end != begun + first, "{end}");
    }
    let mut changed = whole;
    changed[begun + 12] ^= 1;
    std::fs::write(&path, changed).unwrap();
    assert!(left[0].read().unwrap().commands.is_empty());
}

#[test]
fn what_is_too_large_or_no_file_is_refused_unread() {
    let sandbox = Sandbox::new();
    drop(sandbox.start());
    let huge = std::fs::File::create(sandbox.saves().join("1.autosave")).unwrap();
    if huge.set_len(MOST_BYTES + 1).is_err() {
        cotan_testing::skip("no room for a sparse file");
        return;
    }
    std::fs::create_dir(sandbox.saves().join("2.autosave")).unwrap();
    std::fs::create_dir(sandbox.saves().join("3.lock")).unwrap();
    std::fs::write(sandbox.saves().join("3.autosave"), "x").unwrap();
    std::fs::write(sandbox.saves().join("notes.txt"), "x").unwrap();
    let listing = list(&sandbox.saves());
    assert!(listing.left.is_empty());
    let texts: Vec<_> = listing.problems.iter().map(ToString::to_string).collect();
    assert_eq!(texts.len(), 3, "{texts:?}");
    assert!(texts[0].contains("2 GiB"), "{texts:?}");
    assert!(texts[1].contains("regular file"), "{texts:?}");
    assert!(sandbox.files().contains(&"notes.txt".to_owned()));
}

#[test]
fn another_mesh_is_noticed() {
    let sandbox = Sandbox::new();
    sandbox.start().begin(&sandbox.record()).unwrap();
    let recovered = sandbox.left()[0].read().unwrap();
    recovered.scene.scene(&Model::new(sandbox.opened)).unwrap();
    let path = sandbox.folder.path().join("b.obj");
    std::fs::write(
        &path,
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 3 2 4\n",
    )
    .unwrap();
    let other = Model::new(open(&path).unwrap());
    let problem = recovered.scene.scene(&other).unwrap_err();
    assert!(
        problem.contains("3 positions") && problem.contains("4 vertices"),
        "{problem}"
    );
}

#[cfg(unix)]
#[test]
fn only_the_owner_can_read_them() {
    use std::os::unix::fs::PermissionsExt;
    let sandbox = Sandbox::new();
    let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
    std::fs::create_dir_all(sandbox.saves()).unwrap();
    std::fs::set_permissions(sandbox.saves(), std::fs::Permissions::from_mode(0o755)).unwrap();
    let autosave = sandbox.start();
    autosave.begin(&sandbox.record()).unwrap();
    assert_eq!(mode(&sandbox.saves()), 0o700);
    assert_eq!(sandbox.files().len(), 2);
    for name in sandbox.files() {
        assert_eq!(mode(&sandbox.saves().join(&name)), 0o600, "{name}");
    }
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let sandbox = Sandbox::new();
    let error = Autosave::start(&sandbox.opened.path.join("b")).unwrap_err();
    assert!(error.to_string().contains("a.obj"), "{error}");
    let listing = list(&sandbox.opened.path);
    assert_eq!(listing.problems.len(), 1);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_keeps_the_autosave_before() {
    let Some(disk) = super::super::small_disk::small_disk() else {
        return;
    };
    let sandbox = Sandbox::new();
    let folder = disk.path().join("autosaves");
    let autosave = Autosave::start(&folder).unwrap();
    autosave.begin(&sandbox.record()).unwrap();
    disk.fill();
    let many = Command::Select {
        vertices: vec![cotan::halfedge::VertexId::new(123_456); 100_000],
        how: crate::Combine::Add,
    };
    let error = autosave.append(&many).unwrap_err();
    assert!(matches!(error, AutosaveError::Full { .. }), "{error}");
    drop(autosave);
    let listing = list(&folder);
    assert!(listing.problems.is_empty(), "{:?}", listing.problems);
    assert!(listing.left[0].read().unwrap().commands.is_empty());
}

#[test]
fn the_folder_can_be_named_from_outside() {
    // In another process, because all tests of this one share the environment.
    if std::env::var_os("COTAN_TEST_FOLDER").is_some() {
        println!("folder={}", folder().unwrap().display());
        return;
    }
    let ask = |data: &str| {
        let output = std::process::Command::new(std::env::current_exe().unwrap())
            .args([
                "--exact",
                "files::autosave::tests::the_folder_can_be_named_from_outside",
            ])
            .arg("--nocapture")
            .env("COTAN_TEST_FOLDER", "1")
            .env(DATA_VARIABLE, data)
            .env("HOME", "/home/somebody")
            .env_remove("XDG_DATA_HOME")
            .output()
            .unwrap();
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let named = Path::new("elsewhere").join("autosaves");
    let text = ask("elsewhere");
    assert!(
        text.contains(&format!("folder={}", named.display())),
        "{text}"
    );
    let text = ask("");
    assert!(text.contains("cotan-editor"), "{text}");
}

#[test]
fn fingerprints_are_kept() {
    let sandbox = Sandbox::new();
    sandbox.start().begin(&sandbox.record()).unwrap();
    let fingerprint = Fingerprint::of(&sandbox.opened.path).unwrap();
    assert_eq!(sandbox.left()[0].fingerprint, fingerprint);
}
