//! The script for Slurm. It hands itself in twice: as an array of parts, and as the merge that waits for them.
//!
//! How Slurm ends a run (22.05, as tests/engines/slurm.sh shows): scancel, preemption, `scontrol requeue` and a time
//! limit that is over send TERM to all processes of the job, shell and render alike, wait for KillWait seconds and kill.
//! `--signal=B:` sends its signal to the shell alone. So the shell passes on only what came to it alone, and asks for another
//! run only where Slurm itself has not decided about that.

use super::Farm;
use std::time::Duration;

/// Seconds before the time limit at which a part is asked for its checkpoint, at most.
const WARNING: u64 = 120;

/// How often a part whose process was killed is tried again.
const TRIES: u32 = 5;

/// A word of the shell that stands for this text, whatever is in it.
pub fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        return text.to_owned();
    }
    format!("'{}'", text.replace('\'', r"'\''"))
}

/// The script.
pub fn script(farm: &Farm) -> String {
    let Farm { parts, .. } = farm;
    let [metrolux, scene, dir, name] =
        [&farm.metrolux, &farm.scene, &farm.dir, &farm.name].map(|t| quoted(t));
    let words = |all: &[String]| all.iter().map(|w| quoted(w)).collect::<Vec<_>>().join(" ");
    let (options, merge) = (words(&farm.options), words(&farm.merge));
    let cpus = farm
        .cpus
        .map_or(String::new(), |n| format!(" --cpus-per-task={n}"));
    let time = farm
        .time
        .map_or(String::new(), |t| format!(" --time={}", limit(t)));
    let warning = farm
        .time
        .map_or(WARNING, |t| (t.as_secs() / 4).clamp(1, WARNING));
    let version = env!("CARGO_PKG_VERSION");
    format!(
        r#"#!/bin/bash
# A render in {parts} parts for Slurm, made by metrolux {version}:
#
#     bash job.sh [OPTIONS OF sbatch]
#
# Everything is kept in one folder: part.K with its checkpoint part.K.run and its log part.K.log, the images, stats.json,
# this script. What is there is gone on from: after a failure that has been mended, hand it in again.
set -u

metrolux={metrolux}
scene={scene}
dir={dir}
name={name}
parts={parts}

part() {{
    cd -- "$dir" || exit
    local k=$SLURM_ARRAY_TASK_ID child code heard told= ended=
    # To the shell alone: the time is nearly over. To every process of the job: Slurm ends it, and knows what comes then.
    trap 'heard=yes told=yes; kill -TERM "$child"' USR1
    trap 'heard=yes told=yes ended=yes' TERM
    "$metrolux" render "$scene" --shard "$k/$parts" -o "part.$k" --checkpoint "part.$k.run" --resume \
        --threads "${{SLURM_CPUS_PER_TASK:-$SLURM_CPUS_ON_NODE}}" {options} &
    child=$!
    # A signal cuts a wait short.
    while heard=; do
        wait "$child"
        code=$?
        [ -n "$heard" ] || break
    done
    # A shell may lose the exit code of a process that ends as it hears a signal: another run finds out.
    [ -z "$told" ] || case $code in -1 | 127) code=75 ;; esac
    if [ -z "$ended" ]; then
        if [ "$code" -eq 75 ]; then
            echo "part $k stopped with a checkpoint and goes on in another run"
            again
        elif [ "$code" -ge 128 ] && [ "${{SLURM_RESTART_COUNT:-0}}" -lt {TRIES} ]; then
            echo "part $k was killed (exit code $code) and goes on from its last checkpoint in another run"
            again
        fi
    fi
    exit "$code"
}}

again() {{
    scontrol requeue "${{SLURM_ARRAY_JOB_ID}}_$SLURM_ARRAY_TASK_ID" && sleep 60
}}

merge() {{
    cd -- "$dir" || exit
    local k files=()
    for ((k = 1; k <= parts; k++)); do files+=("part.$k"); done
    exec "$metrolux" merge "${{files[@]}}" {merge}
}}

hand_in() {{
    mkdir -p -- "$dir" || exit
    [ "$0" -ef "$dir/job.sh" ] || cp -- "$0" "$dir/job.sh" || exit
    local common=(--parsable --chdir="$dir"{cpus}{time} "$@") array sum
    array=$(sbatch --job-name="$name" --array="1-$parts" --requeue --signal=B:USR1@{warning} --open-mode=append \
        --output=part.%a.log "${{common[@]}}" "$dir/job.sh" part) || exit
    sum=$(sbatch --job-name="$name, merge" --dependency="afterok:${{array%%;*}}" --kill-on-invalid-dep=yes \
        --output=merge.log "${{common[@]}}" "$dir/job.sh" merge) || exit
    echo "parts: job ${{array%%;*}}, merge: job ${{sum%%;*}}, files: $dir"
}}

case ${{1-}} in
part | merge) "$1" ;;
*) hand_in "$@" ;;
esac
"#
    )
}

/// Hours, minutes and seconds.
fn limit(t: Duration) -> String {
    let s = t.as_secs_f64().ceil() as u64;
    format!("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    #[test]
    fn a_quoted_word_is_what_the_shell_reads() {
        for text in [
            "plain/path.pbrt",
            "",
            " ",
            "a b",
            "it's",
            "''",
            "$HOME",
            "`id`",
            "a;b&c|d",
            "*?[x]",
            "~root",
            "\\",
            "\"",
            "-n",
            "ü€",
            "#x",
            "!!",
            "{a,b}",
            "%a",
        ] {
            let script = format!("printf %s {}", quoted(text));
            let out = Command::new("bash").args(["-c", &script]).output();
            assert_eq!(
                String::from_utf8_lossy(&out.expect("bash runs").stdout),
                text
            );
        }
    }

    #[test]
    fn limits_are_written_as_slurm_reads_them() {
        let of = |s| limit(Duration::from_secs_f64(s));
        assert_eq!(of(59.5), "0:01:00");
        assert_eq!(of(100.0 * 3600.0 + 61.0), "100:01:01");
    }
}
