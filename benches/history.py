#!/usr/bin/env python3
"""The figures of a release, a row each in benches/history.csv: instructions of scans and of a load,
counted by callgrind, and the size of the binary without symbols.

benches/history.py         compares with the last row; a figure that is larger than its margin fails
benches/history.py --row   writes the row of this version, in place of an earlier one

Needs valgrind and strip. Instructions are those of one scan: the difference of runs of two lengths,
without the inputs and queued writes of the scans. docs/speed.md describes the workloads.
"""

import csv
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
HISTORY = ROOT / "benches" / "history.csv"
RELEASE = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release"
COLUMNS = ["version", "rustc", "W", "W'", "S", "load", "binary"]
MARGIN = 0.03
# Records, bits of words, subroutines, observers and devices' own sides came after 0.2.0: the binary has
# their code, that of proofs and that of imports. The row of the next release brings it back to MARGIN.
MARGINS = {"binary": 0.10}
FEW, MANY = 20, 120


def run(*command):
    done = subprocess.run([str(part) for part in command], cwd=ROOT, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr}")
    return done


def instructions(workload, rungs, side, scans=1):
    """The instructions of a process that does one side of a workload."""
    done = run("valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", RELEASE / "speed",
               workload, "--n", rungs, "--side", side, "--scans", scans)
    return int(re.search(r"Collected : (\d+)", done.stderr)[1])


def of_a_scan(workload):
    def scans(side):
        return instructions(workload, 1000, side, MANY) - instructions(workload, 1000, side, FEW)
    return (scans("engine") - scans("outside")) // (MANY - FEW)


def binary_bytes():
    with tempfile.TemporaryDirectory() as folder:
        stripped = Path(folder) / "rungd"
        run("strip", "-o", stripped, RELEASE / "rungd")
        return stripped.stat().st_size


def version():
    return re.search(r'\[workspace\.package\]\nversion = "([^"]+)"',
                     (ROOT / "Cargo.toml").read_text())[1]


def present():
    # One command: so both have the same features, and nothing is compiled twice.
    run("cargo", "build", "--locked", "--release", "-p", "rungd", "-p", "rungd-speed")
    load = instructions("W-shuffled", 10000, "load") - instructions("W-shuffled", 10000, "text")
    values = [version(), run("rustc", "--version").stdout.split()[1], of_a_scan("W-order"),
              of_a_scan("W-contacts"), of_a_scan("S-stages"), load, binary_bytes()]
    return dict(zip(COLUMNS, map(str, values)))


def rows():
    with HISTORY.open(newline="") as file:
        return list(csv.DictReader(file))


def write(row):
    kept = [other for other in rows() if other["version"] != row["version"]]
    with HISTORY.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows([*kept, row])


def compare(row):
    """The figures that are too large, each as a line."""
    history = rows()
    if not history:
        return [f"{HISTORY.name} has no row: benches/history.py --row"]
    last = history[-1]
    is_comparable = last["rustc"] == row["rustc"]
    if not is_comparable:
        print(f"NOT COMPARED: the row of {last['version']} is by rustc {last['rustc']}, and this is "
              f"{row['rustc']}: benches/history.py --row at that release counts it again")
    larger = []
    for column in COLUMNS[2:]:
        before, now = int(last[column]), int(row[column])
        line = f"{column:6} {before:>13,} in {last['version']}, {now:>13,} now ({now / before - 1:+.1%})"
        print(line)
        margin = MARGINS.get(column, MARGIN)
        if is_comparable and now > before * (1 + margin):
            larger.append(f"more than {margin:.0%} larger: {line}")
    return larger


def main():
    if sys.argv[1:] == ["--row"]:
        write(present())
        print(HISTORY.read_text(), end="")
    elif sys.argv[1:]:
        sys.exit(__doc__)
    elif larger := compare(present()):
        sys.exit("\n".join(larger))


main()
