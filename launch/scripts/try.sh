#!/usr/bin/env bash
# A first finding: a small session of an office in which an object stands elsewhere than the scene says, and its diagnosis.
# usage: try.sh OUTPUT [SAMPLE]       SAMPLE: a folder with session/ and truth.json, taken instead of a new session
set -euo pipefail

case ${1:-} in
  --help | -h) sed -n '2,3s/^# //p' "${BASH_SOURCE[0]}"; exit 0 ;;
  --version) echo "try.sh $(rosversion mmradartwin_launch)"; exit 0 ;;
  '' | -*) echo 'error: usage: try.sh OUTPUT [SAMPLE]' >&2; exit 2 ;;
esac
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
# shellcheck disable=SC1091
source "$here/stages.sh"

out=$(readlink -m "$1")
sample=${2:-}
log=$out/log
started=$SECONDS
# shellcheck disable=SC2034 # read by stage
stages=2

if [ -n "$sample" ]; then
  if [ ! -f "$sample/session/session.yaml" ] || [ ! -f "$sample/truth.json" ]; then
    die "$sample: must hold session/ and truth.json"
  fi
  [ "$(readlink -m "$sample")" != "$out" ] || die "$out: is the sample itself; name another folder"
fi
own_folder "$out" .mmradartwin_try session sample.bag truth.json diagnosis log
mkdir -p "$log"
if [ -n "$sample" ]; then
  stage "Sample: $sample"
  cp -r "$sample/session" "$sample/truth.json" "$out/"
else
  stage "Measuring: the generator writes raw captures of an office at 6 places in 2 directions each. It moves an object."
  logged "$log/1_generate.log" unknown "generating the session" rosrun mmradartwin_tests make_session.py \
    --output "$out/session" --truth "$out/truth.json" --locations 6 --headings 2 --frames 20 --seed 5 \
    --effect actor_moved --param actor=cabinet_north --param dx_m=0 --param dy_m=-0.25
fi
logged "$log/1_bag.log" unknown "writing the bag" rosrun mmradartwin_dsp session_to_bag "$out/session" "$out/sample.bag"

stage "Diagnosis: what does the twin get wrong? Each mechanism of the simulator is tried."
logged "$log/2_diagnose.log" unknown "the diagnosis" rosrun mmradartwin_attribution diagnose "$out/session" --output "$out/diagnosis"

say ""
status=0
python3 "$here/tell_result.py" "$out/truth.json" "$out/diagnosis/findings.json" || status=$?
cat <<TEXT

Open this page:  $out/diagnosis/report.html
The measurement: $out/session, as a bag $out/sample.bag
In rviz:         ./run.sh exec roslaunch mmradartwin_launch replay.launch bag:=$out/sample.bag
$((SECONDS - started)) s.
TEXT
exit "$status"
