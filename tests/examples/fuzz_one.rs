//! Runs one fuzz target on files: `cargo run -p cotan-tests --example fuzz_one -- TARGET FILE...`.

fn main() -> std::io::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let target = arguments.next().unwrap_or_default();
    for file in arguments {
        println!("{file}");
        cotan_tests::fuzzing::run(&target, &std::fs::read(file)?);
    }
    Ok(())
}
