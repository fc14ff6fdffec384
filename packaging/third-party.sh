#!/bin/sh
# Prints the licences of the libraries that are linked into rungd: first each name, version and
# licence, then each licence text once, with its owners. Used by the package and the image.
set -eu
cd "$(dirname "$0")/.."

sources="${CARGO_HOME:-$HOME/.cargo}/registry/src"
texts="$(mktemp -d)"
trap 'rm -rf "$texts"' EXIT

echo "Libraries in rungd, under the licences named; their texts follow."
echo
# A line has: name vVERSION [(proc-macro)], a tab, the licence. The crates of rungd itself also have a path.
tab="$(printf '\t')"
cargo tree --locked --package rungd --edges normal --prefix none --format "{p}${tab}{l}" |
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
