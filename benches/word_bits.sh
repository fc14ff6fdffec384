#!/bin/sh
# Processor instructions per rung and scan of a bit of a word beside a plain bit, counted by
# callgrind: rungs with two contacts and an OUT, of plain bits; with contacts on bits of words, each
# read by many rungs or by one (once); with OUTs to bits of words.
#
# Each program runs with two numbers of scans; the difference leaves out loading. Counts repeat
# exactly. Fails if a rung with bits of words costs more than twice the plain one.
# Needs valgrind. Usage: benches/word_bits.sh [RUNGS]
set -eu
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}
size=${1:-1000}
few=20
many=120

cargo build --locked --quiet --profile bench -p rungd-speed
log=$target/word_bits.log

# count KIND SCANS
count() {
    valgrind --tool=callgrind --callgrind-out-file=/dev/null "$target/release/speed" \
        --bits "$1" --n "$size" --scans "$2" 2>"$log" || { cat "$log" >&2; exit 1; }
    sed -n 's/.*Collected : //p' "$log"
}

for kind in plain contacts once outs; do
    echo "$kind $size $(($(count $kind $many) - $(count $kind $few)))"
done | awk -v scans=$((many - few)) '{
    each = $3 / scans / $2
    if ($1 == "plain") plain = each
    printf "%-9s %6d %8.1f instructions a rung a scan %6.2f\n", $1, $2, each, each / plain
    if (each > 2 * plain) failed = 1
} END { exit failed }'
