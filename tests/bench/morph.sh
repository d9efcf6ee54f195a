#!/usr/bin/env bash
# Builds the comparison of morphs, runs it and remakes docs/bench-morph.md and its raw figures.
# Usage: tests/bench/morph.sh [OPTION...]      everything, some ten minutes; --missing goes on after a stop; --help
#        tests/bench/morph.sh --print [OPTION...]      prints rows and writes nothing
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

bash "$root/apps/setup.sh" --packages-only
if [[ -z ${POLESTAR_MESHES:-} && -d $root/../shared/meshes ]]; then
  POLESTAR_MESHES=$(cd "$root/../shared/meshes" && pwd)
elif [[ -z ${POLESTAR_MESHES:-} ]]; then
  echo "morph.sh: POLESTAR_MESHES is not set and there is no ../shared/meshes: no rows for models of others"
fi
export POLESTAR_MESHES=${POLESTAR_MESHES:-}
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$root} CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-1}

cd "$root"
cmake --preset release -DPOLESTAR_BUILD_BENCHMARKS=ON >/dev/null
cmake --build --preset release --target bench_morph
if [[ ${1:-} == --print ]]; then
  exec build/release/bench/bench_morph "${@:2}"
fi
exec build/release/bench/bench_morph --docs docs "$@"
