#!/bin/sh
# Processor instructions per rung and scan, counted by callgrind: the engine, and the straight-line
# native code.
#
# Each program runs with two numbers of scans, with and without the scans themselves. The differences
# leave out loading and all other work around the scans. Counts repeat exactly; times do not.
# Needs valgrind. Usage: benches/instructions.sh [WORKLOAD [N]]
set -eu
cd "$(dirname "$0")/.."
target=${CARGO_TARGET_DIR:-target}
only=${1:-}
size=${2:-1000}
few=20
many=120

cargo build --locked --quiet --profile bench -p rungd-speed
program=$target/release/speed
log=$target/instructions.log

# count WORKLOAD N SIDE SCANS
count() {
    valgrind --tool=callgrind --callgrind-out-file=/dev/null "$program" "$1" --n "$2" \
        --side "$3" --scans "$4" 2>"$log" || { cat "$log" >&2; exit 1; }
    sed -n 's/.*Collected : //p' "$log"
}

# one WORKLOAD N RUNGS-PER-SCAN
one() {
    case $1 in *"$only"*) ;; *) return ;; esac
    # A separate run compiles the straight-line code first.
    "$program" "$1" --n "$2" --side native --scans 1
    for pair in native/native-outside engine/outside; do
        side=${pair%/*}
        outside=${pair#*/}
        scans=$(($(count "$1" "$2" "$side" $many) - $(count "$1" "$2" "$side" $few)))
        rest=$(($(count "$1" "$2" "$outside" $many) - $(count "$1" "$2" "$outside" $few)))
        eval "$side=$((scans - rest))"
    done
    echo "$1 $2 $3 $native $engine" | awk -v scans=$((many - few)) '{
        printf "%-11s %6d %10.1f %10.1f %8.2f\n",
            $1, $2, $4 / scans / $3, $5 / scans / $3, $5 / $4 }'
}

echo "workload         n     native     engine    ratio   (instructions a rung a scan)"
one W-order "$size" "$size"
one W-shuffled "$size" "$size"
one W-contacts "$size" "$size"
one W-chain-30 "$size" "$size"
one W-chain-60 "$size" "$size"
one S-stages "$size" $((size * 4))
