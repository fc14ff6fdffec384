#!/usr/bin/env bash
# The mutation check of the encoder of proofs: cargo mutants changes the gates of a scan (crates/prove/src:
# encode/, gates, aig) in one place at a time, and the tests that compare the gates with the engine, and
# deducing with exploring, must notice. A mutant takes half a minute, all of them some hours, so choose a part:
#
#   tests/prove_mutants.sh --sharding round-robin --shard 0/7
#   tests/prove_mutants.sh --file crates/prove/src/encode/timers.rs
#
# Needs: cargo install --locked cargo-mutants
set -euo pipefail
cd "$(dirname "$0")/.."

parts=(--file 'crates/prove/src/encode/**' --file 'crates/prove/src/gates*.rs' --file 'crates/prove/src/aig*' --file 'crates/prove/src/aig/**')
for argument; do [ "$argument" != --file ] || parts=(); done

# What explores only does not look at gates. `.cargo/mutants.toml` is for the engine.
CARGO_INCREMENTAL=1 cargo-mutants mutants --no-config --output "${TMPDIR:-/tmp}/rungd-prove-mutants" \
    --package rungd-prove --test-package rungd-prove --timeout 600 "${parts[@]}" "$@" \
    -- --lib --test it -- --skip prove::explore
