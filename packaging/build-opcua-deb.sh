#!/usr/bin/env bash
# Builds the OPC UA server, and packs it into a Debian package of its own. The last line of the output is
# the path of the package.
#
#   packaging/build-opcua-deb.sh               # target/debian/rungd-opcua_VERSION-1_ARCH.deb
#
#   RUNGD_PROFILE=release    a profile of Cargo.toml that builds faster (default: dist)
#
# Needs: cargo-deb (cargo install --locked cargo-deb), dpkg-dev, binutils.
set -euo pipefail
cd "$(dirname "$0")/.."

profile="${RUNGD_PROFILE:-dist}"
made="${CARGO_TARGET_DIR:-target}/$profile/packaging-opcua"

cargo build --locked --profile "$profile" -p rungd-opcua
rm -rf "$made"
mkdir -p "$made"
packaging/third-party.sh rungd-opcua >"$made/third-party-licences.txt"
gzip -9nc CHANGELOG.md >"$made/changelog.gz"

cargo deb --profile "$profile" --no-build --strip -p rungd-opcua
