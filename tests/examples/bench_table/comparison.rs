//! The rounds on one mesh: our runs and the others alternate, A B A B.

use std::error::Error;
use std::path::Path;
use std::process::Command;

use crate::job::Jobs;
use crate::measured::Results;
use crate::options::Options;
use crate::ours;
use crate::peers::{Peer, Peers, line_of};

/// Iterations of libigl's default job.
pub(crate) const PEER_ITERATIONS: usize = 10;

pub(crate) fn run(
    jobs: &Jobs,
    peers: &Peers,
    options: &Options,
) -> Result<Results, Box<dyn Error>> {
    let mut results = Results::new(jobs.num_vertices);
    for round in 1..=options.rounds {
        eprintln!(
            "{} vertices: round {round} of {}",
            jobs.num_vertices, options.rounds
        );
        for &threads in &options.threads {
            for (handles, job) in [("points", &jobs.points), ("regions", &jobs.regions)] {
                for method in ours::ORIENTATIONS.into_iter().chain([ours::THIN]) {
                    let name = ours_name(handles, method, threads);
                    if let Some(line) = run_ours(job, method, threads) {
                        results.push(&name, line);
                    }
                }
            }
        }
        run_peers(jobs, peers, &mut results);
    }
    Ok(results)
}

pub(crate) fn ours_name(handles: &str, method: &str, threads: usize) -> String {
    format!("cotan {handles} {method} {threads}")
}

pub(crate) fn run_ours(job: &Path, kind: &str, threads: usize) -> Option<serde_json::Value> {
    let program = std::env::current_exe().ok()?;
    let mut command = Command::new(program);
    command.env("RAYON_NUM_THREADS", threads.to_string());
    line_of(
        command.args([ours::MODE.as_ref(), job.as_os_str(), kind.as_ref()]),
        kind,
    )
}

fn run_peers(jobs: &Jobs, peers: &Peers, results: &mut Results) {
    let paths = [("points", &jobs.points), ("regions", &jobs.regions)];
    if peers.has(Peer::Cholmod) {
        let job = jobs.points.to_string_lossy();
        for matrix in ["L", "AtA"] {
            for ordering in ["amd", "metis"] {
                if let Some(line) = peers.run(Peer::Cholmod, &[&job, matrix, ordering, "1"]) {
                    results.push(&format!("CHOLMOD {matrix} {ordering}"), line);
                }
            }
        }
    }
    let iterations = PEER_ITERATIONS.to_string();
    for (handles, job) in paths {
        let job = job.to_string_lossy();
        for (peer, name) in [(Peer::Libigl, "libigl"), (Peer::Cgal, "CGAL")] {
            if !peers.has(peer) {
                continue;
            }
            if let Some(line) = peers.run(peer, &[&job, "1", &iterations]) {
                results.push(&format!("{name} {handles}"), line);
            }
        }
    }
    if peers.has(Peer::Potpourri3d)
        && let Some(line) = peers.run(Peer::Potpourri3d, &[&jobs.points.to_string_lossy(), "1"])
    {
        results.push("potpourri3d", line);
    }
}
