#!/usr/bin/env bash
# From a fresh clone to a parameterized solid: installs, builds, then checks, maps and draws one model.
# Usage: apps/demo.sh [-o FOLDER] [MESH]      default: the head of volumes/, into ./out
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

usage() { sed -n 's/^# \{0,1\}//; 2,3p' "${BASH_SOURCE[0]}"; }

folder=out
mesh=$root/volumes/head.ply
while [[ $# -gt 0 ]]; do
  case $1 in
    -h | --help)
      usage
      exit 0
      ;;
    -o)
      folder=${2:?"demo: -o needs a folder"}
      shift 2
      ;;
    -*)
      usage >&2
      exit 2
      ;;
    *)
      mesh=$1
      shift
      ;;
  esac
done
if [[ ! -r $mesh ]]; then
  echo "demo: cannot read $mesh" >&2
  exit 3
fi

bash "$root/apps/setup.sh" polestar_tool
polestar=$root/build/release/polestar
mkdir -p -- "$folder"
name=$(basename -- "$mesh")
grids=$folder/${name%.*}.vdb
picture=$folder/${name%.*}.png

# Shows each command before it runs.
step() {
  printf '\n$ polestar'
  printf ' %q' "$@"
  printf '\n'
  "$polestar" "$@"
}

step check -- "$mesh"
step map -o "$grids" --overwrite -- "$mesh"
step info -- "$grids"
# The head looks best with a corner taken out above the nose; other models are cut in half.
view=(--cut x)
if [[ $mesh == "$root/volumes/head.ply" ]]; then
  view=('--view=-0.55,0.8,-0.35' --cut '1,0,0,0' --cut '0,-0.15,1,0' --cut '0,-1,0,-0.4')
fi
step render -o "$picture" --overwrite --size 1600x1200 "${view[@]}" -- "$grids"

printf '\ngrids:   %s\npicture: %s\n' "$grids" "$picture"
