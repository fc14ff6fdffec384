#!/usr/bin/env python3
"""How long proofs take: proves all suites of tests/proofs and of config with a release, and prints a
row for each folder. With --lines, a row for each line too; folders are chosen by their names.

    cargo build --release && benches/proofs.py target/release/rungd [--lines] [FOLDER…]
"""

import json
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
FOLDERS = ["tests/proofs/esbmc", "tests/proofs/agents4plc", "tests/proofs/plants", "config/tests"]


def answers(rungd, suite):
    """The objects of all lines of a suite."""
    command = [rungd, "prove", "--json", "--again", "--time", "60s", suite.name]
    done = subprocess.run(command, cwd=suite.parent, capture_output=True, text=True)
    if done.stderr:
        sys.exit(f"{suite}: {done.stderr}")
    return [json.loads(line) for line in done.stdout.splitlines()]


def main():
    arguments = sys.argv[1:]
    with_lines = "--lines" in arguments
    rungd, *folders = [word for word in arguments if word != "--lines"]
    rungd = pathlib.Path(rungd).resolve()
    with tempfile.TemporaryDirectory() as copied:
        copied = pathlib.Path(copied)
        # Answers are kept beside the suites.
        shutil.copytree(ROOT / "config", copied / "config")
        shutil.copytree(ROOT / "tests/proofs", copied / "tests/proofs")
        print(f"{'':24} lines proved violated open  median ms  longest ms")
        for folder in folders or FOLDERS:
            of_folder = []
            for suite in sorted((copied / folder).glob("*.test.toml")):
                for answer in answers(rungd, suite):
                    of_folder.append(answer)
                    if with_lines:
                        name = suite.name.removesuffix(".test.toml")
                        line = answer["line"][:70]
                        print(f"{answer['ms']:6} ms  {answer['answer']:12} {name}: {line}", flush=True)
            count = lambda word: sum(answer["answer"] == word for answer in of_folder)
            times = [answer["ms"] for answer in of_folder]
            print(
                f"{folder:24} {len(times):5} {count('proved'):6} {count('violated'):8} "
                f"{count('not decided'):4} {statistics.median(times):10.0f} {max(times):11}",
                flush=True,
            )


main()
