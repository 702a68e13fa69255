#!/usr/bin/env bash
# The demo: generate a session that hides an effect, play it over UDP through the live loop, evaluate what was recorded,
# find the effect, replay and evaluate again with the twin that knows it. Ends with 0 if the effect was found.
# usage: demo.sh OUTPUT
set -euo pipefail

case ${1:-} in
  --help | -h) sed -n '2,4s/^# //p' "${BASH_SOURCE[0]}"; exit 0 ;;
  --version) echo "demo.sh $(rosversion mmradartwin_launch)"; exit 0 ;;
  '' | -*) echo 'error: usage: demo.sh OUTPUT' >&2; exit 2 ;;
esac
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
# shellcheck disable=SC1091
source "$here/stages.sh"

out=$(readlink -m "$1")
locations=${DEMO_LOCATIONS:-10}
headings=${DEMO_HEADINGS:-2}
frames=${DEMO_FRAMES:-50}
effect=${DEMO_EFFECT:-element_pattern}
log=$out/log
started=$SECONDS
# shellcheck disable=SC2034 # read by stage
stages=6

own_folder "$out" .mmradartwin_demo session truth.json report diagnosis report_extended demo.bag demo.bag.active rviz.png \
  rviz_extended.png rviz_before_after.png log
mkdir -p "$log"
export ROS_LOG_DIR=$log/ros
say "What follows takes some minutes. All that the programs say goes to $log."

stage "Measuring: the generator writes raw captures of an office at $locations places in $headings directions each. It hides an effect."
logged "$log/1_generate.log" unknown "generating the session" rosrun mmradartwin_tests make_session.py \
  --output "$out/session" --locations "$locations" --headings "$headings" --frames "$frames" \
  --seed "${DEMO_SEED:-$RANDOM}" --truth "$out/truth.json" --effect "$effect"
say "      $(find "$out/session/captures" -name '*.bin' | wc -l) captures, $(du -sh "$out/session" | cut -f 1)B in all."

# A window where there is a display, a virtual one otherwise.
xvfb=
if [ -z "${DISPLAY:-}" ]; then
  for n in $(seq 90 120); do [ -e "/tmp/.X11-unix/X$n" ] || break; done
  Xvfb ":$n" -screen 0 1920x1080x24 +extension GLX >/dev/null 2>&1 &
  xvfb=$!
  export DISPLAY=:$n LIBGL_ALWAYS_SOFTWARE=1
fi
# picture FILE: what rviz shows now; fails where there is no rviz yet.
picture() {
  local id
  id=$(xwininfo -root -tree 2>/dev/null | awk '/ - RViz"/ {print $1; exit}')
  [ -n "$id" ] || return 1
  [ -n "$xvfb" ] && id=root
  import -window "$id" "$1" 2>/dev/null
}

# launched NUMBER_NAME PLAYER PERCENT FILE LAUNCH...: roslaunch until its node PLAYER has ended, then Ctrl-C for the rest. The last
# picture of rviz that was taken while PLAYER ran goes to FILE.
launch=
launched() {
  local log_file=$log/$1.log player=$2 percent=$3 file=$4 follower seen=0
  shift 4
  : >"$log_file"
  follow "$log_file" "$percent" &
  follower=$!
  roslaunch -p "$port" mmradartwin_launch "$@" >"$log_file" 2>&1 &
  launch=$!
  while kill -0 "$launch" 2>/dev/null; do
    sleep 3
    if pgrep -P "$launch" -f "__name:=$player" >/dev/null; then
      seen=1
      if picture "$out/.rviz.png" && pgrep -P "$launch" -f "__name:=$player" >/dev/null; then mv -f "$out/.rviz.png" "$file"; fi
    elif [ "$seen" -eq 1 ]; then
      kill -INT "$launch" 2>/dev/null || true
      break
    fi
  done
  rm -f "$out/.rviz.png"
  wait "$launch" || true
  launch=
  stop_following "$follower"
}

# shellcheck disable=SC2317 # called by the trap
cleanup() {
  [ -n "$launch" ] && kill -INT "$launch" 2>/dev/null && wait "$launch" 2>/dev/null
  [ -n "$xvfb" ] && kill "$xvfb" 2>/dev/null
  return 0
}
trap cleanup EXIT
trap 'exit 130' INT TERM

# A master of its own, so that the demo disturbs no other.
port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
export ROS_MASTER_URI=http://127.0.0.1:$port ROS_IP=127.0.0.1
# With ROS_IP it keeps every socket on this computer.
export LD_PRELOAD=libmmradartwin_dsp_loopback_only.so${LD_PRELOAD:+:$LD_PRELOAD}

where=''
[ -z "$xvfb" ] || where=' There is no display, so rviz draws on a virtual one.'
stage "Live: an emulated DCA1000 plays it over UDP at the radar's pace. Driver, signal chain, twin, attribution and rviz run.$where"
# shellcheck disable=SC2086 # several arguments
launched 2_live session_player of_poses "$out/rviz.png" demo.launch session:="$out/session" bag:="$out/demo.bag" \
  average_frames:="$frames" ${DEMO_ARGS:-}
bag=$out/demo.bag
if [ ! -f "$bag" ] || ! grep -qa 'the session has been played' "$log/2_live.log"; then
  grep -a -m 5 '\[FATAL\]' "$log/2_live.log" >&2 || true
  show_failure "$log/2_live.log" 1 "playing the session to its end"
  exit 1
fi
say "      recorded: $bag, $(du -sh "$bag" | cut -f 1)B."

stage "Before: the recording is compared with the twin as given."
logged "$log/3_evaluate.log" unknown "evaluating" rosrun mmradartwin_attribution evaluate "$bag" --output "$out/report"

stage "Diagnosis: what does the twin get wrong? Each mechanism of the simulator is tried; this takes about a minute."
logged "$log/4_diagnose.log" unknown "the diagnosis" rosrun mmradartwin_attribution diagnose "$out/session" --output "$out/diagnosis"

stage "Replay: the recording runs through the same chain, with the twin that knows what was found."
extended=$out/diagnosis/twin.extended.yaml
# shellcheck disable=SC2086 # several arguments
launched 5_replay player unknown "$out/rviz_extended.png" replay.launch bag:="$bag" twin:="$extended" \
  average_frames:="$frames" diagnosis:=false stay:=false ${DEMO_ARGS:-}
if [ -f "$out/rviz.png" ] && [ -f "$out/rviz_extended.png" ]; then
  convert "$out/rviz.png" "$out/rviz_extended.png" -append "$out/rviz_before_after.png"
fi

stage "After: the recording is compared with the extended twin."
logged "$log/6_evaluate.log" unknown "evaluating" rosrun mmradartwin_attribution evaluate "$bag" --twin "$extended" \
  --output "$out/report_extended" --no-bag

say ""
status=0
python3 "$here/tell_result.py" "$out/truth.json" "$out/diagnosis/findings.json" || status=$?
cat <<TEXT

Open this page:  $out/diagnosis/report.html
Beside it in $out:
  rviz_before_after.png                 what rviz showed, before and after
  report/ and report_extended/          the comparison before and after (report.html)
  demo.bag                              the recording
  session/, truth.json, log/            raw captures, what was hidden, what the programs said
To see it again:  ./run.sh exec roslaunch mmradartwin_launch replay.launch bag:=$bag
$(((SECONDS - started) / 60)) min $(((SECONDS - started) % 60)) s.
TEXT
exit "$status"
