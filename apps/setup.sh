#!/usr/bin/env bash
# Installs what is missing of apps/debian-packages.txt, then configures and builds polestar into build/release.
# Usage: apps/setup.sh [--packages-only] [TARGET...]      default: everything, tests included
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

say() { printf 'setup: %s\n' "$*" >&2; }

missing_packages() {
  local package
  while read -r package; do
    [[ $(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null) == installed ]] || printf '%s\n' "$package"
  done < <(sed -e 's/#.*//' -e 's/[[:space:]]//g' -e '/^$/d' "$root/apps/debian-packages.txt")
}

install_packages() {
  local missing as_root=()
  if ! command -v dpkg-query >/dev/null; then
    say "this is no Debian: install the counterparts of apps/debian-packages.txt by hand; going on with what is there"
    return
  fi
  mapfile -t missing < <(missing_packages)
  [[ ${#missing[@]} -gt 0 ]] || return 0
  say "installing ${#missing[@]} packages: ${missing[*]}"
  if [[ $(id -u) -ne 0 ]]; then
    if ! command -v sudo >/dev/null; then
      say "neither root nor sudo here. Ask an administrator for: apt-get install ${missing[*]}"
      exit 1
    fi
    as_root=(sudo)
  fi
  if ! { "${as_root[@]}" apt-get update -qq &&
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
      "${missing[@]}" >&2; }; then
    say "apt-get failed; see above. Needed: ${missing[*]}"
    exit 1
  fi
}

build() {
  # Clones in other folders share what the compiler cache holds.
  export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$root} CCACHE_NOHASHDIR=${CCACHE_NOHASHDIR:-1}
  mkdir -p "$root/build"
  cd "$root"
  cmake --preset release >"$root/build/configure.log" 2>&1 || {
    cat "$root/build/configure.log" >&2
    say "cmake could not configure; see above"
    exit 1
  }
  if [[ $# -gt 0 ]]; then
    cmake --build --preset release --target "$@"
  else
    cmake --build --preset release
  fi
}

install_packages
[[ ${1:-} != --packages-only ]] || exit 0
say "building into build/release"
build "$@"
say "built $root/build/release/polestar"
