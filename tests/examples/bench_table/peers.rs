//! The peers available on this machine, and their command lines.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::options::Options;

pub(crate) struct Peers {
    programs: PathBuf,
    scripts: PathBuf,
    python: String,
    found: Vec<(Peer, bool)>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Peer {
    Cholmod,
    Cgal,
    Libigl,
    Potpourri3d,
}

impl Peer {
    const ALL: [Self; 4] = [Self::Cholmod, Self::Cgal, Self::Libigl, Self::Potpourri3d];

    fn file(self) -> &'static str {
        match self {
            Self::Cholmod => "cholmod",
            Self::Cgal => "cgal_arap",
            Self::Libigl => "igl_arap.py",
            Self::Potpourri3d => "p3d_laplacian.py",
        }
    }

    fn module(self) -> Option<&'static str> {
        match self {
            Self::Cholmod | Self::Cgal => None,
            Self::Libigl => Some("igl"),
            Self::Potpourri3d => Some("potpourri3d"),
        }
    }
}

impl Peers {
    pub(crate) fn find(options: &Options) -> Self {
        let mut peers = Self {
            programs: options.peers.clone(),
            scripts: Path::new(env!("CARGO_MANIFEST_DIR")).join("../benches/peers"),
            python: options.python.clone(),
            found: vec![],
        };
        peers.found = Peer::ALL.map(|peer| (peer, peers.is_there(peer))).into();
        peers
    }

    fn is_there(&self, peer: Peer) -> bool {
        match peer.module() {
            None => self.programs.join(peer.file()).is_file(),
            Some(module) => Command::new(&self.python)
                .args(["-c", &format!("import numpy, {module}")])
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .status()
                .is_ok_and(|status| status.success()),
        }
    }

    pub(crate) fn has(&self, peer: Peer) -> bool {
        self.found.contains(&(peer, true))
    }

    pub(crate) fn print(&self) {
        for (peer, is_there) in &self.found {
            let file = peer.file();
            match is_there {
                true => println!("peer: {file}"),
                false => println!("skipped: {file} (see benches/peers/README.md)"),
            }
        }
        println!();
    }

    /// Runs a peer once. Returns its line, or `None`, with a message, if it fails.
    pub(crate) fn run(&self, peer: Peer, words: &[&str]) -> Option<Value> {
        let mut command = match peer.module() {
            None => Command::new(self.programs.join(peer.file())),
            Some(_) => {
                let mut command = Command::new(&self.python);
                command.arg(self.scripts.join(peer.file()));
                command
            }
        };
        // Debian's CHOLMOD uses OpenMP threads regardless of its settings, which would flatter us
        // by a factor of 1.75.
        for variable in [
            "OMP_THREAD_LIMIT",
            "OMP_NUM_THREADS",
            "OPENBLAS_NUM_THREADS",
            "IGL_NUM_THREADS",
        ] {
            command.env(variable, "1");
        }
        line_of(command.args(words), peer.file())
    }
}

/// The line of JSON that a child process prints.
pub(crate) fn line_of(command: &mut Command, name: &str) -> Option<Value> {
    let output = command.stdin(Stdio::null()).output();
    let line = match &output {
        Ok(output) if output.status.success() => {
            serde_json::from_slice(output.stdout.trim_ascii()).ok()
        }
        _ => None,
    };
    if line.is_none() {
        let message = match &output {
            Ok(output) => String::from_utf8_lossy(&output.stderr).into_owned(),
            Err(error) => error.to_string(),
        };
        eprintln!("failed: {name}: {}", message.trim());
    }
    line
}
