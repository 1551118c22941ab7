#!/usr/bin/env bash
# Draws the pictures of docs/decisions/2026-11-30-solid-bodies.md: the thin shell, the solid body
# and the elastic body of six edits, coloured by the distance from the elastic body:
# `scripts/solid-pictures.sh`.
#
# The edits are other people's data, looked for in ../shared/reference/solid. Without them the
# script is skipped with exit code 0.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

edits=../shared/reference/solid
pictures=docs/decisions/pictures
if ! [ -d "$edits" ]; then
    echo "skipped: no folder $edits"
    exit 0
fi
cargo build --release -p cotan-cli --bin cotan
cotan="${CARGO_TARGET_DIR:-target}/release/cotan"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir -p "$pictures"
for edit in d_igea20k_twist bar_twist150 cyl_bend135 cyl_stretch d_fandisk_bend d_spot_bend; do
    for stiffness in thin solid; do
        "$cotan" --quiet deform "$edits/$edit.rest.ply" --handles "$edits/$edit.handles.txt" \
            --stiffness "$stiffness" -o "$folder/$stiffness.ply"
    done
    cp "$edits/$edit.solid.ply" "$folder/elastic.ply"
    # Some of the meshes are inside out, which a picture shows in another colour.
    for shape in thin solid elastic; do
        "$cotan" --quiet repair --orient "$folder/$shape.ply" -o "$folder/$shape.out.ply"
    done
    "$cotan" --quiet compare "$folder/thin.out.ply" "$folder/solid.out.ply" \
        --distance-to "$folder/elastic.out.ply" --picture "$folder/picture.png" >"$folder/measures"
    name=solid-${edit#d_}
    python3 scripts/shrink_picture.py "$folder/picture.png" "$pictures/${name//_/-}.png"
done
