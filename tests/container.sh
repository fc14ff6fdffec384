#!/usr/bin/env bash
# Builds the Dockerfile and runs its image on a machine without a container engine: buildah works in
# a chroot. Prints each result; the exit code is 0 if all results are as expected.
#
#   tests/container.sh          # as root
#
# The script makes the base image itself, under the name of the official image. It consists of
# Debian trixie with gcc, from mmdebstrap, and of the Rust toolchain of this machine. The Debian
# system and the image are kept in $RUNGD_CONTAINER_CACHE (/var/tmp/rungd-container) for the next
# run. The crates come from cargo's own cache. The script installs mmdebstrap and buildah if they
# are missing. The first run takes some minutes; a later run takes as long as the release build.
set -euo pipefail
cd "$(dirname "$0")/.."

cache="${RUNGD_CONTAINER_CACHE:-/var/tmp/rungd-container}"
export STORAGE_DRIVER=vfs BUILDAH_ISOLATION=chroot BUILDAH_FORMAT=docker
base=rust:1-slim-trixie
image=rungd:test
. tests/said.sh
buildah() { command buildah --root "$cache/storage" --runroot "$cache/run" "$@"; }

step "tools"
missing=()
# `type -P`, because `command -v` would find the function above.
for tool in mmdebstrap buildah; do type -P "$tool" >/dev/null || missing+=("$tool"); done
if [ ${#missing[@]} -gt 0 ]; then
    (apt-get update -qq && apt-get install -y -qq "${missing[@]}") >/dev/null
fi
mkdir -p "$cache"
work="$(mktemp -d)"
containers=()
# shellcheck disable=SC2329
cleanup() {
    for container in "${containers[@]}"; do buildah rm "$container" >/dev/null 2>&1 || true; done
    rm -rf "$work"
}
trap cleanup EXIT
saw "$(command buildah --version)"

step "the base image $base"
rust="$(rustc --version)"
label="$(buildah inspect --type image --format '{{.Docker.Config.Labels.rust}}' "$base" 2>/dev/null || true)"
if [ "$label" != "$rust" ]; then
    if [ ! -e "$cache/trixie-gcc.tar" ]; then
        mmdebstrap --quiet --variant=minbase --include=gcc,libc6-dev,ca-certificates \
            trixie "$cache/trixie-gcc.new.tar"
        mv "$cache/trixie-gcc.new.tar" "$cache/trixie-gcc.tar"
    fi
    sysroot="$(rustc --print sysroot)"
    host="$(rustc -vV | sed -n 's/^host: //p')"
    container="$(buildah from scratch)"
    containers+=("$container")
    buildah add --quiet "$container" "$cache/trixie-gcc.tar" / >/dev/null
    buildah copy --quiet "$container" "$sysroot/bin/rustc" "$sysroot/bin/cargo" /usr/local/bin/ >/dev/null
    buildah copy --quiet "$container" "$sysroot"/lib/*.so* /usr/local/lib/ >/dev/null
    buildah copy --quiet "$container" "$sysroot/lib/rustlib/$host" "/usr/local/lib/rustlib/$host" >/dev/null
    buildah config --env PATH=/usr/local/bin:/usr/bin:/bin --env CARGO_HOME=/usr/local/cargo \
        --label "rust=$rust" "$container"
    buildah commit --quiet --rm "$container" "$base" >/dev/null
    containers=()
fi
saw "$rust on Debian trixie"

step "build the Dockerfile"
registry="${CARGO_HOME:-$HOME/.cargo}/registry"
mkdir -p "$registry"
began="$(date +%s)"
buildah bud --quiet --pull-never --tag "$image" \
    --volume /etc/ssl/certs:/etc/ssl/certs:ro --volume "$registry:/usr/local/cargo/registry" . \
    >"$work/build.log" 2>&1 || { tail -n 40 "$work/build.log"; exit 1; }
saw "built in $(($(date +%s) - began)) s"

step "the image"
inspect() { buildah inspect --type image --format "$1" "$image"; }
container="$(buildah from --pull-never "$image")"
containers+=("$container")
root="$(buildah mount "$container")"
size_kib="$(du -sk --apparent-size "$root" | cut -f1)"
saw "size: $size_kib KiB, of which /usr/bin/rungd $(($(stat -c %s "$root/usr/bin/rungd") / 1024)) KiB"
saw "files: $(cd "$root" && find . -type f | sort | tr '\n' ' ')"
must "smaller than 20 MiB" test "$size_kib" -lt 20480
must "user is not root: $(inspect '{{.Docker.Config.User}}')" test "$(inspect '{{.Docker.Config.User}}')" = 6553
health="$(inspect '{{.Docker.Config.Healthcheck.Test}}')"
must "health check: $health" test "$health" = "[CMD rungd status]"
entry=($(inspect '{{range .Docker.Config.Entrypoint}}{{.}} {{end}}{{range .Docker.Config.Cmd}}{{.}} {{end}}'))
saw "command: ${entry[*]}"
must "the program is static" bash -c '! grep -q "ld-linux" <(head -c 4096 "$1")' _ "$root/usr/bin/rungd"

run() { buildah run "$@"; }
below() { # all processes below one
    local child
    for child in $(pgrep -P "$1"); do echo "$child"; below "$child"; done
}

step "the image's own controller scans"
run "$container" -- "${entry[@]}" --scans 150 --log-level info >"$work/own.log" 2>&1 || failed=1
sed -n '1,6p;$p' "$work/own.log" | cut -c1-150 | sed 's/^/   | /'
must "150 scans, an orderly stop" grep -q 'rungd ends scans=150 mode=STOP' "$work/own.log"
must "the motor was started" grep -q 'motor is ON' "$work/own.log"

step "a mounted controller, beside it the commands"
mkdir -p "$work/plant"
cp -r config/parts-bin.toml config/programs "$work/plant/"
mv "$work/plant/parts-bin.toml" "$work/plant/controller.toml"
chmod -R a+rX "$work"
run --volume "$work/plant:/etc/rungd:ro" "$container" -- "${entry[@]}" >"$work/mounted.log" 2>&1 &
running=$!
for _ in $(seq 50); do grep -q 'RUN: ' "$work/mounted.log" && break; sleep 0.1; done
must "it scans the mounted ladder" grep -q 'ladder=parts-bin' "$work/mounted.log"
sleep 2
if run "$container" -- rungd status --help >/dev/null 2>&1; then
    must "the health check is content" run "$container" -- rungd status >"$work/status"
    head -n 5 "$work/status" | cut -c1-150 | sed 's/^/   | /'
else
    saw "left out: this rungd has no \`status\`"
fi
pid="$(below "$running" | while read -r one; do
    case "$(cat "/proc/$one/comm")" in rungd) echo "$one" ;; esac
done | tail -n 1)"
must "its user is 6553" test "$(stat -c %u "/proc/$pid")" = 6553
began="$(date +%s%N)"
kill -TERM "$pid"
code=0
wait "$running" || code=$?
saw "SIGTERM: ended with $code after $((($(date +%s%N) - began) / 1000000)) ms"
must "an orderly end" grep -q 'rungd ends .*mode=STOP' "$work/mounted.log"
must "exit code 0" test "$code" = 0
if run "$container" -- rungd status --help >/dev/null 2>&1; then
    must "the health check notices that it is gone" bash -c '! "$@" >/dev/null 2>&1' _ \
        buildah --root "$cache/storage" --runroot "$cache/run" run "$container" -- rungd status
fi

step "a bad ladder"
sed -i 's/OUT feeder/OUT feeeder/' "$work/plant/programs/parts-bin.toml"
code=0
run --volume "$work/plant:/etc/rungd:ro" "$container" -- "${entry[@]}" >"$work/bad.log" 2>&1 || code=$?
must "is refused with 78 (got $code)" grep -qE '78' <<<"$code"
must "and says why" grep -q 'did you mean `feeder`' "$work/bad.log"

step "$([ "$failed" = 0 ] && echo 'all as it should be' || echo 'something is WRONG')"
exit "$failed"
