#!/usr/bin/env bash
# Builds the program, its manual pages, completions and schemas, and packs them into the Debian
# package. The last line of the output is the path of the package.
#
#   packaging/build-deb.sh                     # target/debian/rungd_VERSION-1_ARCH.deb
#   packaging/build-deb.sh --version 0.1.1-1   # a later version, to test an upgrade
#   packaging/build-deb.sh --output DIR        # in DIR; target/debian keeps only the last package
#
#   RUNGD_PROFILE=release    a profile of Cargo.toml that builds faster (default: dist)
#
# Needs: cargo-deb (cargo install --locked cargo-deb), dpkg-dev, binutils.
set -euo pipefail
cd "$(dirname "$0")/.."

version=
options=()
while [ $# -gt 0 ]; do
    case "$1" in
    --version) version="$2"; shift 2 ;;
    --output) options+=(--output "$2"); shift 2 ;;
    *) echo "build-deb.sh: unknown argument $1" >&2; exit 2 ;;
    esac
done

profile="${RUNGD_PROFILE:-dist}"
built="${CARGO_TARGET_DIR:-target}/$profile"
made="$built/packaging"

cargo build --locked --profile "$profile" --bin rungd
rm -rf "$made"
mkdir -p "$made/completions" "$made/schema"
rungd="$built/rungd"
"$rungd" man "$made/man"
"$rungd" completions bash >"$made/completions/rungd"
"$rungd" completions zsh >"$made/completions/_rungd"
"$rungd" completions fish >"$made/completions/rungd.fish"
for kind in ladder controller test edge opcua; do
    "$rungd" schema "$kind" >"$made/schema/$kind.schema.json"
done
packaging/third-party.sh >"$made/third-party-licences.txt"
packaging/sbom.sh >"$made/rungd.cdx.json"

[ -n "$version" ] || version="$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)-1"
# Debian requires a changelog in its own format; it has the version and refers to CHANGELOG.md.
gzip -9nc >"$made/changelog.Debian.gz" <<EOF
rungd ($version) unstable; urgency=medium

  * What changed stands in /usr/share/doc/rungd/changelog.gz.

 -- The rungd authors <authors@rungd.invalid>  $(date -uR -d "@$(git log -1 --format=%ct 2>/dev/null || echo 0)")
EOF
gzip -9nc CHANGELOG.md >"$made/changelog.gz"
gzip -9n "$made"/man/*.1

cargo deb --profile "$profile" --no-build --deb-version "$version" --strip "${options[@]}"
