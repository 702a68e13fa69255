#!/usr/bin/env bash
# The demo: generate a session that hides an effect, play it over UDP through the live loop, evaluate what was recorded,
# find the effect, replay and evaluate again with the twin that knows it.
# usage: demo.sh OUTPUT
set -euo pipefail

case ${1:-} in
  --help | -h) sed -n '2,4s/^# //p' "${BASH_SOURCE[0]}"; exit 0 ;;
  --version) echo "demo.sh $(rosversion mmradartwin_launch)"; exit 0 ;;
  '' | -*) echo 'error: usage: demo.sh OUTPUT' >&2; exit 2 ;;
esac
out=$1
locations=${DEMO_LOCATIONS:-10}
headings=${DEMO_HEADINGS:-2}
frames=${DEMO_FRAMES:-100}
say() { printf '== %s\n' "$*" >&2; }

mkdir -p "$out"
rm -rf "$out/session" "$out/report" "$out/diagnosis" "$out/report_extended" "$out/demo.bag" "$out/demo.bag.active" \
  "$out/rviz.png" "$out/rviz_extended.png" "$out/rviz_before_after.png"

say "1/5 generating a measured session: $locations places x $headings headings, $frames frames each"
rosrun mmradartwin_tests make_session.py --output "$out/session" --locations "$locations" --headings "$headings" \
  --frames "$frames" --seed "${DEMO_SEED:-$RANDOM}" --truth "$out/truth.json" --effect "${DEMO_EFFECT:-element_pattern}"

# A window where there is a display, a virtual one otherwise.
xvfb=
if [ -z "${DISPLAY:-}" ]; then
  for n in $(seq 90 120); do [ -e "/tmp/.X11-unix/X$n" ] || break; done
  Xvfb ":$n" -screen 0 1600x960x24 +extension GLX >/dev/null 2>&1 &
  xvfb=$!
  export DISPLAY=:$n LIBGL_ALWAYS_SOFTWARE=1
  say "no display: rviz runs on a virtual one (:$n)"
fi
# picture FILE: what rviz shows now; fails where there is no rviz yet.
picture() {
  local id
  id=$(xwininfo -root -tree 2>/dev/null | awk '/ - RViz"/ {print $1; exit}')
  [ -n "$id" ] || return 1
  [ -n "$xvfb" ] && id=root
  import -window "$id" "$1" 2>/dev/null
}

# watch PLAYER FILE: waits for the launch. The last picture taken while its node PLAYER runs is the one that stays: that
# node's end ends the launch, and what rviz shows then is on its way out.
watch() {
  while kill -0 "$launch" 2>/dev/null; do
    sleep 3
    if picture "$out/.rviz.png" && pgrep -P "$launch" -f "__name:=$1" >/dev/null; then mv -f "$out/.rviz.png" "$2" || true; fi
  done
  rm -f "$out/.rviz.png"
  wait "$launch" || true
  launch=
}

launch=
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

say "2/5 playing it over UDP at the real pace: driver, signal chain, twin, attribution and rviz run live"
# shellcheck disable=SC2086 # several arguments
roslaunch -p "$port" mmradartwin_launch demo.launch session:="$out/session" bag:="$out/demo.bag" \
  average_frames:="$frames" ${DEMO_ARGS:-} &
launch=$!
watch session_player "$out/rviz.png"
say "the session was played to its end"

bag=$out/demo.bag
[ -f "$bag" ] || { printf 'error: %s was not recorded; the messages above say why\n' "$bag" >&2; exit 1; }

say "3/5 evaluating the recording"
status=0
rosrun mmradartwin_attribution evaluate "$bag" --output "$out/report" || status=$?

say "4/5 what does the twin get wrong? (the answer is in $out/truth.json, which nothing before the end reads)"
rosrun mmradartwin_attribution diagnose "$out/session" --output "$out/diagnosis" || status=$?

say "5/5 the recording again, with the extended twin: rviz, then the report"
extended=$out/diagnosis/twin.extended.yaml
# shellcheck disable=SC2086 # several arguments
roslaunch -p "$port" mmradartwin_launch replay.launch bag:="$bag" twin:="$extended" average_frames:="$frames" \
  diagnosis:=false stay:=false ${DEMO_ARGS:-} &
launch=$!
watch player "$out/rviz_extended.png"
if [ -f "$out/rviz.png" ] && [ -f "$out/rviz_extended.png" ]; then
  convert "$out/rviz.png" "$out/rviz_extended.png" -append "$out/rviz_before_after.png"
fi
rosrun mmradartwin_attribution evaluate "$bag" --twin "$extended" --output "$out/report_extended" --no-bag || status=$?

answer=$(python3 - "$out/truth.json" "$out/diagnosis/findings.json" <<'PYTHON' || true
import json, sys

def told(causes):
    numbers = lambda v: f"{v:.3g}" if isinstance(v, float) else str(v)
    return "; ".join(c["cause"] + "".join(f", {k} {numbers(v)}" for k, v in c["parameters"].items()) for c in causes) or "nothing"

hidden = json.load(open(sys.argv[1]))["effects"]
found = json.load(open(sys.argv[2]))["findings"]
for f in found:
    f["parameters"] = {k: p["value"] for k, p in f["parameters"].items()}
print(f"   hidden         {told(hidden)}\n   found          {told(found)}")
PYTHON
)
cat >&2 <<TEXT
$answer
   report         $out/report/index.html
   diagnosis      $out/diagnosis/index.html
   after it       $out/report_extended/index.html
   rviz           $out/rviz_before_after.png
   recording      $bag        (replay: ./run.sh exec roslaunch mmradartwin_launch replay.launch bag:=$bag)
   session        $out/session
TEXT
exit "$status"
