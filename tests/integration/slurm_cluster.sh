#!/usr/bin/env bash
# A Slurm cluster of one node on the loopback interface, all of its state in one folder. Daemons run as the caller.
# Usage: slurm_cluster.sh start|stop|stop-node|start-node FOLDER
# After start: SLURM_CONF=FOLDER/slurm.conf sbatch ...
set -euo pipefail
PATH=$PATH:/usr/sbin
action=$1
folder=$(cd "$2" && pwd)

free_port() {
  python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'
}

configure() {
  local host user
  host=$(hostname -s)
  user=$(id -un)
  mkdir -p "$folder"/{munge,state,spool,log}
  chmod 700 "$folder/munge"
  dd if=/dev/urandom of="$folder/munge/key" bs=1024 count=1 status=none
  chmod 400 "$folder/munge/key"
  cat >"$folder/slurm.conf" <<CONF
ClusterName=loopback
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$folder/munge/socket
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/log/slurmctld.log
SlurmdLogFile=$folder/log/slurmd.log
SlurmctldTimeout=10
SlurmdTimeout=10
SchedulerParameters=sched_interval=2,bf_interval=2,batch_sched_delay=0
ReturnToService=2
MaxArraySize=${SLURM_TEST_MAX_ARRAY:-1001}
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 RealMemory=2000 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
}

start_node() { slurmd -f "$folder/slurm.conf"; }

stop_daemon() {
  local pid
  pid=$(cat "$folder/$1" 2>/dev/null) || return 0
  kill "$pid" 2>/dev/null || return 0
  for _ in {1..50}; do
    kill -0 "$pid" 2>/dev/null || return 0
    sleep 0.1
  done
  kill -9 "$pid" 2>/dev/null || true
}

export SLURM_CONF=$folder/slurm.conf
case $action in
  start)
    configure
    munged --force --key-file="$folder/munge/key" --socket="$folder/munge/socket" --pid-file="$folder/munge/pid" \
      --log-file="$folder/munge/log" --seed-file="$folder/munge/seed"
    slurmctld -c -f "$folder/slurm.conf"
    start_node
    for _ in {1..300}; do
      [[ $(sinfo -h -o %T 2>/dev/null) != idle ]] || exit 0
      sleep 0.1
    done
    echo "slurm_cluster: the node does not come up" >&2
    tail -n 20 "$folder"/log/*.log >&2
    exit 1
    ;;
  stop)
    stop_daemon slurmd.pid
    stop_daemon slurmctld.pid
    stop_daemon munge/pid
    ;;
  stop-node) stop_daemon slurmd.pid ;;
  start-node) start_node ;;
  *)
    echo "slurm_cluster: start, stop, stop-node or start-node" >&2
    exit 2
    ;;
esac
