# The commands that one needs most; `just` lists them. https://just.systems

# List the commands.
default:
    @just --list

# Everything that must pass before a change lands.
ci:
    .ci/run

# Format the code, then the two quick checks.
check:
    cargo fmt --all
    cargo clippy --workspace --all-targets -- -D warnings

# Run the tests whose names contain FILTER, or all.
test FILTER="":
    cargo test --workspace {{FILTER}}

# Build the documentation without warnings and open it.
doc:
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --open

# Run the examples of the book and build it into target/book.
book *ARGS:
    scripts/book.sh {{ARGS}}

# Run the command line, as `just run demo`.
run *ARGS:
    cargo run --release -- {{ARGS}}

# Open the editor, on a mesh or on its sample.
edit *ARGS:
    cargo run --release -p cotan-editor -- {{ARGS}}

# Run an example of the library.
example NAME:
    cargo run -p cotan --example {{NAME}}

# Fuzz for SECONDS each: all targets, or those that are named.
fuzz SECONDS="15" *TARGETS:
    scripts/fuzz.sh {{SECONDS}} {{TARGETS}}

# Count the instructions of the kernels.
instructions *OPTIONS:
    scripts/instructions.sh {{OPTIONS}}

# Licences, advisories, duplicates, spelling.
lint:
    cargo deny check
    typos
