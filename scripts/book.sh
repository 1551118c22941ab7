#!/usr/bin/env bash
# Runs the shell examples of the book in docs/book, checks its links and pictures, and builds it:
#
#   scripts/book.sh [--update-pictures] [CHAPTER...]
#
# Every chapter of SUMMARY.md, or only those named (`recipes/files.md`), gets a scratch folder with
# the sample meshes in `models`. Its ```sh blocks run there in order; those marked `sh,ignore` are
# skipped, and a command that fails ends the script. The Rust examples are doc tests of the package
# cotan-tests.
#
# --update-pictures puts the pictures that the examples have drawn into docs/book/src/pictures,
# reduced to at most 60 KB (needs python3).
#
# COTAN names a built command line, COTAN_EXAMPLES the folder of the built examples;
# without both they are built for release. Development builds are 40 times slower. mdbook is
# installed if it is absent; where that fails, the last step is skipped.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
source=$root/docs/book/src
cd "$root"

update=no
chapters=()
for argument in "$@"; do
    case $argument in
        --update-pictures) update=yes ;;
        -*) echo "unknown option $argument; see the head of scripts/book.sh" >&2; exit 2 ;;
        *) chapters+=("$argument") ;;
    esac
done
all=no
if [ ${#chapters[@]} -eq 0 ]; then
    all=yes
    mapfile -t chapters < <(sed -n 's/.*](\([^)]*\.md\)).*/\1/p' "$source/SUMMARY.md")
fi

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# The programs that the examples call, alone in one folder on the PATH.
programs() {
    if [ -z "${COTAN:-}" ] || [ -z "${COTAN_EXAMPLES:-}" ]; then
        # In one call, so that no crate is built twice with different features.
        cargo build --release -p cotan -p cotan-cli -p cotan-tests --bin cotan --example pipeline \
            --example sample_meshes --example recipe_fading_bumps --example recipe_ripples \
            --example recipe_soft_joint
        local target
        target=$(cargo metadata --format-version 1 --no-deps |
            sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
        COTAN=${COTAN:-$target/release/cotan}
        COTAN_EXAMPLES=${COTAN_EXAMPLES:-$target/release/examples}
    fi
    mkdir "$scratch/bin"
    ln -s "$(realpath "$COTAN")" "$scratch/bin/cotan"
    local program
    for program in pipeline sample_meshes recipe_fading_bumps recipe_ripples recipe_soft_joint; do
        ln -s "$(realpath "$COTAN_EXAMPLES/$program")" "$scratch/bin/$program"
    done
    export PATH=$scratch/bin:$PATH
    sample_meshes "$scratch/models"
}

# The ```sh blocks of a chapter, each in a file named after its number and its first line.
extract() {
    awk -v folder="$2" '
        /^ *```/ {
            if (inside) { inside = 0; close(file); next }
            inside = 1
            file = "/dev/null"
            if ($0 ~ /^```sh *$/) file = sprintf("%s/%02d-line-%d", folder, ++count, NR + 1)
            next
        }
        inside { print > file }' "$1"
}

run_chapter() {
    local chapter=$1 folder=$scratch/chapters/${1%.md} start=$SECONDS block number
    mkdir -p "$folder" "$scratch/blocks/$chapter"
    extract "$source/$chapter" "$scratch/blocks/$chapter"
    number=$(find "$scratch/blocks/$chapter" -type f | wc -l)
    if [ "$number" -eq 0 ]; then
        return
    fi
    cp -r "$scratch/models" "$folder/models"
    for block in "$scratch/blocks/$chapter"/*; do
        if ! (cd "$folder" && bash -euo pipefail "$block" </dev/null >"$scratch/log" 2>&1); then
            tail -n 40 "$scratch/log"
            echo "FAILED: $chapter, block $(basename "$block"):"
            cat "$block"
            exit 1
        fi
    done
    echo "-- $chapter: $number blocks, $((SECONDS - start)) s"
}

# Every picture of a chapter is drawn by its own examples; those of the editor come from
# scripts/editor-pictures.sh.
check_pictures() {
    local chapter=$1 name drawn
    for name in $(grep -o 'pictures/[A-Za-z0-9_-]*\.png' "$source/$chapter" | sort -u); do
        name=${name#pictures/}
        drawn=$root/docs/pictures/$name
        if [ ! -f "$drawn" ]; then
            drawn=$(find "$scratch/chapters/${chapter%.md}" -name "$name" 2>/dev/null | head -n 1)
        fi
        if [ -z "$drawn" ]; then
            echo "FAILED: $chapter shows pictures/$name, which none of its examples draws"
            exit 1
        fi
        if [ "$update" = yes ]; then
            python3 scripts/shrink_picture.py "$drawn" "$source/pictures/$name"
        elif [ ! -f "$source/pictures/$name" ]; then
            echo "FAILED: $chapter shows pictures/$name, which is not there: run with --update-pictures"
            exit 1
        fi
    done
}

# Relative links lead to files; anchors are not checked, and pictures are checked elsewhere.
check_links() {
    local chapter=$1 target
    while read -r target; do
        target=${target%%#*}
        if [ -n "$target" ] && [ ! -e "$source/$(dirname "$chapter")/$target" ]; then
            echo "FAILED: $chapter links to $target, which is not there"
            exit 1
        fi
    done < <(grep -o '\](\([^)]*\))' "$source/$chapter" | sed 's/^](//; s/)$//' | grep -vE '^[a-z]+://|pictures/')
}

# Every chapter with Rust examples is one of the doc tests.
check_doc_tests() {
    local chapter=$1
    if grep -qE '^```rust(,no_run)? *$' "$source/$chapter" && ! grep -qF "\"$chapter\"" tests/book.rs; then
        echo "FAILED: the Rust examples of $chapter are not tested: add it to tests/book.rs"
        exit 1
    fi
}

# Every decision is a page of the book.
check_decisions() {
    local decision
    for decision in docs/decisions/*.md; do
        if ! grep -q "($decision)" "$source/SUMMARY.md" || [ ! -f "$source/$decision" ]; then
            echo "FAILED: $decision is no page of the book: add it to SUMMARY.md and to docs/book/src/docs/decisions"
            exit 1
        fi
    done
}

build() {
    if ! command -v mdbook >/dev/null && ! cargo install --locked mdbook; then
        echo "skipped: mdbook is not installed and cannot be; the book was not built"
        return
    fi
    mdbook build docs/book
}

for chapter in "${chapters[@]}"; do
    check_links "$chapter"
    check_doc_tests "$chapter"
done
check_decisions
programs
for chapter in "${chapters[@]}"; do
    run_chapter "$chapter"
    check_pictures "$chapter"
done
if [ "$all" = yes ]; then
    for picture in "$source"/pictures/*.png; do
        if ! grep -rqF --include='*.md' "pictures/$(basename "$picture")" "$source"; then
            echo "FAILED: pictures/$(basename "$picture") is shown by no chapter"
            exit 1
        fi
    done
fi
build
echo "-- book: done in $SECONDS s"
