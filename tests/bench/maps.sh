#!/usr/bin/env bash
# Builds the comparison of maps, runs it and remakes docs/bench-maps.md, docs/bench-distortion.md and their raw figures.
# Usage: tests/bench/maps.sh [OPTION...] [MODEL...]      everything, some 25 minutes; --missing goes on after a stop
#        tests/bench/maps.sh --print [OPTION...] [MODEL...]      prints rows and writes nothing; --help
# POLESTAR_GALAXY_MAPS: the executable galaxy_map of Galaxy Maps, or its folder; without it those rows say "not run".
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

bash "$root/apps/setup.sh" --packages-only
if ! command -v tetgen >/dev/null; then
  echo "maps.sh: tetgen is not installed, methods are not compared (apt-get install tetgen)"
fi
if [[ -z ${POLESTAR_MESHES:-} && -d $root/../shared/meshes ]]; then
  POLESTAR_MESHES=$(cd "$root/../shared/meshes" && pwd)
fi
export POLESTAR_MESHES=${POLESTAR_MESHES:-}
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$root} CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-1}

cd "$root"
cmake --preset release -DPOLESTAR_BUILD_BENCHMARKS=ON >/dev/null
cmake --build --preset release --target bench_maps
if [[ ${1:-} == --print ]]; then
  exec build/release/bench/bench_maps "${@:2}"
fi
exec build/release/bench/bench_maps --docs docs "$@"
