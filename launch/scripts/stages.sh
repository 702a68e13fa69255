# Sourced by run.sh, demo.sh and try.sh: work in stages, whose output goes to files and whose progress to the terminal.
# shellcheck shell=bash

say() { printf '%s\n' "$*" >&2; }
die() { say "error: $*"; exit 2; }

# own_folder FOLDER MARK NAME...: makes the folder and removes NAMEs of an earlier run in it, which left the file MARK. Where
# that is not there, a NAME in it is somebody else's, and all stays.
own_folder() {
  local folder=$1 mark=$2 name
  shift 2
  if [ ! -e "$folder/$mark" ]; then
    for name in "$@"; do
      [ ! -e "$folder/$name" ] || die "$folder: holds a '$name' that is not of an earlier run; name another folder"
    done
  fi
  if ! { mkdir -p "$folder" && touch "$folder/$mark"; } 2>/dev/null; then
    die "$folder: no folder can be made or written there"
  fi
  for name in "$@"; do rm -rf "${folder:?}/$name"; done
}

# stage TEXT: the heading of the next stage; `stages` holds how many there are.
stage_number=0
stage() {
  stage_number=$((stage_number + 1))
  say "[$stage_number/${stages:-$stage_number}] $*"
}

# follow LOG PERCENT: says how far it is while LOG grows: PERCENT, a command that is given LOG, prints a number and may
# print words behind it. A terminal shows each change in one line, a file a line at each quarter.
follow() {
  local log=$1 percent=$2 told=-1 number words
  while kill -0 $$ 2>/dev/null; do
    sleep 1
    read -r number words < <("$percent" "$log" 2>/dev/null) || continue
    if [ -t 2 ]; then
      [ "$number" -eq "$told" ] || printf '\r\033[K      %s %%%s' "$number" "${words:+ $words}" >&2
      told=$number
    elif [ $((number / 25)) -gt $((told / 25)) ] && [ "$number" -ge 25 ]; then
      say "      $number %${words:+ $words}"
      told=$number
    fi
  done
}

# stop_following PID: ends a follow and clears its line.
stop_following() {
  kill "$1" 2>/dev/null || true
  wait "$1" 2>/dev/null || true
  [ ! -t 2 ] || printf '\r\033[K' >&2
}

# of_make, of_poses, of_apt, unknown: PERCENT of follow.
of_make() { tail -c 20000 "$1" | grep -o '^\[ *[0-9]*%\]' | tail -n 1 | tr -dc '0-9\n'; }
of_poses() {
  tail -c 20000 "$1" | grep -o 'pose [0-9]* of [0-9]*' | tail -n 1 |
    awk '{print int(100 * ($2 - 1) / $4), "(" $0 ")"}'
}
# Each of $apt_packages is unpacked and set up.
apt_packages=0
of_apt() { awk -v steps=$((2 * apt_packages)) '/^(Unpacking|Setting up)/ {n++} END {if (steps) print int(100 * n / steps)}' "$1"; }
unknown() { :; }

# show_failure LOG STATUS WHAT: the end of the log and where the rest is.
show_failure() {
  say "error: $3 has failed (status $2). The last 30 lines of $1:"
  tail -n 30 "$1" | sed 's/^/    /' >&2
}

# logged LOG PERCENT WHAT COMMAND...: COMMAND with its output in LOG. Where it fails, the end of LOG is shown.
logged() {
  local log=$1 percent=$2 what=$3 status=0 follower
  shift 3
  mkdir -p "$(dirname "$log")"
  : >"$log"
  follow "$log" "$percent" &
  follower=$!
  "$@" >"$log" 2>&1 || status=$?
  stop_following "$follower"
  [ "$status" -eq 0 ] || show_failure "$log" "$status" "$what"
  return "$status"
}
