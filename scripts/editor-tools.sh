#!/usr/bin/env bash
# Installs the tools for the tests of the editor's window with apt-get, if it is available and
# permitted: a virtual X server, a tool that moves its pointer, and a software OpenGL.
#
#   scripts/editor-tools.sh
set -euo pipefail

packages=(
    xvfb xdotool libgl1 libgl1-mesa-dri libegl1
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

install() {
    if ! command -v apt-get >/dev/null 2>&1; then
        echo "there is no apt-get here" >&2
        return 1
    fi
    local run=()
    if [ "$(id -u)" -ne 0 ]; then
        run=(sudo --non-interactive)
    fi
    "${run[@]}" apt-get update -qq &&
        "${run[@]}" env DEBIAN_FRONTEND=noninteractive \
            apt-get install -qq --no-install-recommends "${missing[@]}"
}

if install; then
    exit 0
fi
echo "not installed: what Debian calls ${missing[*]}" >&2
# Other systems name the packages differently. The tests look for these two programs.
command -v Xvfb >/dev/null 2>&1 && command -v xdotool >/dev/null 2>&1
