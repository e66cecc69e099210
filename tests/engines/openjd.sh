#!/bin/bash
# Tries `metrolux job openjd` with the command-line runner of Open Job Description (PyPI: openjd-cli), which runs a job on
# this machine. Runs where `openjd` is installed and says so where not. Takes about a minute. METROLUX names the program.
set -euo pipefail
export LC_ALL=C
cd -- "$(dirname -- "$0")/../.."
metrolux=$(realpath -- "${METROLUX:-target/release/metrolux}")
command -v openjd >/dev/null || { echo 'skipped: no openjd here (PyPI: openjd-cli)'; exit 0; }
[ -x "$metrolux" ] || { echo "no $metrolux: build it first"; exit 1; }

work=$(mktemp -d)
finish() {
    code=$?
    [ "$code" -eq 0 ] && rm -rf -- "$work" || echo "failed; everything is left in $work"
    exit "$code"
}
trap finish EXIT
say() { printf '== %3d s  %s\n' "$SECONDS" "$*"; }
fail() { echo "FAILED: $*"; exit 1; }

dir="$work/it's a \"job\" \$HOME {{x}}"
options=(--resolution 96x96 --rounds "${ROUNDS:-3000}")
cp scenes/cornell-glass/cornell-glass.pbrt "$work/scene.pbrt"
make_template() {
    "$metrolux" job openjd "$work/scene.pbrt" -o image.exr --shards 3 --cpus 1 --every 500ms --dir "$dir" "$@" -- "${options[@]}"
}
say 'the same render on one machine'
"$metrolux" render "$work/scene.pbrt" "${options[@]}" --quiet -o "$work/whole.exr"

make_template >"$work/template.yaml"
make_template --time 3s >"$work/hurried.yaml"
openjd check "$work/template.yaml"
openjd summary "$work/template.yaml"

say 'a task that fails: no scene'
mv "$work/scene.pbrt" "$work/elsewhere.pbrt"
if openjd run "$work/template.yaml" >"$work/log" 2>&1; then fail 'it did not fail'; fi
grep -q 'exited with code: 2' "$work/log" || fail 'it failed otherwise'
grep 'error: ' "$work/log"
[ ! -e "$dir/image.exr" ] || fail 'the merge was begun'
mv "$work/elsewhere.pbrt" "$work/scene.pbrt"

say 'a task whose time is over writes its checkpoint; run again, it goes on from there'
runs=0
until openjd run "$work/hurried.yaml" --step Part -tp K=1 >"$work/log" 2>&1; do
    runs=$((runs + 1))
    grep -q 'TIMEOUT' "$work/log" || fail 'it was not the time'
    grep -q 'exited with code: 75' "$work/log" || fail 'the render did not stop in good order'
    [ "$runs" -lt 60 ] || fail 'it does not get on'
done
[ "$runs" -gt 0 ] || fail 'no time was over'
echo "part 1 was stopped $runs times"

say 'the job'
openjd run "$work/template.yaml" >"$work/log" 2>&1 || { tail -40 "$work/log"; fail 'the job'; }
grep -q 'openjd_progress: 100.0' "$work/log" || fail 'nothing was heard of its progress'
"$metrolux" compare "$dir/image.exr" "$work/whole.exr" --max-relmse 0 >/dev/null || fail 'the image is another one'
ls -1 "$dir" | tr '\n' ' '; echo
say 'the image of three parts is that of one machine, bit for bit'
