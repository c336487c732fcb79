#!/usr/bin/env bash
# A SLURM cluster of one node on this machine, in a folder of its own, to run a command on; ends with the command.
#
#     tests/cluster/slurm.sh COMMAND [ARGUMENT ...]
#
# Needs slurmctld, slurmd, the SLURM commands and munge: apt-get install slurmctld slurmd slurm-client munge (Debian).
# Changes nothing outside of its folder, $SLURM_LOOPBACK (default: a new one in /tmp, deleted at the end), and starts no
# service of the machine. Works for root and for other users; then all jobs are those of that user. Status 77: not
# installed; 78: the daemons did not start (their logs are printed).
set -euo pipefail

PATH=$PATH:/usr/sbin:/sbin
for program in slurmctld slurmd sbatch munged mungekey; do
    command -v "$program" > /dev/null || { echo "slurm.sh: $program is not installed" >&2; exit 77; }
done

folder=${SLURM_LOOPBACK:-$(mktemp -d /tmp/slurm.XXXXXX)}
user=$(id -un)
cpus=$(getconf _NPROCESSORS_ONLN)
memory=$(awk '/MemTotal/ {print int($2 / 1024 * 0.9)}' /proc/meminfo)
host=$(hostname -s)
# Free ports, so that two clusters can run side by side.
read -r controller node < <(python3 -c '
import socket
sockets = [socket.socket() for _ in range(2)]
for each in sockets:
    each.bind(("", 0))
print(*(each.getsockname()[1] for each in sockets))')
mkdir -p "$folder"/{state,spool,munge,logs}
chmod 755 "$folder"
chmod 700 "$folder/munge"

pids=()
finish() {
    status=$?
    [ -z "${command:-}" ] || kill "$command" 2> /dev/null || true
    scancel --quiet --user="$user" 2> /dev/null || true
    for pid in "${pids[@]}"; do kill "$pid" 2> /dev/null || true; done
    for pid in "${pids[@]}"; do wait "$pid" 2> /dev/null || true; done
    [ -n "${SLURM_LOOPBACK:-}" ] || rm -rf "$folder"
    exit "$status"
}
trap finish EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

failed() {
    echo "slurm.sh: $1" >&2
    tail -n 20 "$folder"/logs/*.log >&2 || true
    exit 78
}

mungekey --create --keyfile="$folder/munge/key"
munged --foreground --force --key-file="$folder/munge/key" --socket="$folder/munge/socket" \
    --pid-file="$folder/munge/pid" --log-file="$folder/logs/munge.log" --seed-file="$folder/munge/seed" \
    > "$folder/logs/munged.out.log" 2>&1 &
pids+=($!)

cat > "$folder/slurm.conf" << CONF
ClusterName=loopback
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$controller
SlurmdPort=$node
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$folder/munge/socket
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/logs/slurmctld.log
SlurmdLogFile=$folder/logs/slurmd.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SchedulerParameters=batch_sched_delay=0,sched_interval=2
MpiDefault=none
ReturnToService=2
KillWait=5
MinJobAge=600
NodeName=$host NodeAddr=127.0.0.1 CPUs=$cpus RealMemory=$memory State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP OverSubscribe=NO
CONF
export SLURM_CONF=$folder/slurm.conf

# Snakemake drops the variables of SLURM within a job, so the commands find the cluster by themselves.
mkdir -p "$folder/bin"
for program in sbatch srun squeue scancel sinfo scontrol sacct sstat; do
    path=$(command -v "$program") || continue
    printf '#!/bin/sh\nSLURM_CONF=%s exec %s "$@"\n' "$SLURM_CONF" "$path" > "$folder/bin/$program"
    chmod +x "$folder/bin/$program"
done
export PATH=$folder/bin:$PATH

slurmctld -D -c > "$folder/logs/slurmctld.out.log" 2>&1 &
pids+=($!)
slurmd -D -N "$host" > "$folder/logs/slurmd.out.log" 2>&1 &
pids+=($!)

for _ in $(seq 60); do
    [ "$(sinfo --noheader --format=%T 2> /dev/null | head -n 1)" = idle ] && break
    for pid in "${pids[@]}"; do kill -0 "$pid" 2> /dev/null || failed "a daemon ended"; done
    sleep 0.5
done
[ "$(sinfo --noheader --format=%T | head -n 1)" = idle ] || failed "the node did not come up"

"$@" &
command=$!
wait "$command"
