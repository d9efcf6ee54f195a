#!/usr/bin/env bash
# Builds the comparison of Green's function solvers, runs it and remakes docs/bench-green.md, its plots and raw figures.
# Usage: tests/bench/green.sh [OPTION...]      everything, half an hour or more; --quick: about a minute; --help
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

bash "$root/apps/setup.sh" --packages-only
if ! command -v tetgen >/dev/null; then
  echo "green.sh: tetgen is not installed, its rows will say so (apt-get install tetgen)"
fi
if [[ -z ${POLESTAR_MESHES:-} && -d $root/../shared/meshes ]]; then
  POLESTAR_MESHES=$(cd "$root/../shared/meshes" && pwd)
elif [[ -z ${POLESTAR_MESHES:-} ]]; then
  echo "green.sh: POLESTAR_MESHES is not set and there is no ../shared/meshes: no rows for models of others"
fi
export POLESTAR_MESHES=${POLESTAR_MESHES:-}
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$root} CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-1}

cd "$root"
cmake --preset release -DPOLESTAR_BUILD_BENCHMARKS=ON >/dev/null
cmake --build --preset release --target bench_green
exec build/release/bench/bench_green --docs docs "$@"
