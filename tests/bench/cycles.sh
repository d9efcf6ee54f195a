#!/usr/bin/env bash
# Renders one filled solid with `polestar render` and with Cycles of Debian's Blender by turns and remakes
# docs/bench-render.md. Takes about ten minutes; wants Blender (apt-get install blender).
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

if ! command -v blender >/dev/null; then
  echo "cycles.sh: blender is not installed (apt-get install blender)" >&2
  exit 1
fi
bash "$root/apps/setup.sh" --packages-only
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$root} CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-1}
cd "$root"
cmake --preset release -DPOLESTAR_BUILD_BENCHMARKS=ON >/dev/null
cmake --build --preset release --target polestar_tool bench_cut_surface

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
tool=build/release/polestar
"$tool" map volumes/asteroid.ply -o "$folder/asteroid.vdb" --dim 128 -q
"$tool" transfer kiwi "$folder/asteroid.vdb" -o "$folder/kiwi.vdb" --dcc blender -q
build/release/bench/bench_cut_surface "$folder/kiwi.vdb" "$folder/kiwi.obj"
blender -b --factory-startup --python-exit-code 3 --python tests/bench/cycles/compare.py -- \
  "$tool" "$folder/kiwi.vdb" "$folder/kiwi.obj" "the asteroid of volumes/, filled with kiwi at 128 voxels" \
  docs/bench-render.md >"$folder/blender.log" || { tail -n 20 "$folder/blender.log" >&2; exit 1; }
echo "cycles.sh: wrote docs/bench-render.md"
