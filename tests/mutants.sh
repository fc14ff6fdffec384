#!/usr/bin/env bash
# The mutation check of crates/engine/src: cargo mutants changes the engine in one place at a time, and the
# tests of the engine and of the semantics must notice. Each mutant builds the crate (without the
# optional features) and runs these tests: one or two minutes a mutant, so choose a part:
#
#   tests/mutants.sh --shard 0/100
#   tests/mutants.sh --file crates/engine/src/counters.rs
#
# Needs: cargo install --locked cargo-mutants
set -euo pipefail
cd "$(dirname "$0")/.."

RUNGD_PROPERTY_PROGRAMS="${RUNGD_PROPERTY_PROGRAMS:-40}" \
    cargo mutants --output "${TMPDIR:-/tmp}/rungd-mutants" --package rungd-engine \
    --test-package rungd --test-package rungd-engine --no-default-features "$@"
