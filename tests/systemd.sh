#!/usr/bin/env bash
# Runs rungd under a real systemd, booted in a container. Checks the statements of
# docs/guarantees.md and docs/running.md about the service, and prints a table of results. Exit code 1: a result is wrong.
#
# usage: tests/systemd.sh            as root; installs systemd-container, mmdebstrap, cargo-deb
#
#   RUNGD_DEBS="A B"     the package, and a later version of it (default: packaging/build-deb.sh,
#                        built with the release profile, or RUNGD_PROFILE)
#   RUNGD_SUITE=SUITE    Debian's release in the container (default: trixie)
#   RUNGD_KEEP=1         leave the work folder, with the journal in it
#
# Exit code 77: the test cannot run here, for lack of root, a tool or a container. That says nothing
# about rungd.
#
# The container's root directory is made once (20 s) and kept as a tar file below the build's
# folder. The container has its own /run, cgroups, journal and process numbers. It shares the
# machine's network.
set -euo pipefail

here=$(cd "$(dirname "$0")/.." && pwd)
suite=${RUNGD_SUITE:-trixie}
target=${CARGO_TARGET_DIR:-$here/target}
RUNGD_DEBS=${RUNGD_DEBS:-}
ladder=/etc/rungd/programs/main.toml

# --- outside: a root, and a mount namespace -------------------------------------------------------

cannot() {
    echo "tests/systemd.sh cannot be run here: $1" >&2
    exit 77
}

outside() {
    [ "$(id -u)" = 0 ] || cannot "it wants root"
    for tool in systemd-nspawn mmdebstrap; do
        command -v "$tool" >/dev/null && continue
        (apt-get update -qq && apt-get install -y -qq --no-install-recommends \
            systemd-container mmdebstrap) >/dev/null || cannot "no $tool, and apt does not give it"
    done
    unshare --mount --propagation private mount -t cgroup2 cgroup2 /sys/fs/cgroup 2>/dev/null ||
        cannot "no mount namespace with cgroups to be had"
    mkdir -p "$target/systemd"
    tar=$target/systemd/$suite.tar
    if [ ! -s "$tar" ]; then
        echo "making a root of $suite"
        mmdebstrap --quiet --format=tar --variant=minbase --include=systemd,systemd-sysv,dbus,procps \
            "$suite" "$tar.new" && mv "$tar.new" "$tar"
    fi
    work=$(mktemp -d "$target/systemd/run.XXXXXX")
    if [ -z "${RUNGD_KEEP:-}" ]; then trap 'rm -rf "$work"' EXIT; else echo "work: $work"; fi
    mkdir "$work/root"
    tar -C "$work/root" -xf "$tar"
    packages
    cp "$first" "$work/root/root/first.deb"
    cp "$second" "$work/root/root/second.deb"
    unshare --mount --propagation private bash "$here/tests/systemd.sh" --inside "$work"
}

# The package, and a later version with the same content.
packages() {
    first=${RUNGD_DEBS% *} second=${RUNGD_DEBS#* }
    if [ -n "$RUNGD_DEBS" ]; then return; fi
    command -v cargo-deb >/dev/null || cargo install --locked --debug --quiet cargo-deb
    first=$(package 0.2.0-1) && second=$(package 0.2.0-2) || { cat "$work/log"; exit 1; }
}

package() {
    (cd "$here" && RUNGD_PROFILE=${RUNGD_PROFILE:-release} packaging/build-deb.sh --version "$1" --output "$work/" 2>>"$work/log" | tail -n 1)
}

# --- inside: boot, look, compare ------------------------------------------------------------------

leader=
boot() {
    mount -t tmpfs tmpfs /run
    mount -t cgroup2 cgroup2 /sys/fs/cgroup
    UNIFIED_CGROUP_HIERARCHY=1 systemd-nspawn --quiet -D "$work/root" --register=no --keep-unit \
        --boot --console=pipe --capability=CAP_IPC_LOCK </dev/null >"$work/console" 2>&1 &
    nspawn=$!
    for _ in $(seq 150); do
        leader=$(cat /proc/$nspawn/task/*/children 2>/dev/null | tr -d ' ') || true
        if [ -n "$leader" ] && in_it systemctl is-system-running 2>/dev/null |
            grep -qE 'running|degraded'; then
            give_device
            return
        fi
        sleep 0.1
    done
    tail "$work/console"
    cannot "the container does not boot"
}

# Makes a node for a device that the container lacks, with the kernel's permissions: only root may use it.
give_device() {
    local device=/dev/cpu_dma_latency
    [ -c "$device" ] || return 0
    nsenter -t "$leader" -m mknod "$device" c $((0x$(stat -c %t "$device"))) \
        $((0x$(stat -c %T "$device")))
    nsenter -t "$leader" -m chmod 600 "$device"
}

power_off() {
    if [ -n "$leader" ]; then
        in_it journalctl --no-pager -o short-precise -u rungd >"$work/journal" 2>&1 || true
        kill -s RTMIN+4 "$leader" 2>/dev/null || true
    else
        kill "$nspawn" 2>/dev/null || true
    fi
    wait "$nspawn" || true
}

in_it() { nsenter -t "$leader" -a "$@"; }
property() { in_it systemctl show -P "$1" rungd; }
log() { in_it journalctl --no-pager -o cat -u rungd "$@"; }
now() { date +%s%N; }
since() { echo $((($(now) - $1) / 1000000)); }
milliseconds() { awk -v n="$1" 'BEGIN { printf "%.2f s", n / 1000 }'; }

# Repeats a command until it succeeds, for at most this number of seconds.
until_true() {
    local seconds=$1 end
    end=$(($(now) + seconds * 1000000000))
    shift
    until "$@" >/dev/null 2>&1; do
        [ "$(now)" -lt "$end" ] || return 1
        sleep 0.05
    done
}

is() { [ "$(property "$1")" = "$2" ]; }
# Prints the service's main process if the service is active; one query for both.
up_as() {
    in_it systemctl show -p MainPID -p ActiveState rungd | sort | tr '\n' ' ' |
        sed -n 's/^ActiveState=active MainPID=\([1-9][0-9]*\) $/\1/p'
}
is_up() { [ -n "$(up_as)" ]; }
is_other() {
    local pid
    pid=$(up_as)
    [ -n "$pid" ] && [ "$pid" != "$1" ]
}
status_is() { property StatusText | grep -qE "$1"; }
logged() { log --since "$mark" | grep -qE "$1"; }
mark() { sleep 0.01; mark=$(in_it date '+%F %T.%6N'); }

wrong=0
row() { printf '%-44s %-5s %s\n' "$1" "$2" "$3"; }
# check WHAT SEEN COMMAND…: prints a line of the table.
check() {
    local what=$1 seen=$2
    shift 2
    if "$@" >/dev/null 2>&1; then row "$what" ok "$seen"; else
        wrong=$((wrong + 1))
        row "$what" WRONG "$seen"
        log -n 12 | sed 's/^/    | /'
    fi
}

container() { in_it sh -ec "$1"; }

# The effects of a first installation.
test_install() {
    in_it dpkg -i /root/first.deb >"$work/dpkg" 2>&1 || true
    until_true 3 is_up || true
    check "install: enabled and started" "$(property UnitFileState), $(property ActiveState)" \
        eval 'is UnitFileState enabled && is_up'
    check "install: runs as rungd" "$(container 'ps -o user= -p $(systemctl show -P MainPID rungd)')" \
        container '[ "$(ps -o user= -p $(systemctl show -P MainPID rungd))" = rungd ]'
    in_it systemctl stop rungd
}

# An upgrade does not stop a running machine.
test_upgrade() {
    local pid
    in_it systemctl start rungd
    pid=$(up_as)
    container 'echo "# mine" >> /etc/rungd/controller.toml'
    in_it dpkg --force-confold -i /root/second.deb >"$work/dpkg" 2>&1 || true
    check "upgrade: not restarted" \
        "$(in_it dpkg-query -Wf '${Version}' rungd), process $pid then, $(up_as) now" \
        test "$(up_as)" = "$pid"
    check "upgrade: says what to do" "$(grep -o 'systemctl restart rungd' "$work/dpkg" | head -1)" \
        grep -q 'systemctl restart rungd' "$work/dpkg"
    check "upgrade: the configuration is kept" \
        "$(container 'tail -n 1 /etc/rungd/controller.toml')" \
        container 'grep -q "# mine" /etc/rungd/controller.toml'
    in_it systemctl restart rungd
    until_true 3 is_other "$pid" || true
    check "upgrade: a restart runs the new one" "process $(up_as)" is_other "$pid"
}

test_purge() {
    local left
    mark
    in_it dpkg -P rungd >"$work/dpkg" 2>&1 || true
    check "purge: stopped in an orderly way" \
        "$(log --since "$mark" | grep -o 'STOP: a signal requested it' | head -1)" \
        logged 'STOP: a signal requested it'
    left=$(container 'ls -d /etc/rungd /run/rungd /var/lib/rungd /usr/bin/rungd \
        /etc/systemd/system/*/rungd.service /usr/lib/systemd/system/rungd.service 2>/dev/null || true')
    check "purge: nothing is left" "${left:-nothing}" test -z "$left"
}

# READY follows the first scan. While the ladder is read, the unit is still starting; this ladder is
# long enough to take seconds. (tests/daemon/watchdog_fault.rs tests a first scan that is a fault.)
test_start() {
    local begin
    mark
    container "cp $ladder /root/ladder"
    awk 'BEGIN {
        print "[[task]]\nname = \"Long\"\nrung = ["
        for (n = 0; n < 250000; n++) print "{ when = [\"X0\"], do = [\"SET C99\"] },"
        print "]"
    }' | in_it sh -ec "cat >>$ladder"
    in_it systemctl start --no-block rungd
    until_true 5 is ActiveState activating || true
    check "start: no READY while the ladder is read" "$(property ActiveState)" is ActiveState activating
    check "start: READY once it is read" "$(until_true 60 is ActiveState active; property ActiveState)" is_up
    in_it systemctl stop rungd
    container "mv /root/ladder $ladder"
    begin=$(now)
    in_it systemctl start rungd
    begin=$(since "$begin")
    until_true 1 status_is '^RUN, [1-9]' || true
    check "start: systemctl start returns, a scan is done" \
        "$(milliseconds "$begin"), $(property StatusText)" status_is '^RUN, [1-9]'
}

test_status() {
    local texts begin seconds
    until_true 3 status_is '^RUN, [0-9]+ scans' || true
    check "status: mode and scans" "$(property StatusText)" status_is '^RUN, [0-9]+ scans'
    begin=$(now)
    texts=$(for _ in $(seq 80); do property StatusText; sleep 0.03; done | uniq | wc -l)
    seconds=$(($(since "$begin") / 1000))
    check "status: once a second at most" "$texts texts in $seconds s" \
        test "$texts" -le $((seconds + 3))
}

# The operator's socket: its owner and group; root gets an answer, the user nobody does not.
test_operator() {
    local socket=/run/rungd/rungd.sock
    check "rungd status: the socket is the group's" "$(container "stat -c '%A %U %G' $socket")" \
        container "[ \"\$(stat -c '%a %U %G' $socket)\" = '660 rungd rungd' ]"
    check "rungd status: answers" "$(in_it rungd status | head -1)" \
        eval 'in_it rungd status | grep -q RUN'
    local view=/run/rungd/rungd-view.sock
    check "the view socket is of a group that only looks" "$(container "stat -c '%A %U %G' $view")" \
        container "[ \"\$(stat -c '%a %U %G' $view)\" = '660 rungd rungd-view' ]"
    check "the view group gets a status" \
        "$(container 'setpriv --reuid=65534 --regid=rungd-view --clear-groups rungd status' | head -1)" \
        container 'setpriv --reuid=65534 --regid=rungd-view --clear-groups rungd status | grep -q RUN'
    check "the view group changes nothing" \
        "$(container 'setpriv --reuid=65534 --regid=rungd-view --clear-groups rungd mode stop 2>&1 || true' | head -1)" \
        container '! setpriv --reuid=65534 --regid=rungd-view --clear-groups rungd mode stop'
    local user
    for user in rungd-web rungd-edge; do
        check "$user looks and changes nothing" "$(container "id -Gn $user")" \
            container "id -Gn $user | grep -qw rungd-view && ! id -Gn $user | tr ' ' '\n' | grep -qx rungd"
    done
    check "rungd status: not for everybody" \
        "$(container 'setpriv --reuid=65534 --clear-groups rungd status 2>&1 || true' | head -1)" \
        container '! setpriv --reuid=65534 --clear-groups rungd status'
}

# journalctl -x shows the catalogue's text of an event.
test_catalog() {
    local explained
    explained=$(in_it journalctl --no-pager -x -u rungd | grep -m 1 'Subject: mode-run' || true)
    check "journalctl -x explains an event" "$explained" test -n "$explained"
}

# The hardening lets only the scan thread become real-time. (Whether the limits may be raised
# depends on the container: a capability stands for them.)
test_realtime() {
    local policies
    container 'cp /etc/rungd/controller.toml /root/controller.toml
        printf "\n[realtime]\npolicy = \"fifo\"\npriority = 80\ncpus = [0]\ncpu-latency = \"0us\"\n" \
            >> /etc/rungd/controller.toml
        mkdir -p /run/systemd/system/rungd.service.d
        printf "[Service]\nAmbientCapabilities=CAP_SYS_NICE\nCapabilityBoundingSet=CAP_SYS_NICE\n" \
            > /run/systemd/system/rungd.service.d/nice.conf
        systemctl daemon-reload'
    mark
    in_it systemctl restart rungd
    policies=$(in_it sh -c "ps -L -o cls=,comm= -p $(property MainPID)" | sort | uniq -c |
        awk '{ printf "%s%s %s", (NR > 1 ? ", " : ""), $3, $2 }')
    check "real-time: the scan thread alone is FIFO" "$policies" \
        sh -c "echo '$policies' | grep -q 'rungd-scan FF' && [ \$(echo '$policies' | tr ',' '\n' | grep -c FF) = 1 ]"
    if [ -c /dev/cpu_dma_latency ]; then
        check "real-time: the package and the unit give the device" \
            "$(container 'stat -c "%A %U %G" /dev/cpu_dma_latency')" \
            logged 'granted="CPU latency of 0 us'
    fi
    check "real-time: what was granted is logged" \
        "$(log --since "$mark" | sed -n 's/.*granted="\([^"]*\)".*/\1/p' | head -1)" \
        logged 'granted=.*SCHED_FIFO priority 80'
    container 'rm /run/systemd/system/rungd.service.d/nice.conf
        printf "strict = true\n" >> /etc/rungd/controller.toml
        printf "[Service]\nLimitRTPRIO=0\n" > /run/systemd/system/rungd.service.d/none.conf
        systemctl daemon-reload; systemctl stop rungd'
    mark
    in_it systemctl start rungd 2>/dev/null || true
    check "real-time: strict refuses, names the remedy" \
        "code $(property ExecMainStatus), $(log --since "$mark" | grep -o 'LimitRTPRIO=80' | head -1)" \
        eval 'is ExecMainStatus 78 && logged "strict.*LimitRTPRIO=80"'
    container 'rm -r /run/systemd/system/rungd.service.d
        mv /root/controller.toml /etc/rungd/controller.toml; systemctl daemon-reload
        systemctl reset-failed rungd'
    in_it systemctl start rungd
}

# Sends a signal to the service's main process, if there is one. (Process 0 would be this script's
# group.)
kill_it() {
    local pid
    pid=$(up_as)
    [ -n "$pid" ] && in_it kill -s "$1" "$pid"
}

# systemd restarts a killed process.
test_kill() {
    local pid begin
    pid=$(up_as)
    mark
    begin=$(now)
    kill_it KILL
    until_true 10 is_other "$pid" || true
    check "kill -9: restarted" "after $(milliseconds "$(since "$begin")"), NRestarts=$(property NRestarts)" \
        is_other "$pid"
    check "kill -9: the log says so" "$(log --since "$mark" | grep -o 'restart [0-9]* of 10' | head -1)" \
        logged 'restart 1 of 10'
}

# The watchdog ends a process that is stopped.
test_hang() {
    local pid begin limit
    pid=$(up_as)
    limit=$(property WatchdogUSec)
    mark
    begin=$(now)
    kill_it STOP
    until_true 30 is_other "$pid" || true
    check "SIGSTOP: the watchdog ($limit) ends it" \
        "running again after $(milliseconds "$(since "$begin")")" is_other "$pid"
    check "SIGSTOP: systemd says why" \
        "$(log --since "$mark" | grep -o "Failed with result '[a-z]*'" | head -1)" \
        logged "Failed with result 'watchdog'"
}

# Ten restarts without ten healthy minutes between them lead to a start in STOP. Two have happened
# before this test.
test_crash_loop() {
    local kills=2 pid begin
    begin=$(now)
    mark
    while [ "$kills" -lt 12 ] && ! status_is '^STOP .*too often'; do
        pid=$(up_as)
        kill_it KILL || break
        kills=$((kills + 1))
        until_true 10 is_other "$pid" || break
        until_true 1 status_is '^(RUN, |STOP .*too often)' || true
    done
    check "crash loop: ends in STOP" "after $kills unclean ends, $(milliseconds "$(since "$begin")")" \
        test "$kills" = 10
    check "crash loop: up, and says why" "$(property ActiveState): $(property StatusText)" \
        status_is '^STOP after 0 scans: .*restarted too often'
    check "crash loop: the log says so" \
        "$(log --since "$mark" | grep -o '10 restarts after unclean ends' | head -1)" \
        eval 'logged "10 restarts after unclean ends" && logged "restarted too often.*rungd mode run"'
    check "crash loop: left by rungd mode run" "$(in_it rungd mode run 2>&1 | head -1)" \
        until_true 3 status_is '^RUN'
    in_it systemctl restart rungd
    until_true 3 status_is '^RUN' || true
    check "crash loop: an orderly restart forgets it" \
        "$(property StatusText), $(container 'cat /run/rungd/restarts')" \
        container 'grep -q "restarts=0 process=running" /run/rungd/restarts'
}

# journald is stopped for five seconds: every grid point is accounted for.
test_frozen_journal() {
    local journald numbers
    mark
    in_it systemctl restart rungd
    journald=$(in_it systemctl show -P MainPID systemd-journald)
    container "kill -STOP $journald; sleep 5; kill -CONT $journald"
    in_it systemctl stop rungd
    until_true 3 logged 'statistics of the whole run' || true
    numbers=$(log --since "$mark" | grep 'statistics of the whole run' | tail -1 |
        tr ' ' '\n' | awk -F= '{ v[$1] = $2 } END {
            points = int((v["over_us"] - v["late_us_last"]) / 10000 + 1.5)
            print v["scans"], v["skipped"], points }')
    check "journald stands still for 5 s: no scan missed" \
        "$(echo "$numbers" | awk '{ print $1 " scans + " $2 " skipped of " $3 " grid points" }')" \
        sh -c "echo '$numbers' | awk '{ exit !(\$3 >= 500 && \$1 + \$2 == \$3) }'"
    check "journald stands still for 5 s: no fault" \
        "$(log --since "$mark" | grep -c FAULT || true) faults" eval '! logged FAULT'
    in_it systemctl start rungd
}

# A reload changes the program without a stop. A bad program changes nothing, and systemctl fails.
test_reload() {
    local pid code=0
    pid=$(up_as)
    mark
    container "echo '# edited' >> $ladder"
    in_it systemctl reload rungd || code=$?
    check "reload: the same process scans on" "code $code, $(property StatusText)" \
        eval '[ "$code" = 0 ] && [ "$(up_as)" = "$pid" ] && logged "reload-done|the new program scans"'
    container "cp $ladder /root/ladder
        printf '\n[[program.rung]]\nwhen = [\"\$On\"]\ndo = [\"OUTT Y0\"]\n' >> $ladder"
    code=0
    in_it systemctl reload rungd 2>/dev/null || code=$?
    check "reload of a bad ladder: fails, and it scans on" "code $code, $(property StatusText)" \
        eval '[ "$code" != 0 ] && [ "$(up_as)" = "$pid" ] && logged "nothing changed"'
    container "mv /root/ladder $ladder"
    reload_with "socket elsewhere" 'socket = "/run/rungd/elsewhere.sock"'
    reload_with "no socket" 'enabled = false'
}

# reload_with WHAT LINE: `systemctl reload` finds the process after a change of `[operator]` to this line.
reload_with() {
    local pid code=0
    container "cp -p /etc/rungd/controller.toml /root/controller.toml
        printf '\n[operator]\n%s\n' '$2' >> /etc/rungd/controller.toml"
    in_it systemctl restart rungd
    until_true 5 status_is '^RUN' || true
    pid=$(up_as)
    mark
    container "echo '# edited' >> $ladder"
    in_it systemctl reload rungd || code=$?
    until_true 5 logged 'reload-done|the new program scans' || true
    check "reload, $1: the same process scans on" "code $code, $(property StatusText)" \
        eval '[ "$code" = 0 ] && [ "$(up_as)" = "$pid" ] && logged "reload-done|the new program scans"'
    container 'mv /root/controller.toml /etc/rungd/controller.toml'
    in_it systemctl restart rungd
    until_true 5 status_is '^RUN' || true
}

# Retained values survive a restart of the service, and a kill after which systemd restarts it.
test_retain() {
    local file=/var/lib/rungd/retain pid
    container 'cp -p /etc/rungd/controller.toml /root/controller.toml
        printf "\n[retain]\nranges = [\"D200..D209\"]\ninterval = \"200ms\"\n" \
            >> /etc/rungd/controller.toml'
    in_it systemctl restart rungd
    until_true 5 status_is '^STOP' || true
    check "retain: the first start waits in STOP" "$(property StatusText)" status_is '^STOP'
    container 'rungd mode run >/dev/null; rungd write D200 4711 >/dev/null'
    pid=$(up_as)
    in_it systemctl restart rungd
    until_true 5 status_is '^RUN' || true
    check "retain: kept across systemctl restart" "$(container 'rungd read D200')" \
        eval 'is_other "$pid" && container "rungd read D200 | grep -qw 4711"'
    check "retain: the file is rungd's alone" "$(container "stat -c '%A %U %n' $file")" \
        container "[ \"\$(stat -c '%a %U' $file)\" = '600 rungd' ]"
    container 'rungd write D201 815 >/dev/null; sleep 1'
    pid=$(up_as)
    mark
    kill_it KILL
    until_true 10 is_other "$pid" || true
    until_true 5 status_is '^RUN' || true
    check "retain: kept across kill -9 and Restart=" "$(container 'rungd read D200 D201' | tr '\n' ' ')" \
        container 'rungd read D200 | grep -qw 4711 && rungd read D201 | grep -qw 815'
    check "retain: the log says what was restored" \
        "$(log --since "$mark" | grep -o '[0-9]* of [0-9]* elements restored' | head -1)" \
        logged '10 of 10 elements restored.*no orderly stop followed'
    container 'mv /root/controller.toml /etc/rungd/controller.toml'
    in_it systemctl restart rungd
}

# Stops the service, and measures the time.
test_stop() {
    local begin
    mark
    begin=$(now)
    in_it systemctl stop rungd
    begin=$(since "$begin")
    check "stop: within a second" "$(milliseconds "$begin")" test "$begin" -le 1000
    check "stop: orderly" "$(property Result), code $(property ExecMainStatus)" \
        eval 'is Result success && logged "STOP: a signal requested it"'
    check "stop: /run/rungd is gone" "$(container 'ls -d /run/rungd 2>&1 || true')" \
        container '! test -e /run/rungd'
}

# A bad ladder is refused, and systemd does not restart the service.
test_bad_ladder() {
    container "cp $ladder /root/ladder
        printf '\n[[program.rung]]\nwhen = [\"\$On\"]\ndo = [\"OUTT Y0\"]\n' >> $ladder"
    mark
    in_it systemctl start rungd 2>/dev/null || true
    sleep 3
    check "bad ladder: exits 78" "code $(property ExecMainStatus)" is ExecMainStatus 78
    check "bad ladder: stays down" "$(property ActiveState), NRestarts=$(property NRestarts)" \
        eval 'is ActiveState failed && is NRestarts 0'
    check "bad ladder: the log says where" "$(log --since "$mark" | grep -o 'programs/main.toml:[0-9:]*' | head -1)" \
        logged 'programs/main.toml:[0-9]+'
    container "mv /root/ladder $ladder; systemctl reset-failed rungd"
}

test_security() {
    local score
    score=$(in_it systemd-analyze security --no-pager rungd | sed -n 's/.*rungd.service: \([0-9.]*\).*/\1/p')
    check "systemd-analyze security: at most 2.0" "$score" \
        awk "BEGIN { exit !($score > 0 && $score <= 2.0) }"
    check "systemd-analyze verify" "$(in_it systemd-analyze verify --man=no rungd.service 2>&1 | head -3)" \
        eval '[ -z "$(in_it systemd-analyze verify --man=no rungd.service 2>&1)" ]'
}

inside() {
    work=$1
    trap power_off EXIT
    boot
    in_it systemctl --version | head -1
    test_install
    test_security
    test_start
    test_status
    test_operator
    test_catalog
    test_realtime
    test_reload
    test_stop
    in_it systemctl start rungd
    test_retain
    test_frozen_journal
    test_kill
    test_hang
    test_crash_loop
    test_stop
    test_bad_ladder
    test_upgrade
    test_purge
    echo
    if [ "$wrong" = 0 ]; then echo "all as expected, $SECONDS s"; else
        echo "$wrong not as expected" && exit 1
    fi
}

if [ "${1:-}" = --inside ]; then inside "$2"; else outside; fi
