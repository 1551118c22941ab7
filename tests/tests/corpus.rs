//! Runs the fuzz targets on their seeds, their corpus and all past findings.

use std::path::Path;

use cotan_tests::fuzzing::{TARGETS, seeds};

#[test]
fn seeds_pass_their_targets() {
    for (target, name, bytes) in seeds() {
        println!("{target}: {name}");
        cotan_tests::fuzzing::run(target, &bytes);
    }
}

/// Every seed passes every target: a file of one format is a broken file of the others.
#[test]
fn seeds_pass_the_other_targets() {
    for (_, name, bytes) in seeds() {
        for (target, body) in TARGETS {
            println!("{target}: {name}");
            body(&bytes);
        }
    }
}

#[test]
fn the_corpus_and_the_findings_pass() {
    for folder in ["corpus", "findings"] {
        for (target, body) in TARGETS {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("../fuzz")
                .join(folder)
                .join(target);
            let Ok(entries) = std::fs::read_dir(&folder) else {
                continue;
            };
            let mut files: Vec<_> = entries
                .map(|entry| entry.expect("readable").path())
                .collect();
            files.sort();
            for file in files {
                println!("{}", file.display());
                body(&std::fs::read(&file).expect("readable"));
            }
        }
    }
}
