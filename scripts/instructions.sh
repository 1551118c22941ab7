#!/usr/bin/env bash
# Counts the instructions of the kernels with callgrind: `scripts/instructions.sh [OPTION...]`.
#
# Compares with the last run on this machine, or with another one by means of
# `--save-baseline=NAME` and `--baseline=NAME`. Requires valgrind (Debian: valgrind) and the runner
# (`cargo install --locked --version 0.20.0 gungraun-runner`). If either is missing, the script is
# skipped with exit code 0.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

for program in valgrind gungraun-runner; do
    if ! command -v "$program" >/dev/null; then
        echo "skipped: $program is not installed (see scripts/instructions.sh)"
        exit 0
    fi
done
cargo bench --manifest-path benches/instructions/Cargo.toml --bench kernels -- "$@"
