#!/usr/bin/env bash
# Runs the given fuzz targets, or all of them: `scripts/fuzz.sh SECONDS [TARGET...]`.
#
# Each target starts from fuzz/corpus, runs for SECONDS within 2 GB, and stops at its first
# finding, which is stored in fuzz/artifacts and makes the script fail at the end. New inputs go to
# fuzz/target/corpus, not to the corpus of the repository. Requires cargo-fuzz
# (`cargo install cargo-fuzz`). Uses a nightly compiler if there is one, and otherwise the stable
# one with RUSTC_BOOTSTRAP.
#
# SANITIZER=address also checks the memory accesses of dependencies, at half the speed.
# FUZZ_OPTIONS are passed to libFuzzer, for example `-seed=1 -runs=20000` for a reproducible run.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../fuzz"

seconds=${1:?usage: scripts/fuzz.sh SECONDS [TARGET...]}
shift
sanitizer=${SANITIZER:-none}
toolchain=()
if RUSTUP_AUTO_INSTALL=0 cargo +nightly --version >/dev/null 2>&1; then
    toolchain=(+nightly)
else
    export RUSTC_BOOTSTRAP=1
fi
targets=("$@")
if [ ${#targets[@]} -eq 0 ]; then
    mapfile -t targets < <(cargo "${toolchain[@]}" fuzz list)
fi
cargo "${toolchain[@]}" fuzz build --sanitizer "$sanitizer"
found=0
log=$(mktemp)
trap 'rm -f "$log"' EXIT
for target in "${targets[@]}"; do
    echo "-- $target"
    new=target/corpus/$target
    mkdir -p "$new" "corpus/$target"
    if ! cargo "${toolchain[@]}" fuzz run --sanitizer "$sanitizer" "$target" "$new" "corpus/$target" -- \
        ${FUZZ_OPTIONS:-} -max_total_time="$seconds" -rss_limit_mb=2048 -timeout=10 -print_final_stats=1 >"$log" 2>&1; then
        tail -n 60 "$log"
        found=1
    fi
    # Executions, and coverage as edges (cov) and features (ft).
    grep -E "DONE|number_of_executed|peak_rss" "$log" || true
done
exit "$found"
