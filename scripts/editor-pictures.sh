#!/usr/bin/env bash
# Regenerates the pictures of the editor in docs/pictures, or writes them to another folder:
#
#   scripts/editor-pictures.sh [FOLDER]
#
# Drives the real program with real pointer events on a virtual display. Requires the tools
# installed by scripts/editor-tools.sh.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

cargo build --release -p cotan-editor --bins --example pictures
cargo run --quiet --release -p cotan-editor --example pictures -- "${1:-docs/pictures}"
