#!/usr/bin/env bash
# Installs, upgrades, removes and purges the Debian package in a root directory of its own. Prints
# each result; the exit code is 0 if all results are as expected. No systemd runs here:
# tests/systemd.sh tests the running service.
#
#   tests/package.sh            # as root; builds the package by packaging/build-deb.sh
#
# mmdebstrap makes the root directory, which is kept as a tar file in $RUNGD_PACKAGE_CACHE
# (/var/tmp/rungd-package). The script installs mmdebstrap and lintian if they are missing.
set -euo pipefail
cd "$(dirname "$0")/.."

suite="${RUNGD_SUITE:-trixie}"
cache="${RUNGD_PACKAGE_CACHE:-/var/tmp/rungd-package}"
. tests/said.sh
not() { ! "$@"; }

step "tools"
missing=()
for tool in mmdebstrap lintian; do command -v "$tool" >/dev/null || missing+=("$tool"); done
if [ ${#missing[@]} -gt 0 ]; then
    (apt-get update -qq && apt-get install -y -qq "${missing[@]}") >/dev/null
fi
command -v cargo-deb >/dev/null || cargo install --locked --debug --quiet cargo-deb
saw "$(cargo deb --version | head -n 1)"

step "the package, twice"
packages="$(mktemp -d)"
trap 'rm -rf "$packages"' EXIT
first="$(packaging/build-deb.sh --version 0.2.0-1 --output "$packages/" 2>"$packages/log" | tail -n 1)"
second="$(packaging/build-deb.sh --version 0.2.0-2 --output "$packages/" 2>>"$packages/log" | tail -n 1)"
[ -e "$first" ] && [ -e "$second" ] || { cat "$packages/log"; exit 1; }
saw "$(basename "$first"): $(($(stat -c %s "$first") / 1024)) KiB, $(dpkg -c "$first" | wc -l) entries"
saw "$(dpkg -f "$first" Depends)"
lint="$(lintian "$first" 2>/dev/null || true)"
must "lintian finds nothing" test -z "$lint"
[ -z "$lint" ] || sed 's/^/   | /' <<<"$lint"
must "every manual page of a subcommand" test "$(dpkg -c "$first" | grep -c man1/rungd)" -ge 8
must "a bill of materials" grep -q "usr/share/doc/rungd/rungd.cdx.json" <(dpkg -c "$first")
must "conffiles are the configuration" test "$(dpkg -I "$first" conffiles | sort | tr '\n' ' ')" = \
    "/etc/needrestart/conf.d/rungd.conf /etc/rungd/controller.toml /etc/rungd/programs/main.toml "

step "a root directory: $suite"
mkdir -p "$cache"
if [ ! -e "$cache/$suite.tar" ]; then
    mmdebstrap --quiet --variant=minbase --include=systemd,init-system-helpers "$suite" "$cache/$suite.new.tar"
    mv "$cache/$suite.new.tar" "$cache/$suite.tar"
fi
root="$(mktemp -d)"
# shellcheck disable=SC2329
cleanup() {
    umount "$root/proc" 2>/dev/null || true
    rm -rf --one-file-system "$root" "$packages"
}
trap cleanup EXIT
tar -C "$root" -xf "$cache/$suite.tar"
mount -t proc proc "$root/proc"
# The test needs the files that dpkg leaves out on small systems.
rm -f "$root"/etc/dpkg/dpkg.cfg.d/*
cp "$first" "$second" "$root/root/"
inside() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
# All files of the root, except those that every package operation writes.
content() {
    (cd "$root" && find . -xdev -mindepth 1 \( -path ./proc -o -path ./root -o -path ./var/lib/dpkg -o -path ./var/log \
        -o -path ./run -o -path ./tmp -o -path ./var/cache \) -prune -o -print | sort)
}
content >"$root/root/before"
install() { inside dpkg --force-confold -i "/root/$(basename "$1")" >"$root/root/dpkg.log" 2>&1 || { failed=1; cat "$root/root/dpkg.log"; }; }

# grep reads to the end, because `grep -q` would end early and make journalctl fail.
has_catalogue() { inside journalctl --list-catalog 2>/dev/null | grep rungd >/dev/null; }

step "install"
install "$first"
saw "$(inside rungd --version)"
must "the user rungd is there" inside getent passwd rungd >/dev/null
must "the unit is enabled" test -L "$root/etc/systemd/system/multi-user.target.wants/rungd.service"
must "journalctl -x knows its lines" has_catalogue
must "systemd-analyze verify is content" inside systemd-analyze verify --man=no /usr/lib/systemd/system/rungd.service
must "the configuration passes the check" inside rungd check --deny warnings /etc/rungd/controller.toml 2>/dev/null
inside setpriv --reuid rungd --regid rungd --clear-groups \
    rungd run /etc/rungd/controller.toml --scans 130 >"$root/root/run.log" 2>&1 || failed=1
must "it scans, as the user rungd" grep -q 'rungd ends scans=130 mode=STOP' "$root/root/run.log"
must "and the motor is ON" grep -q 'motor is ON' "$root/root/run.log"

step "upgrade"
echo '# mine' >>"$root/etc/rungd/controller.toml"
echo '# mine too' >"$root/etc/rungd/programs/press.toml"
inside systemctl --quiet disable rungd.service
# The directory that StateDirectory= of the unit would make.
inside install -d -o rungd -g rungd -m 750 /var/lib/rungd
touch "$root/var/lib/rungd/kept"
install "$second"
must "is installed" test "$(inside dpkg-query -Wf '${Version}' rungd)" = 0.2.0-2
must "what was changed is kept" grep -q '# mine' "$root/etc/rungd/controller.toml"
must "who disabled it finds it disabled" not test -e "$root/etc/systemd/system/multi-user.target.wants/rungd.service"
must "what it keeps is kept" test -e "$root/var/lib/rungd/kept"

step "remove"
inside dpkg -r rungd >/dev/null 2>&1 || failed=1
must "the configuration stays" test -e "$root/etc/rungd/controller.toml"
must "what it keeps stays" test -e "$root/var/lib/rungd/kept"
must "the program is gone" not test -e "$root/usr/bin/rungd"

step "purge"
rm "$root/etc/rungd/programs/press.toml"
wants="$root/etc/systemd/system/multi-user.target.wants"
mkdir -p "$wants"
# As `systemctl enable rungd-web` links it, without deb-systemd-helper's knowledge.
ln -s /usr/lib/systemd/system/rungd-web.service "$wants/rungd-web.service"
inside dpkg -P rungd >"$root/root/purge.log" 2>&1 || failed=1
content >"$root/root/after"
left="$(diff "$root/root/before" "$root/root/after" | grep '^[<>]' || true)"
must "the user stays, as Debian's do" inside getent passwd rungd >/dev/null
must "nothing else does" test -z "$left"
must "nor the link of a unit that somebody enabled" not test -L "$wants/rungd-web.service"
must "nor its lines in the catalogue" not has_catalogue
[ -z "$left" ] || sed 's/^/   | /' <<<"$left"

step "what an administrator wrote himself"
install "$first"
must "it is enabled anew" test -L "$root/etc/systemd/system/multi-user.target.wants/rungd.service"
echo '# mine' >"$root/etc/rungd/programs/press.toml"
inside dpkg -P rungd >"$root/root/purge.log" 2>&1 || failed=1
must "is not purged" test -e "$root/etc/rungd/programs/press.toml"
must "the package's own is" not test -e "$root/etc/rungd/controller.toml"

step "$([ "$failed" = 0 ] && echo 'all as it should be' || echo 'something is WRONG')"
exit "$failed"
