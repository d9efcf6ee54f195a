#!/usr/bin/env bash
# Times `polestar convert` and OpenVDB's vdb_tool by turns, on a mesh to a level set and back, and prints the least
# processor and wall-clock seconds of three runs each. vdb_tool is built from OpenVDB's source, openvdb_cmd/vdb_tool.
#   bash tests/bench/convert.sh VDB_TOOL MESH.ply VOXEL...
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
if [ $# -lt 3 ]; then
  echo "usage: convert.sh VDB_TOOL MESH.ply VOXEL..." >&2
  exit 2
fi
vdb_tool=$1 mesh=$2
shift 2
polestar=$root/build/release/polestar
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
TIMEFORMAT='%U %S %R'

# least NAME COMMAND...: the fastest of the runs so far, by processor time.
declare -A cpu wall
least() {
  local name=$1 user system real
  shift
  read -r user system real < <({ time "$@" >out 2>&1 || { cat out >&2; exit 1; }; } 2>&1)
  local used
  used=$(awk "BEGIN {print $user + $system}")
  if [ -z "${cpu[$name]:-}" ] || awk "BEGIN {exit !($used < ${cpu[$name]})}"; then
    cpu[$name]=$used wall[$name]=$real
  fi
}

for voxel in "$@"; do
  cpu=() wall=()
  for _ in 1 2 3; do
    least 1-vdb_tool-mesh2ls "$vdb_tool" -read "$mesh" -mesh2ls voxel="$voxel" width=3 -write theirs.vdb
    least 2-convert-to-ls "$polestar" convert "$mesh" --as surface --voxel "$voxel" -o ours.vdb --overwrite -q
    least 3-convert-exact "$polestar" convert "$mesh" --as surface --exact --voxel "$voxel" -o exact.vdb --overwrite -q
    least 4-vdb_tool-ls2mesh "$vdb_tool" -read theirs.vdb -ls2mesh -write theirs.ply
    least 5-convert-to-mesh "$polestar" convert theirs.vdb -o ours.ply --overwrite -q
  done
  echo "voxel $voxel"
  for name in $(printf '%s\n' "${!cpu[@]}" | sort); do
    printf '  %-20s %7.2f s of processor time, %7.2f s\n' "${name#*-}" "${cpu[$name]}" "${wall[$name]}"
  done
done
