#!/usr/bin/env python3
"""The time of an answer of `rungd how` about the shipped plants.

usage: benches/how.py [CONTROLLER...]      (default: config/*.toml)

Runs each controller for some seconds with a recording, as long as its plant needs to begin. Then asks, from the end of
the recording, for each output and each alarm how it can be ON and how it can be OFF. Prints for each plant the number
of questions and of their answers, and the median and the longest time of a whole command that searched, ms; then those of all.
RUNGD is the binary (target/release/rungd), SECONDS (10) the length of a run, LIMIT (10s) the time of a question.
"""

import collections
import json
import os
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
RUNGD = os.environ.get("RUNGD", str(ROOT / "target/release/rungd"))
SECONDS = float(os.environ.get("SECONDS", "10"))
LIMIT = os.environ.get("LIMIT", "10s")


def asked(controller):
    """The names of the outputs and alarms of a controller's ladders."""
    settings = tomllib.loads(controller.read_text())
    for name in settings["ladder"]:
        if name.startswith("lib:"):
            continue
        ladder = tomllib.loads((controller.parent / name).read_text())
        for tag, meaning in ladder.get("tags", {}).items():
            at = meaning.get("at", "") if isinstance(meaning, dict) else ""
            is_bit = at[:1] in ("Y", "C") and "." not in at
            if at.startswith("Y") and is_bit or "alarm" in meaning and (is_bit or not at):
                yield tag


def record(controller, folder):
    """Runs a copy of a controller, and records it: what it keeps beside its file goes with the copy."""
    left = shutil.ignore_patterns("*.sock*", "*.retain*")
    shutil.copytree(controller.parent, folder / "config", ignore=left)
    command = [RUNGD, "run", str(folder / "config" / controller.name), "--record", str(folder / "record")]
    environment = {**os.environ, "RUNGD_SOCKET": str(folder / "rungd.sock"), "XDG_RUNTIME_DIR": str(folder)}
    with open(folder / "log", "wb") as log:
        running = subprocess.Popen(command, stdout=log, stderr=log, env=environment, cwd=folder)
        time.sleep(SECONDS)
        running.kill()
        running.wait()


def ask(condition, folder):
    """The answer and the time of a question, ms."""
    command = [RUNGD, "how", condition, "--recording", str(folder / "record"), "--at", "-1s", "--time", LIMIT, "--json"]
    begun = time.monotonic()
    found = subprocess.run(command, capture_output=True, text=True)
    ms = (time.monotonic() - begun) * 1000
    if found.returncode not in (0, 1, 2):
        return "refused", ms
    answer = json.loads(found.stdout)["answer"]
    # What is so already needs no search.
    return answer, None if answer == "holds" else ms


def told(name, answers, times):
    counts = ", ".join(f"{count} {answer}" for answer, count in sorted(collections.Counter(answers).items()))
    times = [ms for ms in times if ms is not None]
    spent = f"median {statistics.median(times):.0f} ms, longest {max(times):.0f} ms" if times else "no search"
    print(f"{name}: {len(answers)} questions ({counts}), {spent}", flush=True)


def main():
    given = [pathlib.Path(path).resolve() for path in sys.argv[1:]]
    plants = given or sorted((ROOT / "config").glob("*.toml"))
    answers, times = [], []
    for controller in plants:
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            record(controller, folder)
            found = [ask(sign + tag, folder) for tag in asked(controller) for sign in ("", "!")]
        if not found:
            print(f"{controller.stem}: nothing to ask")
            continue
        told(controller.stem, [answer for answer, _ in found], [ms for _, ms in found])
        answers += [answer for answer, _ in found]
        times += [ms for _, ms in found]
    told("all", answers, times)


main()
