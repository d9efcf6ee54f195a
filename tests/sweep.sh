#!/usr/bin/env bash
# Maps every star-shaped model of the mesh folder and prints a table: the long check that the test suite leaves out.
# Usage: tests/sweep.sh [DIM] [NAME ...]      default: 96 and all models that MANIFEST.tsv calls star-shaped
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
meshes=${POLESTAR_MESHES:-$root/../shared/meshes}
polestar=$root/build/release/polestar
dim=${1:-96}
shift || true
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

names=("$@")
if [[ ${#names[@]} -eq 0 ]]; then
  mapfile -t names < <(awk -F'\t' '$6 == "yes" {print $1}' "$meshes/MANIFEST.tsv")
fi
printf '| model | V | verdict | boundary error | unresolved %% | charge + 1 | bad in solid | bad in ball | lines retraced, replaced, bent | nodes moved | by (ball) | deep | inverted | collapsed | cells | round trip (voxels) | qc | seconds | MB |\n'
printf '|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n'
for name in "${names[@]}"; do
  start=$(date +%s.%N)
  "$polestar" map -q --json --keep-failed --overwrite --dim "$dim" -o "$scratch/map.vdb" -- "$meshes/$name" \
    >"$scratch/map.json" 2>"$scratch/log" || true
  seconds=$(awk -v a="$start" -v b="$(date +%s.%N)" 'BEGIN {printf "%.1f", b - a}')
  python3 - "$name" "$scratch/map.json" "$seconds" <<'PY'
import json, sys
name, path, seconds = sys.argv[1:]
d = json.load(open(path))
if "sampled" not in d:
    print(f"| {name} | {d.get('vertices')} | {d['error']['code']}: {d['error']['message'][:120]} |" + " |" * 16)
    sys.exit()
s, f = d["sampled"], d["foliation"]
print(f"| {name} | {d['vertices']} | {d['certificate']['verdict']} | {d['boundary_error']['max']:.1e} | {100 * d['green']['unresolved_area']:.2g} | {d['charge'] + 1:.0e} "
      f"| {f['inverted'] + f['flat']} | {f['image_cells_bad']} | {f['lines_retraced']}, {f['lines_repaired'] + f['lines_failed']}, {f['lines_on_rays']} | {f['nodes_moved']} | {f['largest_move_ball']:.1e} | {s['inverted_deep']} | {s['inverted']} | {s['collapsed']} "
      f"| {s['cells']} | {s['round_trip_max'] / s['voxel_size']:.2f} ({s['round_trip_lost']} lost) | {d['sphere']['qc_mean']:.3f} "
      f"| {seconds} | {d['peak_memory_bytes'] / 1e6:.0f} |", flush=True)
PY
done
