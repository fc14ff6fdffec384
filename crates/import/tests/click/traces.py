"""Random CLICK ladders, and what pyrung does with them: `python3 traces.py COUNT SCANS [FIRST] > FILE`.

Needs `pip install pyrung`. FIRST is the number of the first ladder, 0 by default. The tests execute
the same ladders (`traces.rs`).
"""

import random
import sys
import tempfile
import warnings
from pathlib import Path

from pyrung import PLC
from pyrung.click import ladder_to_pyrung

COLUMNS = 31
HEADER = ["marker"] + [chr(65 + i) if i < 26 else "A" + chr(39 + i) for i in range(COLUMNS)] + ["AF"]
BITS = ["X001", "X002", "X003", "X004", "Y001", "Y002", "C1", "C2", "C3", "T1", "CT1"]
WORDS = ["DS1", "DS2", "DS3", "DS4", "DS5", "DD1", "DD2", "TD1", "CTD1"]
TARGETS = ["DS1", "DS2", "DD1"]
SETTABLE = ["X001", "X002", "X003", "X004", "DS3", "DD2"]


def contact(r):
    kind = r.randrange(10)
    if kind < 6:
        return r.choice(["", "~"]) + r.choice(BITS)
    if kind < 8:
        return f"{r.choice(['rise', 'fall'])}({r.choice(BITS[:4])})"
    right = r.choice(WORDS + [str(r.randrange(-5, 60))])
    return r.choice(WORDS) + r.choice(["==", "!=", "<", "<=", ">", ">="]) + right


def series(r, width):
    cells = [contact(r) for _ in range(r.randrange(1, width + 1))]
    return cells + ["-"] * (width - len(cells))


def rung(r, made):
    """The rows of a rung: maybe parallel rows before the rest of the first row."""
    width = r.randrange(1, 4)
    rows = r.randrange(1, 4)
    grid = [series(r, width) + [("T" if i < rows - 1 else "-") if rows > 1 else "-"] for i in range(rows)]
    if rows > 1:
        grid[-1][-1] = ""
        for row in grid[1:-1]:
            row[-1] = "|"
    grid[0] += series(r, r.randrange(1, 3))
    grid = [row + ["-" if i == 0 else ""] * (COLUMNS - len(row)) for i, row in enumerate(grid)]
    pins = []
    kind = r.randrange(12)
    if kind > 9:  # a row of an input follows the instruction
        rows, grid = 1, [series(r, 3) + ["-"] * (COLUMNS - 3)]
    calls = [""] * rows
    word = lambda: r.choice(WORDS + [str(r.randrange(-9, 99))])
    if kind < 3:
        calls[0] = f"out({r.choice(['Y001', 'Y002', 'C1'])})"
    elif kind < 6:
        calls[0] = f"{r.choice(['latch', 'reset'])}({r.choice(['C2', 'C3', 'C2..C3', 'Y002'])})"
    elif kind < 8:
        block = r.choice(["blockcopy(DS1..DS2,DS2..DS3)", "blockcopy(DS2..DS3,DS1..DS2)", "blockcopy(DD1..DD2,DS4..DS5)"])
        calls[0] = r.choice([f"copy({word()},{r.choice(TARGETS)})", f"fill({word()},{r.choice(['DS1..DS2', 'DD1..DD2'])})", block])
    elif kind < 10:
        expression = r.choice(["{} + {}", "({} - {}) * 7", "{} * {}", "{} + {} - 3"])
        calls[0] = f"math({expression.format(word(), word())},{r.choice(TARGETS)},mode=decimal)"
    elif kind == 10 and "timer" not in made:
        made.add("timer")
        name = r.choice(["on_delay", "on_delay", "off_delay"])
        calls[0] = f"{name}(T1,TD1,preset={r.choice(['45', '100', 'DS3'])},unit=Tms)"
        if name == "on_delay" and r.randrange(2):
            pins = [".reset()"]
    elif kind == 11 and "counter" not in made:
        made.add("counter")
        name = r.choice(["count_up", "count_down"])
        calls[0] = f"{name}(CT1,CTD1,preset={r.choice(['3', '5'])})"
        pins = [".down()"] if name == "count_up" and r.randrange(2) else []
        pins.append(".reset()")
    else:
        calls[0] = "out(C1)"
    for pin in pins:
        grid.append([r.choice(BITS[:4] + ["~C2", "C3"])] + ["-"] * (COLUMNS - 1))
        calls.append(pin)
    return [["R" if i == 0 else ""] + row + [calls[i]] for i, row in enumerate(grid)]


def trace(number, scans):
    r = random.Random(number)
    made = set()
    rows = [row for _ in range(r.randrange(3, 9)) for row in rung(r, made)]
    lines = [",".join(f'"{cell}"' if "," in cell else cell for cell in row) for row in [HEADER, *rows]]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "main.csv"
        path.write_text("\n".join(lines) + "\n")
        code = ladder_to_pyrung(path, validate=False)
    names = {}
    exec(code, names)
    plc = PLC(names["logic"], dt=0.010)
    out = [f"program {number}", *lines, "scans"]
    for scan in range(scans):
        changes = {}
        if scan > 0:
            for name in SETTABLE:
                if r.randrange(4 if name[0] == "X" else 9) == 0:
                    changes[name] = r.randrange(2) if name[0] == "X" else r.choice([r.randrange(120), r.randrange(-40000, 40000) if name == "DD2" else 7])
        patch = {}
        for name, value in list(changes.items()):
            if tag_of(names, name) is None:
                del changes[name]
                continue
            patch[tag_of(names, name)] = bool(value) if name[0] == "X" else value
        if patch:
            plc.patch(patch)
        plc.step()
        state = plc.current_state.tags
        values = []
        for name in BITS[4:] + WORDS:
            tag = tag_of(names, name)
            if tag is not None:
                values.append(f"{name}={int(state.get(tag, 0))}")
        left = " ".join(f"{name}={value}" for name, value in changes.items())
        out.append(f"{left} | {' '.join(values)}")
    return out


def tag_of(names, address):
    """The name of the tag that the generated code has for an address; `None`: it has none."""
    if address in names:
        found = names[address]
        return found.Done.name if hasattr(found, "Done") else found.name
    for prefix, timer in (("TD", "T"), ("CTD", "CT")):
        if address.startswith(prefix) and timer + address[len(prefix):] in names:
            found = names[timer + address[len(prefix):]]
            return found.Acc.name if hasattr(found, "Acc") else None
    return None


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    left = int(sys.argv[1])
    number = int(sys.argv[3]) if len(sys.argv) > 3 else 0
    while left > 0:
        try:
            print("\n".join(trace(number, int(sys.argv[2]))))
            left -= 1
        except NameError as error:
            # The code that pyrung makes does not declare an address that a range has too.
            print(f"program {number} is left out: {error}", file=sys.stderr)
        number += 1
