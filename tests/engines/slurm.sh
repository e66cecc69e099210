#!/bin/bash
# Tries `metrolux job slurm` on a real Slurm: a cluster of this one machine on loopback, with its own munge, made for the
# trial and ended with it. Runs where munged, slurmctld and slurmd are installed (Debian: slurm-wlm, munge) and says so where
# not. Takes some two minutes. METROLUX names the program.
set -euo pipefail
export LC_ALL=C
cd -- "$(dirname -- "$0")/../.."
metrolux=$(realpath -- "${METROLUX:-target/release/metrolux}")
export PATH=$PATH:/usr/sbin:/sbin
for tool in munged slurmctld slurmd sbatch; do
    command -v "$tool" >/dev/null || { echo "skipped: no $tool here (Debian: slurm-wlm, munge)"; exit 0; }
done
[ "$(id -u)" -eq 0 ] || { echo 'skipped: slurmd starts jobs only as root'; exit 0; }
[ -x "$metrolux" ] || { echo "no $metrolux: build it first"; exit 1; }

work=$(mktemp -d)
services=()
finish() {
    code=$?
    scancel --user=root 2>/dev/null || true
    for ((i = ${#services[@]} - 1; i >= 0; i--)); do
        kill "${services[i]}" 2>/dev/null && wait "${services[i]}" 2>/dev/null || true
    done
    [ "$code" -eq 0 ] && rm -rf -- "$work" || echo "failed; everything is left in $work"
    exit "$code"
}
trap finish EXIT
say() { printf '== %3d s  %s\n' "$SECONDS" "$*"; }
fail() { echo "FAILED: $*"; exit 1; }
# Waits until a command succeeds.
until_() {
    local what=$1 end=$((SECONDS + 180))
    shift
    until "$@" >/dev/null 2>&1; do
        [ "$SECONDS" -lt "$end" ] || fail "waited in vain for $what"
        sleep 0.1
    done
}

# A job that is requeued waits for as long as credentials last, 120 s by default.
say 'a cluster of one node, two cores, a partition that others preempt'
host=$(hostname -s)
mkdir -p "$work"/{state,spool,munge}
chmod 700 "$work/munge"
dd if=/dev/urandom bs=1 count=1024 of="$work/munge/key" status=none
chmod 400 "$work/munge/key"
munged --foreground --force --socket="$work/munge/socket" --key-file="$work/munge/key" --num-threads=2 \
    --pid-file="$work/munge/pid" --log-file="$work/munge/log" --seed-file="$work/munge/seed" >/dev/null 2>&1 &
services+=($!)
cat >"$work/slurm.conf" <<END
ClusterName=trial
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmctldPort=16817
SlurmdPort=16818
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket,cred_expire=5
CredType=cred/munge
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
ReturnToService=2
SchedulerParameters=defer,sched_interval=2,bf_interval=2
KillWait=20
MessageTimeout=30
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=low Nodes=$host PriorityTier=1 PreemptMode=REQUEUE Default=YES MaxTime=INFINITE
PartitionName=high Nodes=$host PriorityTier=10 PreemptMode=OFF MaxTime=INFINITE
END
export SLURM_CONF=$work/slurm.conf
until_ munge test -S "$work/munge/socket"
slurmctld -D -f "$SLURM_CONF" >"$work/slurmctld.log" 2>&1 &
services+=($!)
slurmd -D -f "$SLURM_CONF" >"$work/slurmd.log" 2>&1 &
services+=($!)
until_ 'an idle node' sh -c 'sinfo -h -o %T | grep -q idle'

# A path that has to be quoted, a render of some ten seconds a part.
dir="$work/it's a \"job\" \$HOME"
options=(--resolution 96x96 --rounds "${ROUNDS:-3000}")
scene=scenes/cornell-glass/cornell-glass.pbrt
say 'the same render on one machine'
"$metrolux" render "$scene" "${options[@]}" --quiet -o "$work/whole.exr"

say 'five parts in an array of two at a time'
"$metrolux" job slurm "$scene" -o image.exr --shards 5 --cpus 1 --every 500ms --dir "$dir" -- "${options[@]}" >"$work/job.sh"
bash -n "$work/job.sh"
bash "$work/job.sh" --partition=low | tee "$work/handed-in"
array=$(grep -o 'parts: job [0-9]*' "$work/handed-in" | grep -o '[0-9]*')
merge=$(grep -o 'merge: job [0-9]*' "$work/handed-in" | grep -o '[0-9]*')
log() { cat "$dir/part.$1.log" 2>/dev/null; }
restarts() { scontrol show job "${array}_$1" | grep -o 'Restarts=[0-9]*' | grep -o '[0-9]*'; }
# The render of a part, not its shell.
render_of() { pgrep -f "^$metrolux render .*--shard $1/5 "; }
running() { render_of "$1" && [ -e "$dir/part.$1.run" ]; }
began_again() { [ "$(restarts "$1")" -ge "$2" ] && running "$1"; }

until_ 'part 1' running 1
say 'part 1: its render is killed with -9'
kill -9 "$(render_of 1)"
until_ 'another run' grep -q 'was killed (exit code 137)' "$dir/part.1.log"
until_ 'part 2' running 2
say 'part 2: its render gets TERM from somebody'
kill -TERM "$(render_of 2)"
until_ 'another run' grep -q 'stopped with a checkpoint and goes on' "$dir/part.2.log"
until_ 'parts that run' sh -c "[ \$(squeue -h -t running -j $array -o %i | wc -l) -eq 2 ]"

say 'all that run are preempted by a job of a higher partition'
urgent=$(sbatch --parsable --partition=high --ntasks=2 --output=/dev/null --wrap='sleep 2')
until_ 'the urgent job' sh -c "! squeue -h -j $urgent -o %i | grep -q ."
until_ 'parts that run again' sh -c "[ \$(squeue -h -t running -j $array -o %i | wc -l) -ge 1 ]"
now=$(squeue -h -t running -j "$array" -o %K | head -1)
until_ "part $now's checkpoint" running "$now"
say "part $now: scontrol requeue"
before=$(restarts "$now")
scontrol requeue "${array}_$now"
until_ 'another run' began_again "$now" $((before + 1))
say "part $now: the time limit is near (the signal that announces it)"
scancel --batch --signal=USR1 "${array}_$now"
until_ 'another run' began_again "$now" $((before + 2))

say 'all parts done, and the merge after them'
until_ 'the image' test -s "$dir/image.exr"
until_ 'the end' sh -c "! squeue -h -j $merge -o %i | grep -q ."
"$metrolux" compare "$dir/image.exr" "$work/whole.exr" --max-relmse 0 >/dev/null || fail 'the image is another one'
ls -1 "$dir" | tr '\n' ' '; echo
for k in 1 2 3 4 5; do echo "part $k was run $(($(restarts "$k") + 1)) times"; done
say 'the image of five parts is that of one machine, bit for bit'

say 'a part that cannot succeed: its failure ends the job, the merge is never begun'
cp "$scene" "$work/gone.pbrt"
"$metrolux" job slurm "$work/gone.pbrt" --shards 2 --cpus 1 --dir "$work/gone.job" -- "${options[@]}" >"$work/gone.sh"
rm "$work/gone.pbrt"
bash "$work/gone.sh" >"$work/handed-in"
array=$(grep -o 'parts: job [0-9]*' "$work/handed-in" | grep -o '[0-9]*')
merge=$(grep -o 'merge: job [0-9]*' "$work/handed-in" | grep -o '[0-9]*')
until_ 'the failure' sh -c "scontrol show job $merge | grep -q JobState=CANCELLED"
scontrol show job "${array}_1" | grep -q 'JobState=FAILED' || fail 'part 1 did not fail'
scontrol show job "${array}_1" | grep -q 'ExitCode=2:0' || fail 'part 1 failed otherwise'

say 'a job that is cancelled stays cancelled'
"$metrolux" job slurm "$scene" --shards 2 --cpus 1 --dir "$work/cancelled" -- "${options[@]}" >"$work/cancel.sh"
bash "$work/cancel.sh" >"$work/handed-in"
array=$(grep -o 'parts: job [0-9]*' "$work/handed-in" | grep -o '[0-9]*')
dir=$work/cancelled
until_ 'a checkpoint or a log' sh -c "squeue -h -t running -j $array -o %i | grep -q ."
until_ "the render" pgrep -f "^$metrolux render .*--shard 1/2 "
scancel "$array"
until_ 'the end' sh -c "! squeue -h -j $array -o %i | grep -q ."
sleep 2
[ -z "$(squeue -h -o %i)" ] || fail 'something was requeued'
say 'done'
