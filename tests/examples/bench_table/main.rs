//! Our speed compared with that of others, as ratios, measured in one run on one machine.
//!
//! ```text
//! cargo run --release -p cotan-tests --example bench_table -- [OPTIONS]
//!   --sizes N,N…      vertices of the meshes to compare on (default 14000,100000)
//!   --growth N,N…     vertices of the meshes for growth exponents (default none)
//!   --threads N,N…    thread counts of ours (default 1,2); the others run on one
//!   --rounds K        rounds of A B A B, whose medians count (default 3)
//!   --numbering WORD  random (default) or natural
//!   --peers DIR       where benches/peers/Makefile put the programs (default benches/peers/build)
//!   --python PROGRAM  a Python that has igl and potpourri3d (default python3)
//!   --json FILE       everything that was measured, too
//! ```
//!
//! Missing peers are skipped with a message. Everything runs in separate processes, so that none
//! inherits another's memory. To install the peers, see `benches/peers/README.md`.

mod comparison;
mod faer_peer;
mod growth;
mod job;
mod measured;
mod options;
mod ours;
mod peers;
mod table;

use std::error::Error;
use std::path::Path;

use options::Options;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    // This program is also its own child process.
    if let [mode, job, kind] = &words[..]
        && mode == ours::MODE
    {
        return ours::run(Path::new(job), kind);
    }
    let options = Options::parse(&words)?;
    let folder = tempfile::tempdir()?;
    let peers = peers::Peers::find(&options);
    peers.print();
    let mut everything = Vec::new();
    for &size in &options.sizes {
        let jobs = job::Jobs::write(folder.path(), size, options.numbering)?;
        let results = comparison::run(&jobs, &peers, &options)?;
        for &threads in &options.threads {
            print!("{}", table::of_size(&results, threads));
        }
        everything.extend(results.into_lines());
    }
    if !options.growth.is_empty() {
        let results = growth::run(folder.path(), &options)?;
        print!("{}", growth::table(&results));
        everything.extend(results.into_lines());
    }
    if let Some(path) = &options.json {
        std::fs::write(path, everything.join("\n") + "\n")?;
    }
    Ok(())
}
