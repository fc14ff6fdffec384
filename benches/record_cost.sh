#!/bin/sh
# The daemon's scan times and wake-up lateness without the scan log on disk, with it, and with twenty
# lines of `[[watch]]` too, in the same minute.
#
# usage: benches/record_cost.sh [SECONDS [SECONDS_A_TURN]]      (default 60, 3)
#
# rungd runs without `--record`, with it, and with it and the lines in alternate turns of a few seconds: 500 rungs, a period
# of 1 ms, 100 inputs of which each changes at every scan. Turns are short and medians are used,
# because on a virtual machine the hypervisor makes the tail of any single turn. It prints the
# medians over the turns, and the times that the log adds.
set -eu

seconds=${1:-60}
turn=${2:-3}
here=$(cd "$(dirname "$0")/.." && pwd)
rungd=${RUNGD:-$here/target/release/rungd}
[ -x "$rungd" ] || { echo "no $rungd: cargo build --release, or set RUNGD" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

{
    printf '[[program]]\nname = "Main"\n'
    n=0
    while [ "$n" -lt 500 ]; do
        printf '[[program.rung]]\nwhen = ["X%d | Y%d", "!X%d"]\ndo = ["OUT Y%d"]\n' \
            $((n % 100)) "$n" $(((n + 7) % 100)) "$n"
        n=$((n + 1))
    done
} >"$work/ladder.toml"
policy='policy = "fifo"
priority = 80'
chrt -f 80 true 2>/dev/null || policy=
{
    cat <<CONTROLLER
ladder = ["ladder.toml"]

[scan]
period = "1ms"

[realtime]
$policy
cpu-latency = "0us"
CONTROLLER
    n=0
    while [ "$n" -lt 100 ]; do
        printf '[[simulated-device]]\ninput = "X%d"\npulse = "1ms"\nevery = "2ms"\n' "$n"
        n=$((n + 1))
    done
} >"$work/controller.toml"

{
    cat "$work/controller.toml"
    n=0
    while [ "$n" -lt 20 ]; do
        printf '[[watch]]\nname = "line %d"\nalways = "!(Y%d & X%d)"\n' "$n" "$n" $(((n + 7) % 100))
        n=$((n + 1))
    done
} >"$work/watched.toml"

turn() { # with|without|watched N FILE [OPTION ...]
    of=$1 at=$2 file=$3
    shift 3
    "$rungd" run "$work/$file" --scans $((turn * 1000)) --log-format json "$@" \
        2>"$work/log"
    grep 'statistics of the whole run' "$work/log" >"$work/$of.$at"
}

turns=$((seconds / turn / 3))
[ "$turns" -ge 1 ] || turns=1
n=0
while [ "$n" -lt "$turns" ]; do
    turn without "$n" controller.toml
    turn with "$n" controller.toml --record "$work/record"
    turn watched "$n" watched.toml --record "$work/record"
    n=$((n + 1))
done

median() { # with|without|watched FIELD
    sed -n "s/.*\"$2\":\([0-9.]*\).*/\1/p" "$work/$1".* | sort -n |
        awk '{ v[NR] = $1 } END { print (v[int((NR + 1) / 2)] + v[int((NR + 2) / 2)]) / 2 }'
}
echo "$turns turns of $turn s each; medians over the turns, us"
printf '%-14s %8s %8s %8s %8s\n' '' 'scan p50' p99 'late p50' p99
for of in without with watched; do
    printf '%-14s %8s %8s %8s %8s\n' "$of" "$(median $of scan_us_p50)" \
        "$(median $of scan_us_p99)" "$(median $of late_us_p50)" "$(median $of late_us_p99)"
done
