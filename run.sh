#!/usr/bin/env bash
# mmradartwin's commands: ./run.sh try | demo | test | setup | build | bench | fuzz | asan | tsan | core | lint | docs | exec CMD...
set -euo pipefail

root=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
ws=$root/.ws
# Debian's Python first: catkin and roslib do not import under another one (pyenv, conda).
export PATH=/usr/bin:$PATH
unset PYTHONHOME

# All that is used, by name: Debian's ros-desktop-full-dev would bring some hundred more. Programs of ROS come first, then
# ROS to build with, messages for rostopic and rosservice, libraries, tools, and what tests and the demo run.
packages=(
  rosbash rospack-tools rosout rviz librviz-dev qtbase5-dev tf2-tools libnodeletlib-tools python3-actionlib python3-rosbag python3-roslaunch
  python3-rosmsg python3-rosnode python3-rosparam python3-rosservice python3-rostopic python3-rospy
  catkin ros-message-generation libactionlib-dev libclass-loader-dev libdiagnostic-updater-dev
  libdynamic-reconfigure-config-init-mutex-dev libinteractive-markers-dev libnodeletlib-dev librosbag-dev python3-dynamic-reconfigure libroscpp-dev librostest-dev libtf2-eigen-dev libtf2-ros-dev pluginlib-dev python3-rostest
  libactionlib-msgs-dev libdiagnostic-msgs-dev libgeometry-msgs-dev libros-rosgraph-msgs-dev libsensor-msgs-dev libstd-msgs-dev
  libstd-srvs-dev libtf2-msgs-dev libvisualization-msgs-dev python3-actionlib-msgs python3-diagnostic-msgs
  python3-geometry-msgs python3-rosgraph-msgs python3-sensor-msgs python3-std-msgs python3-std-srvs python3-tf2-msgs
  python3-tf2-ros python3-visualization-msgs ros-actionlib-msgs ros-diagnostic-msgs ros-geometry-msgs
  ros-rosgraph-msgs ros-sensor-msgs ros-std-msgs ros-std-srvs ros-tf2-msgs ros-visualization-msgs
  libassimp-dev libboost-dev libcli11-dev libconsole-bridge-dev libeigen3-dev libembree-dev liblua5.4-dev libmatio-dev
  libnlopt-dev libopencv-dev libpcap-dev libpcl-dev libssl-dev libtbb-dev libtinyxml2-dev libumockdev-dev libusb-1.0-0-dev
  libyaml-cpp-dev nlohmann-json3-dev pybind11-dev zlib1g-dev python3-dev python3-matplotlib python3-numpy python3-scipy
  python3-setuptools python3-yaml
  build-essential ccache cmake git pkg-config
  catkin-lint clang-format clang-tidy shellcheck libbenchmark-dev libgtest-dev
  faketime imagemagick iproute2 procps umockdev x11-apps x11-utils xauth xvfb)

# shellcheck disable=SC1091
source "$root/launch/scripts/stages.sh"

usage() {
  cat >&2 <<'U'
usage: ./run.sh VERB
  try [OUT]    install, build what it needs, then a first finding in a minute or two: a small measurement that hides
               something, and its diagnosis; results in OUT (default try_out)
  demo [OUT]   install, build what it needs, then play a generated session through the whole loop; results in OUT
               (default demo_out)
  test         install, build, run the tests; the last line is "N passed, N failed, N skipped"
  test long    the same with more sessions of the diagnosis, another third each day; test all takes every one
  setup        install the Debian packages that are missing
  build        build the workspace (.ws/)
  bench [OUT]  build, then run all benchmarks; JSON and a table in OUT (default bench_out). Its last part, the blind
               protocol, stops after 90 min; called again with the same OUT it goes on
  fuzz [S]     every reader of foreign bytes under libFuzzer with address and undefined-behaviour sanitizer, S seconds
               each (60); needs clang; corpus and findings stay in .ws/fuzz
  asan [T...]  tests of all packages that need no ROS master, or those named, under the address and
               undefined-behaviour sanitizer; needs clang; outputs in .ws/asan
  tsan         tests with threads, of driver and dsp, under the thread sanitizer
  core [...]   build what needs no ROS by cmake alone, without catkin, and run its tests; arguments go to ctest.
               `test` takes the libraries and one small test of each package
  lint [all]   format, includes, errors and names of C++, Python, shell scripts, packages; clang-tidy takes the newest
               sources for three minutes, with `all` every one
  docs [OUT]   a site of README.md and docs/ in OUT (.ws/docs/site), by mkdocs, which is installed for that
  exec CMD...  run CMD in the sourced workspace, e.g. ./run.sh exec rosrun mmradartwin_attribution evaluate --help
U
  exit 2
}

# install PACKAGE...: those that are missing
install() {
  local missing=() package
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return
  local sudo=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || die "these Debian packages are missing and sudo is not here to install them; as root: apt-get install ${missing[*]}"
    sudo=(sudo)
    sudo -v
  fi
  logged "$ws/log/apt_update.log" unknown "apt-get update" "${sudo[@]}" apt-get update
  apt_packages=$(apt-get install --simulate --no-install-recommends "${missing[@]}" 2>/dev/null | grep -c '^Inst ' || true)
  say "Installing $apt_packages Debian packages (log: $ws/log/apt_install.log)"
  logged "$ws/log/apt_install.log" of_apt "apt-get install" "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y --no-install-recommends "${missing[@]}"
}

setup() { install "${packages[@]}"; }

workspace() {
  mkdir -p "$ws/src"
  ln -sfn ../.. "$ws/src/mmradartwin"
}

# One compiler per core, two where memory would not do for so many; CMAKE_BUILD_PARALLEL_LEVEL says otherwise.
jobs() {
  local jobs=${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}
  [ "$jobs" -gt 2 ] && [ "$(awk '/MemAvailable/ {print int($2/2e6)}' /proc/meminfo)" -lt "$jobs" ] && jobs=2
  echo "$jobs"
}

# build [make arguments]
build() {
  workspace
  [ -d /usr/lib/ccache ] && export PATH=/usr/lib/ccache:$PATH
  export ROS_LANG_DISABLE=genlisp:geneus:gennodejs  # messages for C++ and Python
  say "Building the workspace${1:+: $1} (log: $ws/log/build.log)"
  (cd "$ws" && logged "$ws/log/build.log" of_make "the build" catkin_make -j"$(jobs)" -DCMAKE_BUILD_TYPE=Release "$@")
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

# run_tests [long|all]: which diagnosis sessions run beside the fixed ones
run_tests() {
  local limit_s=1800 core_status=0
  case ${1:-} in
    '') ;;
    long | all) export MMRADARTWIN_LONG=$1 ;;
    *) usage ;;
  esac
  [ -z "${MMRADARTWIN_LONG:-}" ] || limit_s=14400
  build
  # Configured again: ctest's environment has only the folders that were there, and the first build made the messages' one.
  build tests --force-cmake
  core_sample || core_status=$?
  source_workspace
  data_folder
  rm -rf "$ws/build/test_results"
  rm -f "$ws/build/ctest.xml"
  # Counted among the tests.
  python3 "$root/test/scripts/lint.py" format includes python shell packages --xml "$ws/build/test_results/lint/lint.xml" >&2 || true
  (cd "$ws/build" && ctest --show-only=json-v1) >"$ws/build/ctest_list.json"
  # Side by side but for those that keep time, one more than there are cores: launches and bags mostly wait. Seeds and the
  # day are shown. Cases are read from the XML files, and ctest says which modules ended badly or left none.
  say "running the tests (log: $ws/build/Testing/Temporary/LastTest.log)"
  local status=0
  (cd "$ws/build" && ctest -V -j"$(($(jobs) + 1))" --timeout "$limit_s" --output-junit ctest.xml) |
    awk '/^ *[0-9]+\/[0-9]+ Test|^ +Start|^[0-9]+: MMRADARTWIN_[A-Z_]*(SEED|DAY)=/ {print; fflush()}' >&2 || status=$?
  python3 "$root/test/summarise_results.py" "$ws/build/test_results" --list "$ws/build/ctest_list.json" \
    --ran "$ws/build/ctest.xml" --status "$status" --step "core=$core_status"
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
    case $bench in */benchmark_scenarios | */benchmark_stream) "$bench" | tee "$out/$(basename "$bench").txt"; continue ;; esac
    "$bench" --benchmark_out="$out/$(basename "$bench").json" --benchmark_out_format=json
  done
  say "simulator against generator, path by path"
  rosrun mmradartwin_tests compare_with_simulator.py --seed 1 | tee "$out/paths.txt"
  say "recall of the twin beside its ceiling"
  rosrun mmradartwin_tests recall_ceiling.py --seed 100 --sessions 6 | tee "$out/recall.txt"
  # A trial that is finished does not run again: the same call goes on where the last one ended.
  say "blind protocol of the diagnosis, 90 min of it at most"
  rosrun mmradartwin_tests blind_protocol.py --output "$out/blind" --rows all --seed 1 --budget 90 | tee "$out/blind.txt"
}

# separate_build FOLDER TARGETS CMAKE_ARGUMENTS...: the workspace once more, compiled otherwise
separate_build() {
  local folder=$ws/$1 targets=$2
  shift 2
  workspace
  mkdir -p "$ws/log"
  [ -e "$ws/src/CMakeLists.txt" ] || catkin_init_workspace "$ws/src" >"$ws/log/init.log" 2>&1
  [ -d /usr/lib/ccache ] && export PATH=/usr/lib/ccache:$PATH
  export ROS_LANG_DISABLE=genpy:genlisp:geneus:gennodejs  # messages for C++ alone
  say "Building $targets (log: $ws/log/${folder##*/}_build.log)"
  logged "$ws/log/${folder##*/}_configure.log" unknown "cmake" cmake -S "$ws/src" -B "$folder/build" -DCATKIN_DEVEL_PREFIX="$folder/devel" -DCMAKE_INSTALL_PREFIX="$folder/install" \
    -DCMAKE_BUILD_TYPE=RelWithDebInfo "$@"
  # shellcheck disable=SC2086
  logged "$ws/log/${folder##*/}_build.log" of_make "the build" cmake --build "$folder/build" -j"$(jobs)" --target $targets
}

# fuzz_build TARGETS: by clang, with both sanitizers
fuzz_build() {
  command -v clang++ >/dev/null || die "clang is not here; as root: apt-get install clang"
  separate_build fuzz "$1" -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ -Dmmradartwin_tests_FUZZ=ON \
    "-DCMAKE_CXX_FLAGS=-fsanitize=address,undefined,fuzzer-no-link -fno-sanitize-recover=undefined"
}

run_fuzz() {
  local seconds=${1:-60} package program input failed=()
  [[ $seconds =~ ^[0-9]+$ ]] || usage
  fuzz_build fuzz
  mkdir -p "$ws/fuzz/findings"
  for package in dsp driver messages sim; do
    program=$ws/fuzz/devel/lib/mmradartwin_tests/fuzz_$package
    for input in $("$program" -inputs); do
      say "fuzz: $input, $seconds s"
      mkdir -p "$ws/fuzz/corpus/$input"
      FUZZ_INPUT=$input "$program" -seeds="$ws/fuzz/corpus/$input"
      FUZZ_INPUT=$input "$program" -max_total_time="$seconds" -timeout=30 -rss_limit_mb=2048 -max_len=8192 -verbosity=1 \
        -artifact_prefix="$ws/fuzz/findings/$input-" "$ws/fuzz/corpus/$input" 2>&1 |
        { grep -vE '^#[0-9]+.*(NEW|REDUCE|pulse|RELOAD)' || true; } || failed+=("$input")
    done
  done
  [ ${#failed[@]} -eq 0 ] || { say "found something: ${failed[*]}; the inputs are in $ws/fuzz/findings"; exit 1; }
  say "nothing found"
}

# Tests of a package that run without a ROS master, by their targets' names.
masterless_tests() {
  local package source name
  for package in driver dsp sim attribution; do
    while read -r source; do
      name=$(basename "$source" .cpp)
      case $name in *_node_test | live_session_test) continue ;; esac
      [ "$package" = driver ] || name=mmradartwin_${package}_$name
      echo "$name"
    done < <(find "$root/mmradartwin_$package/test" -name '*_test.cpp' | LC_ALL=C sort)
  done
}

run_asan() {
  local test program failed=() names=("$@")
  [ $# -gt 0 ] || mapfile -t names < <(masterless_tests)
  fuzz_build "${names[*]}"
  data_folder
  mkdir -p "$ws/asan"
  for test in "${names[@]}"; do
    program=$(find "$ws/fuzz/devel/lib" -name "$test" -type f)
    UBSAN_OPTIONS=print_stacktrace=1 "$program" --gtest_brief=1 >"$ws/asan/$test.log" 2>&1 || failed+=("$test")
    say "address sanitizer: $test: $(tail -n 1 "$ws/asan/$test.log")"
  done
  [ ${#failed[@]} -eq 0 ] || { say "found something: ${failed[*]}; see $ws/asan"; exit 1; }
  say "nothing found"
}

run_tsan() {
  local test status=0
  local tests="dropping_worker_queue_test emulator_loopback_test rig_test radar_watch_test dca1000_control_test pcap_recording_test"
  tests+=" child_process_test doctor_test mmradartwin_dsp_output_test mmradartwin_dsp_signal_chain_test"
  tests+=" configure_radar_test rig_self_test_test"
  separate_build tsan "$tests" "-DCATKIN_WHITELIST_PACKAGES=mmradartwin_msgs;mmradartwin_dsp;mmradartwin_driver" \
    "-DCMAKE_CXX_FLAGS=-fsanitize=thread"
  data_folder
  for test in $tests; do
    say "thread sanitizer: $test"
    TSAN_OPTIONS="halt_on_error=0 exitcode=66 suppressions=$root/test/tsan_suppressions.txt" "$(find "$ws/tsan/devel/lib" -name "$test" -type f)" || status=1
  done
  return $status
}

# core TARGETS [ctest arguments]: no part of catkin's workspace is seen, but its paths to the sources, from a folder of
# the same depth, so that ccache knows what catkin's build has compiled.
core() (
  targets=$1 folder=$ws/core/mmradartwin
  shift
  workspace
  [ -d /usr/lib/ccache ] && export PATH=/usr/lib/ccache:$PATH
  unset CMAKE_PREFIX_PATH ROS_PACKAGE_PATH LD_LIBRARY_PATH PYTHONPATH
  data_folder
  # shellcheck disable=SC2086
  logged "$ws/log/core_configure.log" unknown "cmake" cmake -S "$ws/src/mmradartwin" -B "$folder" -DCMAKE_BUILD_TYPE=Release &&
    logged "$ws/log/core_build.log" of_make "the build" cmake --build "$folder" -j"$(jobs)" --target $targets &&
    ctest --test-dir "$folder" -j"$(jobs)" --output-on-failure --no-tests=error "$@" >&2
)

# The libraries without ROS, and one small test of each package.
core_sample() {
  local libraries="mmradartwin_dsp mmradartwin_driver mmradartwin_sim mmradartwin_sim_room mmradartwin_attribution"
  local tests="mmradartwin_dsp_units_test frame_clock_test mmradartwin_sim_plugin_test
    mmradartwin_attribution_packed_hermitian_test"
  say "Building and trying what needs no ROS by cmake alone (log: $ws/log/core_build.log)"
  # shellcheck disable=SC2086
  core "$libraries $tests" -R "^($(printf '%s|' $tests)none)$"
}

# lint [all | PART...]: `all` for clang-tidy over every source, else newest sources for three minutes.
lint() {
  local arguments=("$@")
  [ "${1:-}" = all ] && arguments=(--all)
  python3 "$root/test/scripts/lint.py" "${arguments[@]}" >&2
}

# try [OUT]: a release's sample is taken where it lies beside run.sh.
try() {
  local sample=()
  [ ! -d "$root/mmradartwin_sample" ] || sample=("$root/mmradartwin_sample")
  exec "$root/launch/scripts/try.sh" "$(readlink -m "${1:-$root/try_out}")" "${sample[@]}"
}

verb=${1:-}
[ -n "$verb" ] && shift
case $verb in
  try) setup; build mmradartwin_demo; source_workspace; try "$@" ;;
  demo) setup; build mmradartwin_demo; source_workspace; exec "$root/launch/scripts/demo.sh" "$(readlink -m "${1:-$root/demo_out}")" ;;
  test) setup; run_tests "$@" ;;
  setup) setup ;;
  build) setup; build ;;
  bench) setup; run_bench "$@" ;;
  fuzz) setup; run_fuzz "$@" ;;
  asan) setup; run_asan "$@" ;;
  tsan) setup; run_tsan ;;
  core) setup; core all "$@" ;;
  lint) setup; lint "$@" ;;
  docs) install mkdocs; "$root/docs/build.sh" "$@" ;;
  exec) [ $# -gt 0 ] || usage; source_workspace; data_folder; exec "$@" ;;
  *) usage ;;
esac
