#!/usr/bin/env bash
# mmradartwin's commands: ./run.sh demo | test | setup | build | bench | lint | exec CMD...
set -euo pipefail

root=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
ws=$root/.ws
# Debian's Python first: catkin and roslib do not import under another one (pyenv, conda).
export PATH=/usr/bin:$PATH
unset PYTHONHOME

packages=(
  build-essential cmake ros-desktop-full-dev catkin catkin-lint python3-rostest librviz-dev rosbash rospack-tools
  libdiagnostic-updater-dev libembree-dev libpcl-dev libpcl-conversions-dev libassimp-dev libyaml-cpp-dev nlohmann-json3-dev libtbb-dev
  libssl-dev libmatio-dev libpcap-dev libusb-1.0-0-dev zlib1g-dev libumockdev-dev umockdev libcli11-dev libgtest-dev libbenchmark-dev libopencv-dev
  ccache xvfb xauth x11-apps x11-utils imagemagick iproute2 python3-numpy python3-scipy python3-yaml)

say() { printf '== %s\n' "$*" >&2; }
die() { printf 'error: %s\n' "$*" >&2; exit 2; }

usage() {
  cat >&2 <<'U'
usage: ./run.sh VERB
  demo [OUT]   install, build, then play a generated session through the whole loop; results in OUT (default demo_out)
  test         install, build, run every test; the last line is "N passed, N failed, N skipped"
  setup        install the Debian packages that are missing
  build        build the workspace (.ws/)
  bench [OUT]  build, then run all benchmarks; JSON and a table in OUT (default bench_out)
  lint         catkin_lint over all packages
  exec CMD...  run CMD in the sourced workspace, e.g. ./run.sh exec rosrun mmradartwin_attribution evaluate --help
U
  exit 2
}

setup() {
  local missing=() package
  for package in "${packages[@]}"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return
  local sudo=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || die "these Debian packages are missing and sudo is not here to install them; as root: apt-get install ${missing[*]}"
    sudo=(sudo)
  fi
  say "installing ${#missing[@]} Debian packages: ${missing[*]}"
  "${sudo[@]}" apt-get update -qq
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >&2
}

workspace() {
  mkdir -p "$ws/src"
  ln -sfn ../.. "$ws/src/mmradartwin"
}

# build [make arguments]
build() {
  workspace
  [ -d /usr/lib/ccache ] && export PATH=/usr/lib/ccache:$PATH
  local jobs
  jobs=$(nproc)
  [ "$jobs" -gt 2 ] && [ "$(awk '/MemAvailable/ {print int($2/2e6)}' /proc/meminfo)" -lt "$jobs" ] && jobs=2
  (cd "$ws" && catkin_make -j"$jobs" -DCMAKE_BUILD_TYPE=Release "$@")
}

source_workspace() {
  [ -f "$ws/devel/setup.bash" ] || die "the workspace is not built yet; run ./run.sh build"
  set +u
  # shellcheck disable=SC1091
  source "$ws/devel/setup.bash"
  set -u
}

data_folder() {
  export MMRADARTWIN_DATA=${MMRADARTWIN_DATA:-$(readlink -m "$root/../shared/data")}
}

run_tests() {
  build
  build tests
  source_workspace
  data_folder
  rm -rf "$ws/build/test_results"
  # run_tests returns 0 on failing tests and prints too much to find them in: the summary reads the XML files.
  local log=$ws/build/run_tests.log
  say "running the tests (log: $log)"
  (cd "$ws" && catkin_make run_tests -j1 2>&1) | tee "$log" | awk '/^-- run_tests.py: execute|^\[ROSTEST\]/ {print; fflush()}' >&2 || true
  python3 "$root/test/summarise_results.py" "$ws/build/test_results"
}

run_bench() {
  local out
  out=$(readlink -m "${1:-$root/bench_out}")
  mkdir -p "$out"
  build
  source_workspace
  data_folder
  local bench
  for bench in "$ws"/devel/lib/mmradartwin_*/*benchmark*; do
    [ -x "$bench" ] || continue
    say "$(basename "$bench")"
    "$bench" --benchmark_out="$out/$(basename "$bench").json" --benchmark_out_format=json
  done
  say "simulator against generator, path by path"
  rosrun mmradartwin_tests compare_with_simulator.py --seed 1 | tee "$out/paths.txt"
  say "recall of the twin beside its ceiling"
  rosrun mmradartwin_tests recall_ceiling.py --seed 100 --sessions 6 | tee "$out/recall.txt"
}

lint() {
  catkin_lint --offline -W2 --ignore package_path_name "$root"/mmradartwin_* "$root/launch" "$root/config" "$root/test"
}

verb=${1:-}
[ -n "$verb" ] && shift
case $verb in
  demo) setup; build >&2; source_workspace; exec "$root/launch/scripts/demo.sh" "$(readlink -m "${1:-$root/demo_out}")" ;;
  test) setup; run_tests ;;
  setup) setup ;;
  build) setup; build ;;
  bench) setup; run_bench "$@" ;;
  lint) setup; lint ;;
  exec) [ $# -gt 0 ] || usage; source_workspace; data_folder; exec "$@" ;;
  *) usage ;;
esac
