#!/bin/sh
# Prints the licences of the libraries that are linked into rungd, or into the program that is named
# (`third-party.sh rungd-opcua`): first each name, version and licence, then each licence text once, with
# its owners. Used by the packages and the image.
set -eu
cd "$(dirname "$0")/.."
program="${1:-rungd}"

sources="${CARGO_HOME:-$HOME/.cargo}/registry/src"
texts="$(mktemp -d)"
trap 'rm -rf "$texts"' EXIT

echo "Libraries in $program, under the licences named; their texts follow."
echo
# A line has: name vVERSION [(proc-macro)], a tab, the licence. The crates of rungd itself also have a path.
tab="$(printf '\t')"
cargo tree --locked --package "$program" --edges normal --prefix none --format "{p}${tab}{l}" |
    sed 's/ (\*)//; s/ (proc-macro)//' | grep -v '^rungd[ -]' | sort -u >"$texts/list"
sed "s/ v\([^${tab}]*\)${tab}/ \1: /" "$texts/list"
while IFS="$tab" read -r package licence; do
    name="${package%% *}" version="${package#* }"
    folder="$(find "$sources" -mindepth 2 -maxdepth 2 -name "$name-${version#v}" | head -n 1)"
    [ -n "$folder" ] || { echo "third-party.sh: no source of $name ${version#v} in $sources" >&2; exit 1; }
    find "$folder" -maxdepth 1 -type f | sort |
        grep -iE '/(licen[cs]e|copying|notice|copyright)[^/]*$' >"$texts/files" || true
    if [ ! -s "$texts/files" ]; then
        # The library has no licence file. If it names Apache-2.0, use our copy of that text, else the
        # one at the head of its source files, with all owners.
        head="$(grep -l "^Permission is hereby granted" "$folder"/src/*.rs | head -n 1)" || true
        case "$licence:$head" in
        *Apache-2.0*) none="it ships none: taken under Apache-2.0" && cp LICENSE-APACHE "$texts/$none" ;;
        MPL-2.0:*)
            # Of rungd-opcua alone. Exhibit A of the licence; the source is unchanged.
            none="it ships none: its source is at crates.io"
            cat >"$texts/$none" <<'END'
This Source Code Form is subject to the terms of the Mozilla Public License, v. 2.0. If a copy of the
MPL was not distributed with this file, You can obtain one at https://mozilla.org/MPL/2.0/.
(On Debian: /usr/share/common-licenses/MPL-2.0. The source: https://crates.io/crates/async-opcua)
END
            ;;
        MIT:?*)
            none="it stands in its source files"
            grep -h "^Copyright" "$folder"/src/*.rs | sort -u >"$texts/$none"
            sed '1d;/^Copyright/d;/^\*\*/,$d' "$head" >>"$texts/$none"
            ;;
        *) echo "third-party.sh: $name ships no licence text, and is under $licence" >&2; exit 1 ;;
        esac
        echo "$texts/$none" >"$texts/files"
    fi
    while read -r file; do
        sum="$(tr -s '[:space:]' ' ' <"$file" | cksum | tr ' ' -)"
        [ -e "$texts/$sum.text" ] || cp "$file" "$texts/$sum.text"
        echo "$name ${version#v} (${file##*/})" >>"$texts/$sum.owners"
    done <"$texts/files"
done <"$texts/list"
for owners in "$texts"/*.owners; do
    printf '\n%s\n' "------------------------------------------------------------------------------"
    paste -s -d ',' "$owners" | sed 's/,/, /g'
    echo
    cat "${owners%.owners}.text"
done
