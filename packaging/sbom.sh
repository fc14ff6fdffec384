#!/bin/sh
# Prints the software bill of materials: the libraries in rungd, with versions, licences, checksums
# and dependencies, in CycloneDX's JSON (1.5). Used by the package and for checks of advisories.
#
# Made from Cargo.lock and `cargo tree`, for the machine on which the script runs; the same sources
# give the same bytes.
set -eu
cd "$(dirname "$0")/.."

tab="$(printf '\t')"
made="$(mktemp -d)"
trap 'rm -rf "$made"' EXIT
cargo tree --locked --package rungd --edges normal --prefix depth --no-dedupe --format "${tab}{p}${tab}{l}" >"$made/tree"

awk -F '\t' '
function purl(package, words) {
    split(package, words, " v?")
    return "pkg:cargo/" words[1] "@" words[2]
}
function quoted(text) { return "\"" text "\"" }
# Cargo.lock: the checksums.
FILENAME ~ /Cargo.lock$/ {
    split($0, words, "\"")
    if (/^name = /) name = words[2]
    if (/^version = /) version = words[2]
    if (/^checksum = /) checksum["pkg:cargo/" name "@" version] = words[2]
    next
}
# The tree: a line has a depth and a package; the last line before it with a smaller depth depends
# on this package.
{
    depth = $1 + 0
    # The crates of rungd are parts of the program, no libraries.
    if (depth > 0 && $2 ~ /^rungd-/) { above[depth] = root; next }
    own = purl($2)
    above[depth] = own
    if (depth == 0) { root = own; split($2, words, " v?"); version = words[2]; licence = $3 }
    else {
        if (!(own in licences)) order[++count] = own
        licences[own] = $3
        by = above[depth - 1]
        if (!((by, own) in seen)) { seen[by, own] = 1; wants[by] = wants[by] (wants[by] ? ", " : "") quoted(own) }
    }
}
function component(type, ref, licence, words, text) {
    split(substr(ref, length("pkg:cargo/") + 1), words, "@")
    text = "{\"type\": \"" type "\", \"bom-ref\": " quoted(ref) ", \"name\": " quoted(words[1]) \
        ", \"version\": " quoted(words[2]) ", \"purl\": " quoted(ref) \
        ", \"licenses\": [{\"expression\": " quoted(licence) "}]"
    if (ref in checksum)
        text = text ", \"hashes\": [{\"alg\": \"SHA-256\", \"content\": " quoted(checksum[ref]) "}]"
    return text "}"
}
END {
    print "{\n  \"bomFormat\": \"CycloneDX\",\n  \"specVersion\": \"1.5\",\n  \"version\": 1,"
    print "  \"metadata\": {\"component\": " component("application", root, licence) "},"
    print "  \"components\": ["
    for (at = 1; at <= count; at++)
        print "    " component("library", order[at], licences[order[at]]) (at < count ? "," : "")
    print "  ],\n  \"dependencies\": ["
    print "    {\"ref\": " quoted(root) ", \"dependsOn\": [" wants[root] "]},"
    for (at = 1; at <= count; at++)
        print "    {\"ref\": " quoted(order[at]) ", \"dependsOn\": [" wants[order[at]] "]}" (at < count ? "," : "")
    print "  ]\n}"
}' Cargo.lock "$made/tree"
