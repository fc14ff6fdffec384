#!/usr/bin/env bash
# Runs the README's test command again and again beside busy loops, to find tests that a busy machine
# fails. Prints a line for each round: its result, its seconds, the longest time for which the machine
# let a woken process wait (a control), and the tests that failed.
#
#   tests/rounds.sh [ROUNDS [LOOPS [ARGUMENT of cargo test…]]]       # 20 rounds beside 4 loops
#
# The tests are built before the first round, without the loops. Exit code 1: a round failed; its
# output is in target/rounds/N.log. A round takes several minutes: build nothing else meanwhile.
#
# Linux 6.18 can let kernel threads and other sessions wait for a minute while a session keeps all
# processors busy for long (entities of a group whose virtual time is not tracked). If the control shows
# seconds, run `echo 0 >/proc/sys/kernel/sched_autogroup_enabled` before this script.
set -euo pipefail
cd "$(dirname "$0")/.."

rounds="${1:-20}" loops="${2:-4}"
shift $(($# < 2 ? $# : 2))
logs="${CARGO_TARGET_DIR:-target}/rounds"
mkdir -p "$logs"
cargo test --locked --no-run --quiet

busy=()
trap '[ ${#busy[@]} = 0 ] || kill "${busy[@]}" 2>/dev/null' EXIT
for ((loop = 0; loop < loops; loop++)); do
    while :; do :; done &
    busy+=($!)
done

# Appends the delay of each sleep of 100 ms to the file `$1`, in ms. Runs in a session of its own.
delay() {
    local begin now
    while :; do
        begin="${EPOCHREALTIME/[^0-9]/}"
        sleep 0.1
        now="${EPOCHREALTIME/[^0-9]/}"
        echo $(((now - begin) / 1000 - 100)) >>"$1"
    done
}
export -f delay
delays="$logs/delays"
setsid bash -c 'delay "$1"' - "$delays" &
busy+=($!)

failures=0
for ((round = 1; round <= rounds; round++)); do
    begin=$SECONDS result=passed
    : >"$delays"
    cargo test --locked --no-fail-fast "$@" >"$logs/$round.log" 2>&1 || result=FAILED
    [ "$result" = passed ] || failures=$((failures + 1))
    failed="$(sed -n 's/^test \(.*\) \.\.\. FAILED$/\1/p' "$logs/$round.log" | tr '\n' ' ')"
    printf 'round %s: %s in %s s; load %s, delays up to %s ms %s\n' "$round" "$result" \
        $((SECONDS - begin)) "$(cut -d ' ' -f 1 /proc/loadavg)" "$(sort -n "$delays" | tail -n 1)" "$failed"
done
[ "$failures" = 0 ]
