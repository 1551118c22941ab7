//! Removal of temporary files when a signal ends the program.
//!
//! SIGHUP, SIGINT and SIGTERM then end the program as usual, so that a shell sees the usual
//! status. A signal that was ignored when the program started stays ignored, as `nohup` and
//! shells expect. On systems other than Unix this module does nothing.

/// Starts to wait for signals, on a separate thread.
///
/// # Errors
/// The error of the operating system. Signals then end the program immediately, and may leave a
/// temporary file.
pub fn remove_files_on_signals() -> std::io::Result<()> {
    #[cfg(unix)]
    unix::watch()?;
    Ok(())
}

#[cfg(unix)]
mod unix {
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    pub(super) fn watch() -> std::io::Result<()> {
        let ignored = ignored_signals();
        let is_ignored = |signal: i32| ignored >> (signal - 1) & 1 == 1;
        let mut signals = [SIGHUP, SIGINT, SIGTERM].to_vec();
        signals.retain(|&signal| !is_ignored(signal));
        let mut signals = Signals::new(signals)?;
        let wait = move || {
            if let Some(signal) = signals.forever().next() {
                cotan_io::remove_unfinished();
                let _ = signal_hook::low_level::emulate_default_handler(signal);
                // The default action does not return for these signals.
                std::process::exit(128 + signal);
            }
        };
        let thread = std::thread::Builder::new().name("signals".to_owned());
        thread.spawn(wait)?;
        // Exceeding the file size limit must be a write error, and not end the program.
        signal_hook::flag::register(
            signal_hook::consts::SIGXFSZ,
            Arc::new(AtomicBool::new(false)),
        )?;
        Ok(())
    }

    /// One bit per signal, starting with signal 1; zero if the system does not provide this
    /// without unsafe code.
    fn ignored_signals() -> u64 {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
            .unwrap_or(0)
    }
}

#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]
mod tests {
    use std::ffi::OsStr;
    use std::io::Write;
    use std::os::unix::process::ExitStatusExt;
    use std::path::Path;
    use std::process::{Child, Command, ExitStatus};
    use std::time::{Duration, Instant};

    use cotan_io::{Access, Unfinished};

    /// The variable that names the folder of the process below.
    const FOLDER: &str = "COTAN_TEST_INTERRUPT_FOLDER";

    /// The process that the tests send signals to: it is in the middle of writing a file. Without
    /// the variable it does nothing.
    #[test]
    fn writer() {
        let Some(folder) = std::env::var_os(FOLDER) else {
            return;
        };
        let folder = Path::new(&folder);
        super::remove_files_on_signals().unwrap();
        let (prefix, suffix) = (OsStr::new(".cotan-"), OsStr::new(""));
        let mut file = Unfinished::create(folder, prefix, suffix, Access::Private).unwrap();
        file.file_mut().write_all(b"half of a mesh").unwrap();
        std::fs::write(folder.join("ready"), "").unwrap();
        std::thread::sleep(PATIENCE);
    }

    const PATIENCE: Duration = Duration::from_secs(60);

    /// Starts the writer through a shell that first runs `before`, and waits until it is writing.
    fn start(folder: &Path, before: &str) -> Child {
        let script = format!("{before} exec \"$0\" --exact interrupt::tests::writer --nocapture");
        let writer = Command::new("sh")
            .args(["-c", &script])
            .arg(std::env::current_exe().unwrap())
            .env(FOLDER, folder)
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        wait_for("the writer", || folder.join("ready").exists());
        assert_eq!(num_unfinished(folder), 1);
        writer
    }

    fn wait_for(what: &str, mut is_there: impl FnMut() -> bool) {
        let start = Instant::now();
        while !is_there() {
            assert!(start.elapsed() < PATIENCE, "no sign of {what}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn num_unfinished(folder: &Path) -> usize {
        let entries = std::fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name());
        entries
            .filter(|name| name.as_encoded_bytes().starts_with(b".cotan-"))
            .count()
    }

    fn send(child: &Child, signal: &str) {
        let sent = Command::new("kill")
            .args(["-s", signal, &child.id().to_string()])
            .status();
        assert!(sent.unwrap().success());
    }

    fn end_of(mut child: Child) -> ExitStatus {
        let mut status = None;
        wait_for("the end", || {
            status = child.try_wait().unwrap();
            status.is_some()
        });
        status.unwrap()
    }

    #[test]
    fn a_signal_ends_the_process_as_usual_and_leaves_no_temporary_file() {
        for (name, number) in [("HUP", 1), ("INT", 2), ("TERM", 15)] {
            let folder = tempfile::tempdir().unwrap();
            let child = start(folder.path(), "");
            send(&child, name);
            assert_eq!(end_of(child).signal(), Some(number), "{name}");
            assert_eq!(num_unfinished(folder.path()), 0, "{name}");
        }
    }

    #[test]
    fn a_signal_that_is_ignored_stays_ignored() {
        if !Path::new("/proc/self/status").exists() {
            cotan_testing::skip("this system does not show which signals are ignored");
            return;
        }
        let folder = tempfile::tempdir().unwrap();
        let child = start(folder.path(), "trap '' HUP INT;");
        send(&child, "HUP");
        send(&child, "INT");
        send(&child, "TERM");
        assert_eq!(end_of(child).signal(), Some(15));
        assert_eq!(num_unfinished(folder.path()), 0);
    }
}
