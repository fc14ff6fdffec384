# Sourced by the scripts beside it: prints each step, each observation, and ok or WRONG for each
# check.

failed=0

exec 3>&1
step() { printf '\n== %s\n' "$*" >&3; }
saw() { printf '   %s\n' "$*" >&3; }
must() { # must WHAT COMMAND…
    local what="$1"
    shift
    if "$@"; then saw "ok: $what"; else saw "WRONG: $what"; failed=1; fi
}
