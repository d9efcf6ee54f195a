#!/usr/bin/env bash
# Installs what is missing, builds, and runs every test; arguments go to ctest, such as -R star. With --all first, sweeps
# over real models take all of them instead of the hardest.
set -euo pipefail
if [[ ${1:-} == --all ]]; then
  export POLESTAR_ALL_MODELS=1
  shift
fi
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

bash "$root/apps/setup.sh"

if [[ -z ${POLESTAR_MESHES:-} && -d $root/../shared/meshes ]]; then
  POLESTAR_MESHES=$(cd "$root/../shared/meshes" && pwd)
  echo "tests: POLESTAR_MESHES is ../shared/meshes beside the checkout"
elif [[ -z ${POLESTAR_MESHES:-} ]]; then
  echo "tests: POLESTAR_MESHES is not set and there is no ../shared/meshes: tests on real meshes are skipped"
fi
export POLESTAR_MESHES=${POLESTAR_MESHES:-}
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$root} CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-1}

cd "$root"
exec ctest --preset release -j2 --timeout 900 "$@"
