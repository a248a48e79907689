#!/bin/sh
# Runs a command against a private Slurm instance on this machine: own munge key and socket, own ports on the loopback,
# no cgroups, all files in its own folder. Returns the command's status after removing all of it.
#   private_slurm.sh COMMAND...          (77: Slurm or munge is not installed; 124: no result within two minutes)
set -eu
PATH=$PATH:/usr/sbin:/sbin
for program in munged slurmctld slurmd sbatch squeue sinfo; do
  command -v $program >/dev/null || { echo "private_slurm: $program is not installed"; exit 77; }
done
folder=$(mktemp -d /tmp/slurm.XXXXXX)  # a short path: socket names are limited to 108 characters
mkdir -p "$folder/state" "$folder/spool" "$folder/munge"
chmod 0700 "$folder/munge"
# Ports that are rarely used otherwise, a different pair for each run.
port=$((20000 + $$ % 10000 * 2))
user=$(id -un)
host=$(hostname -s 2>/dev/null || uname -n)
dd if=/dev/urandom of="$folder/munge/key" bs=1024 count=1 2>/dev/null
chmod 0600 "$folder/munge/key"

cat >"$folder/slurm.conf" <<END
ClusterName=swarmcert-test
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$folder/munge/socket
CredType=cred/munge
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=batch_sched_delay=0,sched_interval=1
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
JobCompType=jobcomp/none
ReturnToService=2
MinJobAge=300
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 Sockets=1 CoresPerSocket=2 ThreadsPerCore=1 RealMemory=100 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=10 State=UP
END
export SLURM_CONF="$folder/slurm.conf"

stop() {
  for daemon in slurmd slurmctld munge; do
    pid=$(cat "$folder/$daemon.pid" 2>/dev/null || true)
    [ -z "$pid" ] || kill "$pid" 2>/dev/null || true
    tries=0
    while [ -n "$pid" ] && [ -e "/proc/$pid/exe" ] && [ $tries -lt 50 ]; do
      tries=$((tries + 1))
      sleep 0.2
    done
  done
  rm -rf "$folder"
}
trap stop EXIT
trap 'exit 130' INT TERM
munged --force --socket="$folder/munge/socket" --key-file="$folder/munge/key" --pid-file="$folder/munge.pid" \
  --seed-file="$folder/munge/seed" --log-file="$folder/munge/log" --num-threads=2
slurmctld -f "$SLURM_CONF" -c
slurmd -f "$SLURM_CONF" -N "$host"
tries=0
until sinfo --noheader --format=%t 2>/dev/null | grep -q idle; do
  tries=$((tries + 1))
  [ $tries -lt 150 ] || { echo "private_slurm: the node did not come up"; tail -n 20 "$folder"/slurm*.log; exit 1; }
  sleep 0.2
done
status=0
timeout 120 "$@" || status=$?
[ $status -eq 0 ] || { squeue --long; tail -n 20 "$folder"/slurm*.log; }
exit $status
