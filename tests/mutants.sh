#!/usr/bin/env bash
# The mutation check of src/engine: runs cargo mutants on the part of the crate that the engine's
# tests need. Without the daemon, the drivers and the binary a mutant takes seconds. Further
# arguments go to cargo mutants: tests/mutants.sh --shard 0/10
set -euo pipefail
cd "$(dirname "$0")/.."

part="${TMPDIR:-/tmp}/rungd-mutants"
modules=(check engine isa lower resolve sim source)
mkdir -p "$part"
rm -rf "$part/src" "$part/tests" "$part/docs" "$part/.cargo"
mkdir -p "$part/src" "$part/tests"
cp -r .cargo docs Cargo.lock "$part/"
cp -r "${modules[@]/#/src/}" "$part/src/"
cp -r tests/semantics tests/semantics.rs tests/support tests/engine "$part/tests/"
{
    echo "//! The part of rungd that the tests of the engine need."
    printf 'pub mod %s;\n' "${modules[@]}"
} > "$part/src/lib.rs"
cat > "$part/Cargo.toml" <<'END'
[package]
name = "rungd"
version = "0.1.0"
edition = "2024"

[lib]
test = false
doctest = false

[dependencies]
annotate-snippets = "0.12"
toml = { version = "1", default-features = false, features = ["std", "parse"] }

[[test]]
name = "semantics"
harness = false

[profile.mutants]
inherits = "dev"
debug = 0

[workspace]
END

unset CARGO_TARGET_DIR
RUNGD_PROPERTY_PROGRAMS="${RUNGD_PROPERTY_PROGRAMS:-40}" \
    cargo mutants --dir "$part" --output "$part" --jobs "$(nproc)" "$@"
