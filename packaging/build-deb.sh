#!/usr/bin/env bash
# Makes the Debian package: the program, its manual pages, completions and schemas, and then the
# .deb of them. The last line of the output is its path.
#
#   packaging/build-deb.sh                     # target/debian/rungd_VERSION-1_ARCH.deb
#   packaging/build-deb.sh --version 0.1.1-1   # a later version, to test an upgrade
#   packaging/build-deb.sh --output DIR        # elsewhere; target/debian holds the last one only
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

built="${CARGO_TARGET_DIR:-target}/release"
made="$built/packaging"

cargo build --locked --release --bin rungd
rm -rf "$made"
mkdir -p "$made/completions" "$made/schema"
rungd="$built/rungd"
"$rungd" man "$made/man"
"$rungd" completions bash >"$made/completions/rungd"
"$rungd" completions zsh >"$made/completions/_rungd"
"$rungd" completions fish >"$made/completions/rungd.fish"
for kind in ladder controller test edge; do
    "$rungd" schema "$kind" >"$made/schema/$kind.schema.json"
done
packaging/third-party.sh >"$made/third-party-licences.txt"
packaging/sbom.sh >"$made/rungd.cdx.json"

[ -n "$version" ] || version="$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)-1"
# The changes are those of CHANGELOG.md; Debian requires a file in its own format with the version.
gzip -9nc >"$made/changelog.Debian.gz" <<EOF
rungd ($version) unstable; urgency=medium

  * What changed stands in /usr/share/doc/rungd/changelog.gz.

 -- The rungd authors <authors@rungd.invalid>  $(date -uR -d "@$(git log -1 --format=%ct 2>/dev/null || echo 0)")
EOF
gzip -9nc CHANGELOG.md >"$made/changelog.gz"
gzip -9n "$made"/man/*.1

cargo deb --no-build --deb-version "$version" --strip "${options[@]}"
