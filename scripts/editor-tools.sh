#!/usr/bin/env bash
# Installs what the tests of the editor's window need, where Debian's apt-get is there and may be
# used: an X server without a screen, a tool that moves its pointer, and a software OpenGL.
#
#   scripts/editor-tools.sh
set -euo pipefail

packages=(
    xvfb xdotool imagemagick libgl1 libgl1-mesa-dri libegl1
    libx11-6 libx11-xcb1 libxcursor1 libxi6 libxrandr2 libxkbcommon0 libxkbcommon-x11-0
)

missing=()
for package in "${packages[@]}"; do
    status=$(dpkg-query --show --showformat='${db:Status-Status}' "$package" 2>/dev/null || true)
    [ "$status" = installed ] || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
    echo "everything is there"
    exit 0
fi

if ! command -v apt-get >/dev/null 2>&1; then
    echo "this is no Debian: install what it calls ${missing[*]} by your system's own means" >&2
    exit 1
fi
run=()
if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null 2>&1; then
        echo "run as root: apt-get install ${missing[*]}" >&2
        exit 1
    fi
    run=(sudo --non-interactive)
fi
"${run[@]}" apt-get update -qq
"${run[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -qq --no-install-recommends "${missing[@]}"
