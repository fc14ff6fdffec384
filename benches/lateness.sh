#!/bin/sh
# Wake-up lateness of rungd's scan thread compared with cyclictest's, in the same minute.
#
# usage: [PERIOD_US=1000] [SPIN_US=0] benches/lateness.sh [SECONDS [SECONDS_A_TURN]]      (default 60, 3)
#
# cyclictest (apt: rt-tests) and rungd run in alternate turns of a few seconds, with the same posture:
# SCHED_FIFO 80, timer slack 1 ns, /dev/cpu_dma_latency held at 0 (cyclictest holds it by itself).
# If SCHED_FIFO is not permitted, both run without it. Turns are short and medians are used, because on
# a virtual machine the hypervisor makes the tail of any single turn. It prints the medians over the
# turns of each program, and the ratio of the p99s; the aim is 1.2. With SPIN_US rungd is awake so long before each
# scan.
set -eu

seconds=${1:-60}
turn=${2:-3}
period=${PERIOD_US:-1000}
spin=${SPIN_US:-0}
here=$(cd "$(dirname "$0")/.." && pwd)
rungd=${RUNGD:-$here/target/release/rungd}
[ -x "$rungd" ] || { echo "no $rungd: cargo build --release, or set RUNGD" >&2; exit 1; }
command -v cyclictest >/dev/null || { echo "no cyclictest: apt install rt-tests" >&2; exit 1; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cat >"$work/ladder.toml" <<'LADDER'
[[program]]
name = "Main"

[[program.rung]]
when = ["$On"]
do   = ["OUT Y0"]
LADDER
priority=80
policy='policy = "fifo"
priority = 80'
chrt -f 80 true 2>/dev/null || { priority=0 policy=; }
cat >"$work/controller.toml" <<CONTROLLER
ladder = ["ladder.toml"]

[scan]
period   = "${period}us"

[realtime]
$policy
cpu-latency = "0us"
spin = "${spin}us"
CONTROLLER

# Percentiles of cyclictest's histograms (a value in us and its count on each line), of all turns.
percentiles() {
    cat "$@" | grep -E '^[0-9]' | awk '
        { count[$1 + 0] += $2; total += $2; if ($1 + 0 > last) last = $1 + 0 }
        END {
            split("500 990 999", wanted)
            for (n = 1; n <= 3; n++) {
                seen = 0
                for (us = 0; us <= last; us++) {
                    seen += count[us]
                    if (seen * 1000 >= total * wanted[n]) break
                }
                printf "%s ", us
            }
            print total
        }'
}

# rungd reports the percentiles of each turn; the result is their median over the turns.
field() {
    sed -n "s/.*\"$1\":\([0-9.]*\).*/\1/p" "$work"/rungd.* | sort -n |
        awk '{ v[NR] = $1 } END { print (v[int((NR + 1) / 2)] + v[int((NR + 2) / 2)]) / 2 }'
}

turns=$((seconds / turn / 2))
[ "$turns" -ge 1 ] || turns=1
n=0
while [ "$n" -lt "$turns" ]; do
    cyclictest --quiet --mlockall --priority=$priority --interval="$period" --threads=1 \
        --duration="$turn" --histogram=20000 >"$work/cyclictest.$n" 2>/dev/null
    percentiles "$work/cyclictest.$n" >"$work/turn.$n"
    "$rungd" run "$work/controller.toml" --scans $((turn * 1000000 / period)) --log-format json \
        2>"$work/log.$n"
    grep 'statistics of the whole run' "$work/log.$n" >"$work/rungd.$n"
    n=$((n + 1))
done

median() {
    cut -d' ' -f"$1" "$work"/turn.* | sort -n |
        awk '{ v[NR] = $1 } END { print (v[int((NR + 1) / 2)] + v[int((NR + 2) / 2)]) / 2 }'
}
sed -n 's/.*"granted":"\([^"]*\)".*/posture of rungd: \1/p' "$work/log.0"
echo "$turns turns of $turn s each; medians over the turns, us"
printf '%-12s %8s %8s %8s\n' '' p50 p99 p99.9
printf '%-12s %8s %8s %8s\n' cyclictest "$(median 1)" "$(median 2)" "$(median 3)"
printf '%-12s %8s %8s %8s\n' rungd \
    "$(field late_us_p50)" "$(field late_us_p99)" "$(field late_us_p999)"
awk -v ours="$(field late_us_p99)" -v theirs="$(median 2)" \
    'BEGIN { printf "p99 ratio: %.2f (aim: at most 1.2)\n", ours / theirs }'
