#!/usr/bin/env bash
# Makes the pictures of the editor in docs/pictures anew, or those in another folder:
#
#   scripts/editor-pictures.sh [FOLDER]
#
# Real events move the pointer of the real program on a display without a screen. Needs what
# scripts/editor-tools.sh installs.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

cargo build --release -p cotan-editor --bins --example pictures
cargo run --quiet --release -p cotan-editor --example pictures -- "${1:-docs/pictures}"
