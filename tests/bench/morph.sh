#!/usr/bin/env bash
# Turns one solid into another by both paths, and by OpenVDB's LevelSetMorphing and blended distances, and remakes
# docs/bench-morph.md: volume over time, seconds a frame. Takes some minutes; wants python3.
#   bash tests/bench/morph.sh [FROM TO [DIM [FRAMES]]]      default: smooth_star.ply and head.ply of volumes/, 128, 25
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root"
from=${1:-volumes/smooth_star.ply} to=${2:-volumes/head.ply} dim=${3:-128} frames=${4:-25}
bash apps/setup.sh --packages-only
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$root} CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-1}
cmake --preset release -DPOLESTAR_BUILD_BENCHMARKS=ON >/dev/null
cmake --build --preset release --target polestar_tool bench_morph_peers

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
tool=build/release/polestar
"$tool" map "$from" -o "$folder/from.vdb" --dim 32 -q
"$tool" map "$to" -o "$folder/to.vdb" --dim 32 -q
for path in straight radial; do
  "$tool" morph "$folder/from.pmap" "$folder/to.pmap" --frames "1-$frames" --dim "$dim" --path "$path" --keep-failed \
    -o "$folder/frame.####.vdb" --overwrite --json >"$folder/$path.json" || [ $? = 6 ]
done
voxel=$(python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["voxel_size"])' "$folder/straight.json")
# Distances are blended everywhere, so their bands have to be as wide as the solids.
for end in from to; do
  "$tool" convert "${!end}" --as surface --voxel "$voxel" --half-width "$dim" -o "$folder/wide-$end.vdb" -q
done
build/release/bench/bench_morph_peers "$folder/wide-from.vdb" "$folder/wide-to.vdb" "$frames" >"$folder/peers.json"
python3 tests/bench/morph/page.py docs/bench-morph.md "$(basename "$from")" "$(basename "$to")" "$dim" \
  "$folder/straight.json" "$folder/radial.json" "$folder/peers.json"
echo "morph.sh: wrote docs/bench-morph.md"
