use super::super::open::{OpenedMesh, open, open_repaired};
use super::*;

use nalgebra::Vector3;

const TRIANGLE: &str = "# mine\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

struct Sandbox {
    folder: tempfile::TempDir,
    opened: OpenedMesh,
    moved: Positions<f64>,
}

impl Sandbox {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, TRIANGLE).unwrap();
        let opened = open(&path).unwrap();
        Self {
            moved: opened.processing.positions().map(|p| p + Vector3::z()),
            folder,
            opened,
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn save(&self, path: &Path, expect: Expect) -> Result<Saved, SaveError> {
        let OpenedMesh {
            document,
            processing,
            ..
        } = &self.opened;
        save(document, processing, &self.moved, path, expect)
    }

    /// The error of a save that must fail without changing any file.
    fn refused(&self, path: &Path, expect: Expect) -> SaveError {
        let count = || std::fs::read_dir(self.folder.path()).unwrap().count();
        let (before, kept) = (count(), std::fs::read(path).ok());
        let error = self.save(path, expect).unwrap_err();
        let text = error.to_string();
        let name = path.file_name().unwrap().to_str().unwrap();
        assert!(text.contains(name) && !text.contains('\n'), "{text}");
        assert_eq!(
            (count(), std::fs::read(path).ok()),
            (before, kept),
            "{text}"
        );
        error
    }
}

#[test]
fn a_mesh_is_saved_where_it_was_opened_again_and_again() {
    let sandbox = Sandbox::new();
    let path = sandbox.opened.path.clone();
    let known = sandbox.opened.fingerprint;
    let saved = sandbox.save(&path, Expect::Unchanged(known)).unwrap();
    assert!(saved.losses.is_empty());
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.starts_with("# mine\nv 0 0 1\n"), "{text}");
    // The document keeps its rest shape, and the returned fingerprint is the one to expect next.
    assert_eq!(sandbox.opened.document.positions()[0].z, 0.0);
    let again = sandbox.save(&path, Expect::Unchanged(saved.fingerprint));
    assert_eq!(again.unwrap().fingerprint, Fingerprint::of(&path).unwrap());
    assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
}

#[test]
fn every_format_is_saved_and_losses_are_told() {
    let sandbox = Sandbox::new();
    for name in [
        "b.ply", "b.off", "b.stl", "b.gltf", "b.glb", "b.OBJ", "b.ply.gz",
    ] {
        let path = sandbox.path(name);
        sandbox.save(&path, Expect::Absent).unwrap();
        let read = open(&path).unwrap();
        assert_eq!(read.document.positions()[0].z, 1.0, "{name}");
    }
    let path = sandbox.path("uv.obj");
    std::fs::write(
        &path,
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n",
    )
    .unwrap();
    let opened = open(&path).unwrap();
    let (document, processing) = (&opened.document, &opened.processing);
    let saved = save(
        document,
        processing,
        processing.positions(),
        &sandbox.path("uv.stl"),
        Expect::Absent,
    );
    assert!(!saved.unwrap().losses.is_empty());
}

#[test]
fn a_file_that_another_program_wrote_is_not_replaced_unasked() {
    let sandbox = Sandbox::new();
    let path = sandbox.opened.path.clone();
    let known = Expect::Unchanged(sandbox.opened.fingerprint);
    std::fs::write(&path, "v 9 9 9\n").unwrap();
    let error = sandbox.refused(&path, known);
    assert!(matches!(error, SaveError::Changed { .. }), "{error}");
    assert!(error.is_overridable());
    sandbox.save(&path, Expect::Anything).unwrap();

    // The same length with another time is another file, too.
    let known = Expect::Unchanged(Fingerprint::of(&path).unwrap());
    let file = std::fs::File::options().write(true).open(&path).unwrap();
    file.set_modified(std::time::UNIX_EPOCH).unwrap();
    assert!(sandbox.refused(&path, known).is_overridable());
    // A deleted file is saved again.
    std::fs::remove_file(&path).unwrap();
    sandbox.save(&path, known).unwrap();
    let error = sandbox.refused(&path, Expect::Absent);
    assert!(matches!(error, SaveError::Exists { .. }) && error.is_overridable());
}

#[test]
fn places_that_cannot_be_written_are_told_apart() {
    let sandbox = Sandbox::new();
    let refused = |name: &str| sandbox.refused(&sandbox.path(name), Expect::Anything);
    let error = refused("b.xyz").to_string();
    assert!(
        error.contains(".obj, .ply, .off, .stl, .gltf or .glb"),
        "{error}"
    );
    refused("b");
    let error = refused("none/b.obj");
    assert!(matches!(error, SaveError::NoFolder { .. }), "{error}");
    let error = refused("a.obj/b.obj");
    assert!(matches!(error, SaveError::NoFolder { .. }), "{error}");
    std::fs::create_dir(sandbox.path("folder.obj")).unwrap();
    let error = refused("folder.obj");
    assert!(matches!(error, SaveError::NotAFile { .. }), "{error}");
}

#[cfg(unix)]
fn set_mode(path: &Path, mode: u32) {
    use std::os::unix::fs::PermissionsExt;
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
}

#[cfg(unix)]
#[test]
fn read_only_files_and_folders_are_refused() {
    let sandbox = Sandbox::new();
    let path = sandbox.opened.path.clone();
    let known = Expect::Unchanged(sandbox.opened.fingerprint);
    set_mode(&path, 0o444);
    let error = sandbox.refused(&path, known);
    assert!(matches!(error, SaveError::ReadOnlyFile { .. }), "{error}");
    let link = sandbox.path("link.obj");
    std::os::unix::fs::symlink("a.obj", &link).unwrap();
    let error = sandbox.refused(&link, Expect::Anything);
    assert!(matches!(error, SaveError::ReadOnlyFile { .. }), "{error}");

    let folder = sandbox.path("locked");
    std::fs::create_dir(&folder).unwrap();
    set_mode(&folder, 0o555);
    let error = sandbox.refused(&folder.join("b.obj"), Expect::Absent);
    set_mode(&folder, 0o755);
    assert!(matches!(error, SaveError::ReadOnlyFolder { .. }), "{error}");
}

#[cfg(unix)]
#[test]
fn a_save_keeps_permissions_and_links() {
    use std::os::unix::fs::PermissionsExt;
    let sandbox = Sandbox::new();
    let (path, link) = (sandbox.path("a.obj"), sandbox.path("link.obj"));
    set_mode(&path, 0o640);
    std::os::unix::fs::symlink("a.obj", &link).unwrap();
    sandbox.save(&link, Expect::Anything).unwrap();
    assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink());
    let mode = std::fs::metadata(&path).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o640);
    assert!(std::fs::read_to_string(&path).unwrap().contains("v 0 0 1"));
}

#[test]
fn positions_that_are_no_numbers_are_not_saved() {
    let mut sandbox = Sandbox::new();
    sandbox.moved.as_mut_slice()[1].x = f64::NAN;
    let path = sandbox.opened.path.clone();
    let error = sandbox.refused(&path, Expect::Anything).to_string();
    assert!(
        error.contains("vertex 1") && error.matches("a.obj").count() == 1,
        "{error}"
    );
}

#[test]
fn what_the_system_says_becomes_a_sentence() {
    let path = Path::new("folder/a.obj");
    for (kind, words) in [
        (ErrorKind::StorageFull, "disk is full"),
        (ErrorKind::QuotaExceeded, "disk is full"),
        (ErrorKind::PermissionDenied, "the folder folder"),
        (ErrorKind::ReadOnlyFilesystem, "the folder folder"),
        (ErrorKind::NotFound, "does not exist"),
        (ErrorKind::TimedOut, "timed out"),
    ] {
        let text = write_error(path, kind.into()).to_string();
        assert!(text.contains(words) && text.contains("a.obj"), "{text}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_the_old_file() {
    let Some(disk) = super::super::small_disk::small_disk() else {
        return;
    };
    let path = disk.path().join("a.obj");
    std::fs::write(&path, TRIANGLE).unwrap();
    let sandbox = Sandbox::new();
    let known = Expect::Unchanged(Fingerprint::of(&path).unwrap());
    disk.fill();
    let error = sandbox.save(&path, known).unwrap_err();
    assert!(matches!(error, SaveError::Full { .. }), "{error}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), TRIANGLE);
    let left = std::fs::read_dir(disk.path()).unwrap().count();
    assert_eq!(left, 2, "the mesh and what fills the disk");
}

#[test]
fn what_a_repair_parted_is_told_where_it_is_forgotten() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("bow.obj");
    let bow_tie = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3\nf 1 4 5\n";
    std::fs::write(&path, bow_tie).unwrap();
    let opened = open_repaired(&path).unwrap();
    assert_eq!(forgotten(Format::Stl, &opened.changes).len(), 1);
    assert!(forgotten(Format::Obj, &opened.changes).is_empty());
    let (document, processing) = (&opened.document, &opened.processing);
    let known = Expect::Unchanged(opened.fingerprint);
    save(document, processing, processing.positions(), &path, known).unwrap();
    assert!(open(&path).is_ok());
}
