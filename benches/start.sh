#!/usr/bin/env bash
# Time from the start of the process `rungd run` to the end of its first scan, with the shuffled W(n)
# as its ladder: the elapsed time, and the processor time of the whole process, which depends less on
# other processes.
#
# usage: benches/start.sh [RUNGS [TIMES]]      (default 10000, 9)
#
# The run has one scan, and ends with the last line of its log. It prints medians.
set -eu

rungs=${1:-10000}
times=${2:-9}
here=$(cd "$(dirname "$0")/.." && pwd)
rungd=${RUNGD:-$here/target/release/rungd}
[ -x "$rungd" ] || { echo "no $rungd: cargo build --release, or set RUNGD" >&2; exit 1; }
TIMEFORMAT='%U %S'
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

(cd "$here" && cargo run --quiet --profile bench -p rungd-speed -- --print ladder --n "$rungs" shuffled) \
    >"$work/ladder.toml"
{
    echo 'ladder = ["ladder.toml"]'
    echo "scan = { period = \"1s\", watchdog = \"10s\" }"
    echo "memory = { C = $((rungs + 2048)), CT = $((rungs + 256)), T = $((rungs + 256)) }"
} >"$work/controller.toml"
n=0
while [ "$n" -lt "$times" ]; do
    begin=$(date +%s%N)
    { time "$rungd" run "$work/controller.toml" --scans 1 2>"$work/log"; } 2>>"$work/processor"
    end=$(date -d "$(grep -o '^[^ ]*' "$work/log" | tail -1)" +%s%N)
    grep -q 'STOP: the requested number of scans' "$work/log" || { cat "$work/log" >&2; exit 1; }
    echo $(((end - begin) / 1000)) >>"$work/times"
    n=$((n + 1))
done
median() { sort -n | awk '{ v[NR] = $1 } END { printf "%.0f", v[int((NR + 1) / 2)] }'; }
clock=$(awk '{ print $1 / 1000 }' "$work/times" | median)
processor=$(awk '{ print ($1 + $2) * 1000 }' "$work/processor" | median)
echo "$rungs rungs: $clock ms from start to the end of the first scan, $processor ms of processor"
