#!/usr/bin/env bash
# Makes rungd.vsix, the extension for VS Code: tests it, bundles it with its language client, adds
# the schemas that `rungd schema` prints and the licences, and packs it with vsce.
# Called by people and by .ci/run. Needs node 20 or newer, npm and its registry, and rungd: the
# first argument, else the one on the PATH, else the one of this clone, which is built if it is not
# there. The schemas and the tests are of this rungd: it must be of the clone's version.
set -euo pipefail
here="$(cd "$(dirname "$0")" && pwd)"
root="$here/../.."
out="${RUNGD_VSIX:-$root/target/rungd.vsix}"

rungd="${1:-$(command -v rungd || true)}"
if [ -z "$rungd" ]; then
    rungd="${CARGO_TARGET_DIR:-$root/target}/debug/rungd"
    [ -x "$rungd" ] || cargo build --locked --quiet --manifest-path "$root/Cargo.toml"
fi
rungd="$(realpath "$rungd")"
version="$(sed -n 's/^version *= *"\(.*\)"/\1/p' "$root/Cargo.toml" | head -n 1)"
case "$("$rungd" --version)" in
"rungd $version" | "rungd $version "*) ;;
*)
    echo "$rungd is $("$rungd" --version), and this clone is of $version: name its rungd, as" >&2
    echo "  cargo build --release && $0 target/release/rungd" >&2
    exit 1
    ;;
esac
echo "with $rungd" >&2
mkdir -p "$(dirname "$out")"
out="$(realpath -m "$out")"

at="$(mktemp -d)"
trap 'rm -rf "$at"' EXIT

node "$here/test.js" "$rungd"

# Exactly the versions and checksums of package-lock.json, and no scripts of packages.
cp -r "$here/." "$at/"
rm -rf "$at/node_modules" "$at/.npmrc"
cd "$at"
npm ci --ignore-scripts --no-audit --no-fund --loglevel=error

mkdir schemas
for kind in ladder controller test; do "$rungd" schema "$kind" >"schemas/$kind.schema.json"; done
cp "$root/LICENSE-MIT" "$root/LICENSE-APACHE" .

# The bundle has parts of other projects: with their licences.
node_modules/esbuild/bin/esbuild extension.js --bundle --platform=node --target=node18 \
    --external:vscode --minify --log-level=warning --metafile=meta.json --outfile=dist/main.js
node >LICENSE-THIRD-PARTY.txt <<'JS'
const fs = require('node:fs');
const inputs = Object.keys(JSON.parse(fs.readFileSync('meta.json')).inputs);
const packages = inputs.map((name) => /^(.*node_modules\/(?:@[^/]+\/)?[^/]+)\//.exec(name)?.[1]);
for (const folder of [...new Set(packages.filter(Boolean))].sort()) {
    const { name, version, license } = JSON.parse(fs.readFileSync(`${folder}/package.json`));
    const file = fs.readdirSync(folder).find((entry) => /^licen[cs]e/i.test(entry));
    if (!file) throw new Error(`${name} has no text of its licence`);
    console.log(`${name} ${version}, ${license}\n\n${fs.readFileSync(`${folder}/${file}`)}\n`);
}
JS
node "$here/test.js" "$rungd" "$at/dist/main.js"

# What VS Code loads is the bundle: nothing of node_modules is packed.
node -e '
const fs = require("node:fs");
const manifest = JSON.parse(fs.readFileSync("package.json"));
manifest.main = "./dist/main.js";
delete manifest.dependencies;
delete manifest.devDependencies;
fs.writeFileSync("package.json", JSON.stringify(manifest, null, 2));'
node node_modules/@vscode/vsce/vsce package --no-dependencies --skip-license \
    --allow-missing-repository --out "$out" >vsce.log || { cat vsce.log; exit 1; }

# What VS Code needs is in it, and what it does not need is not.
node -e '
const text = require("node:fs").readFileSync(process.argv[1]).toString("latin1");
const needed = ["package.json", "dist/main.js", "schemas/ladder.schema.json", "readme.md",
    "snippets/ladder.json", "icons/test-dark.svg", "toml.tmLanguage.json",
    "language-configuration.json", "LICENSE-MIT", "LICENSE-APACHE", "LICENSE-THIRD-PARTY.txt"];
const isPacked = (name) => text.includes(`extension/${name}`);
const lacking = needed.filter((name) => !isPacked(name));
const odd = ["kinds.js", "test", "node_modules", "package.sh"].filter(isPacked);
if (lacking.length + odd.length > 0) throw new Error(`lacking: ${lacking}; too many: ${odd}`);
' "$out"
echo "$out"
