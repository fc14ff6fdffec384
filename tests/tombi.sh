#!/usr/bin/env bash
# Checks every shipped TOML file against its JSON Schema with tombi, a TOML toolkit from the Python
# registry that shares no code with rungd. Called by .ci/run with the path of rungd. Needs `tombi` on
# the PATH.
set -euo pipefail
rungd="$(realpath "$1")"
cd "$(dirname "$0")/.."
at="$(mktemp -d)"
trap 'rm -rf "$at"' EXIT
cp -r config "$at/config"
for kind in ladder controller test edge opcua; do "$rungd" schema "$kind" >"$at/$kind.schema.json"; done
# tombi uses the first schema whose pattern matches; a `*` matches `/` too.
cat >"$at/tombi.toml" <<'TOML'
toml-version = "v1.0.0"

[schema]
enabled = true

[[schemas]]
path = "test.schema.json"
include = ["**/*.test.toml"]

[[schemas]]
path = "controller.schema.json"
include = ["config/tests/*-bench.toml", "config/first/controller.toml"]

[[schemas]]
path = "ladder.schema.json"
include = ["config/programs/*.toml", "config/lib/*.toml", "config/first/programs/*.toml", "config/tests/*-drive.toml", "config/tests/*-water.toml"]

[[schemas]]
path = "edge.schema.json"
include = ["config/edge/edge.toml"]

[[schemas]]
path = "opcua.schema.json"
include = ["config/edge/opcua.toml"]

[[schemas]]
path = "controller.schema.json"
include = ["config/*.toml"]
TOML
cd "$at"
tombi lint --offline --error-on-warnings config
# The control: a file that breaks its schema is refused.
printf 'ladder = ["a.toml"]\nscenarios = 1\n' >config/wrong.test.toml
if tombi lint --offline --error-on-warnings config/wrong.test.toml >/dev/null 2>&1; then
    echo "tombi accepts a key that no schema has" >&2
    exit 1
fi
