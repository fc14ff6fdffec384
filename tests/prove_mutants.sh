#!/usr/bin/env bash
# The mutation check of the encoder of proofs: cargo mutants changes the gates of a scan (crates/prove/src:
# encode/, gates, aig) in one place at a time, and the tests that compare the gates with the engine, and
# deducing with exploring, must notice. The short comparisons come first, and the first failure ends a mutant:
# most take ten seconds, one that is not noticed half a minute. All of them take some hours, so choose a part:
#
#   tests/prove_mutants.sh --sharding round-robin --shard 0/16
#   tests/prove_mutants.sh --file crates/prove/src/encode/timers.rs
#
# Needs: cargo install --locked cargo-mutants
set -euo pipefail

# Cargo executes the tests by this script too: `judge BINARY …`.
if [ "${1:-}" = judge ]; then
    binary="$2"
    # The first failure ends a part; the processor time of each part is limited, because a mutant may never end.
    part() { # SECONDS TEST…
        (ulimit -t "$1" && shift && RUSTC_BOOTSTRAP=1 RUST_TEST_THREADS=2 exec "$binary" -Zunstable-options --fail-fast "$@")
    }
    RUNGD_PROVE_PROGRAMS=8 part 20 prove::encoded::gates_of_random
    part 60 prove::encoded::gates_of_random prove::encoded::an_acc prove::encoded::gates_of_a_ladder prove::encoded::whether prove::encoded::a_period \
        prove::aig prove::alike
    part 60 prove::encoded::gates_of_the_ladder
    part 150 prove::ways prove::given prove::environment prove::events prove::judged prove::mistake prove::equal prove::cone \
        prove::device_loss
    exit
fi

script="$(realpath "$0")"
cd "$(dirname "$script")/.."

parts=(--file 'crates/prove/src/encode/**' --file 'crates/prove/src/gates*.rs' --file 'crates/prove/src/aig*' --file 'crates/prove/src/aig/**')
for argument; do [ "$argument" != --file ] || parts=(); done

host="$(rustc -vV | sed -n 's/^host: //p' | tr 'a-z-' 'A-Z_')"
export "CARGO_TARGET_${host}_RUNNER=$script judge"
# `.cargo/mutants.toml` is for the engine.
CARGO_INCREMENTAL=1 cargo-mutants mutants --no-config --output "${TMPDIR:-/tmp}/rungd-prove-mutants" \
    --package rungd-prove --test-package rungd-prove --timeout 900 -C=--test=it "${parts[@]}" "$@"
