#!/usr/bin/env bash
# The emulated rig as a node of live.launch: generates a session where none is given, then plays it behind an emulated
# AWR2243 and an emulated DCA1000, with its poses in tf. Needs root for the card's network.
# usage: emulated_rig.sh SESSION|generate [NODE_ARGUMENTS...]
set -euo pipefail

case ${1:-} in
  --help | -h)
    sed -n '2,4s/^# //p' "${BASH_SOURCE[0]}"
    printf 'Topics and parameters are those of session_player, with whole_rig true:\n\n'
    exec rosrun mmradartwin_driver session_player --help
    ;;
  --version) echo "emulated_rig.sh $(rosversion mmradartwin_launch)"; exit 0 ;;
esac
session=${1:-}
shift || true
say() { printf '== %s\n' "$*" >&2; }

if [ "$session" = generate ] || [ -z "$session" ]; then
  session=${XDG_CACHE_HOME:-$HOME/.cache}/mmradartwin/emulated_session
  if [ ! -f "$session/complete" ]; then
    say "first start: generating a session for the emulated rig in $session, about a minute"
    say "(session:=FOLDER plays another)"
    rm -rf "$session"
    mkdir -p "$(dirname "$session")"
    rosrun mmradartwin_tests make_session.py --output "$session" --seed 7 --locations 4 --headings 2 --frames 100 >&2
    touch "$session/complete"
  else
    say "playing the session that an earlier start generated: $session (remove it to have another)"
  fi
fi
exec rosrun mmradartwin_driver session_player "_session:=$session" "$@"
