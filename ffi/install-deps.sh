#!/bin/sh
# Installs the Debian packages metrolux is built with, if any is missing. Safe to run again and again.
set -eu

# Embree and its header; libclang, with which bindgen reads that header; a C compiler; what finds libraries.
packages='libembree-dev libclang-dev clang build-essential pkg-config'

missing=
for p in $packages; do
    status=$(dpkg-query -W -f='${Status}' "$p" 2>/dev/null || true)
    [ "$status" = 'install ok installed' ] || missing="$missing $p"
done
[ -n "$missing" ] || exit 0

cannot() {
    echo "metrolux needs the Debian packages$missing, and $1." >&2
    exit 1
}

command -v apt-get >/dev/null 2>&1 || cannot 'there is no apt-get here to install them'
if [ "$(id -u)" -eq 0 ]; then
    sudo=
elif command -v sudo >/dev/null 2>&1; then
    sudo=sudo
else
    cannot 'installing them takes root or sudo'
fi

echo "installing:$missing" >&2
$sudo apt-get update -q >&2 || cannot 'apt-get update failed'
# $missing is a list of words.
# shellcheck disable=SC2086
$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -qy --no-install-recommends $missing >&2 ||
    cannot 'apt-get could not install them'
