#!/usr/bin/env python3
"""What other people's tools make of the files of `rungd export`: one-off, not part of CI.

    matiec.py BEREMIZ MATIEC RUNGD SCANS LADDER[,LADDER…] …

BEREMIZ and MATIEC are checkouts of github.com/beremiz/beremiz and …/matiec (built: `autoreconf -i &&
./configure && make`); pip's lxml and numpy. Each LADDER (`lib:NAME,FILE` where it needs a library
file) is exported. Then the file is validated against the schema of TC6, opened by Beremiz' loader,
written as ST by its generator, compiled to C by MatIEC, and executed for SCANS scans with random
inputs, beside `rungd sim` of the ladder: every column of the trace that both have is compared in
every scan. Exit code 1 if anything differs.
"""

import os
import random
import re
import subprocess
import sys
import tempfile
import types

DRIVER = """
#include "iec_std_lib.h"
#include <stdio.h>
TIME __CURRENT_TIME;
BOOL __DEBUG;
#define __LOCATED_VAR(type, name, ...) static type store##name; type *name = &store##name;
#include "LOCATED_VARIABLES.h"
#undef __LOCATED_VAR
#include "resource1.c"
void config_init__(void);
void config_run__(unsigned long tick);
int main(void) {
  config_init__();
  %(devices)s
  long at, count; int value;
  if (scanf("%%ld", &count) != 1) return 1;
  for (at = 0; at < count; at++) {
    %(reads)s
    long long ns = (long long)at * %(period)d * 1000000LL;
    __CURRENT_TIME.tv_sec = ns / 1000000000LL;
    __CURRENT_TIME.tv_nsec = ns %% 1000000000LL;
    config_run__(at);
    %(prints)s
    printf("\\n");
  }
  return 0;
}
"""


def beremiz(folder):
    """Beremiz' project controller, without its windows."""
    sys.path.insert(0, folder)
    os.chdir(folder)
    import fake_wx  # noqa: F401

    # A window of its own that the graphics import, and that imports the graphics.
    tips = types.ModuleType("graphics.ToolTipProducer")
    tips.ToolTipProducer = type("ToolTipProducer", (), {})
    sys.modules["graphics.ToolTipProducer"] = tips
    import PLCGenerator
    from PLCControler import PLCControler

    # Python 3 cannot sort the lists among the texts of parallel paths, as Python 2 could.
    source = open(os.path.join(folder, "PLCGenerator.py"), encoding="utf-8").read()
    if "factorized_paths.sort()" in source:
        sorted_paths = "factorized_paths.sort(key=lambda one: (type(one).__name__, repr(one)))"
        source = source.replace("factorized_paths.sort()", sorted_paths)
        exec(compile(source, "PLCGenerator.py", "exec"), PLCGenerator.__dict__)
        import PLCControler as module
        module.GenerateCurrentProgram = PLCGenerator.GenerateCurrentProgram
    return PLCControler


def generated(controler, schema, path, st):
    """Validates, opens and generates; the reason if one of them fails."""
    from lxml import etree

    if not schema.validate(etree.parse(path)):
        return f"schema: {schema.error_log[0]}"
    project = controler()
    error = project.OpenXMLFile(path)
    if error:
        return f"loader: {error}"
    _, errors, warnings = project.GenerateProgram(st)
    return f"generator: {errors} {warnings}" if errors or warnings else None


class Names:
    """The variables of the C code, for columns of the trace."""

    def __init__(self, folder, st):
        text = open(st, encoding="utf-8").read()
        self.located = {}
        for name, kind, place in re.findall(r"(\w+) AT %(.)X(\d+\.\d+)", text):
            self.located[name.upper()] = f"__{kind}X{place.replace('.', '_')}"
        self.own = {}
        for line in open(os.path.join(folder, "VARIABLES.csv"), encoding="utf-8"):
            parts = line.split(";")
            if len(parts) > 5 and parts[1] == "VAR":
                self.own[".".join(parts[2].split(".")[3:])] = parts[4]
        self.inputs = sorted(
            (name, place) for name, place in self.located.items() if place.startswith("__I")
        )

    def expression(self, column):
        """The C expression of a column, and its format; None if there is none."""
        name = column.upper()
        if name.endswith((".OK", ".STALE")):  # a device, which is well in a simulation
            return None
        if name in self.located:
            return f"*{self.located[name]}", "%d"
        # Members of instances are not compared: a reset behind the block writes the program's own.
        one = name.replace(".", "_")
        kind = self.own.get(one)
        if kind == "REAL":
            return f"RESOURCE1__INSTANCE0.{one}.value", "%.9g"
        if kind in ("BOOL", "SINT", "INT", "DINT", "UINT", "USINT", "UDINT", "LINT", "WORD"):
            return f"(long)RESOURCE1__INSTANCE0.{one}.value", "%ld"
        return None


def devices_of(folder):
    """The variables that say that a device is well, in small letters."""
    with open(os.path.join(folder, "devices"), encoding="utf-8") as file:
        return file.read().split()


def executed(folder, names, columns, inputs, period):
    """The rows of the compiled program."""
    reads = "".join(f'if (scanf("%d", &value) != 1) return 1; *{place} = value;\n' for _, place in names.inputs)
    prints = "".join(f'printf("{form} ", {text});\n' for text, form in columns)
    # A device is well in a simulation; the other controller has to write that.
    own = [name for name, kind in names.own.items() if kind == "BOOL" and name.endswith("_OK") and "." not in name]
    devices = "".join(f"RESOURCE1__INSTANCE0.{name}.value = 1;" for name in own if name.lower() in devices_of(folder))
    source = os.path.join(folder, "driver.c")
    with open(source, "w", encoding="utf-8") as file:
        file.write(DRIVER % {"reads": reads, "prints": prints, "period": period, "devices": devices})
    program = os.path.join(folder, "driver")
    subprocess.run(
        ["gcc", "-w", "-O0", "-I", os.path.join(MATIEC, "lib/C"), "-I", folder, source,
         os.path.join(folder, "config.c"), "-lm", "-o", program],
        check=True,
    )
    text = f"{len(inputs)}\n" + "\n".join(" ".join(map(str, row)) for row in inputs)
    done = subprocess.run([program], input=text, capture_output=True, text=True, check=True)
    return [line.split() for line in done.stdout.splitlines()]


def simulated(files, names, inputs, period, folder):
    """The header and the rows of `rungd sim`."""
    stimulus = os.path.join(folder, "stimulus.csv")
    own = [place.replace("__IX", "").split("_") for _, place in names.inputs]
    header = ["scan"] + [f"X{int(byte) * 8 + int(bit)}" for byte, bit in own]
    with open(stimulus, "w", encoding="utf-8") as file:
        file.write(",".join(header) + "\n")
        if len(header) > 1:
            for scan, row in enumerate(inputs):
                file.write(f"{scan}," + ",".join(map(str, row)) + "\n")
    command = [RUNGD, "sim", *files, "--period", f"{period}ms", "--scans", str(len(inputs)), "--trace", "-"]
    if len(header) > 1:
        command += ["--stimulus", stimulus]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = [line.split(",") for line in done.stdout.splitlines()]
    return lines[0], lines[1:]


def compared(ladder, controler, schema, scans):
    """What is wrong with a ladder, or how many columns are the same."""
    files = [name if name.startswith("lib:") else os.path.join(HERE, name) for name in ladder.split(",")]
    folder = tempfile.mkdtemp(prefix="matiec-")
    path, st = os.path.join(folder, "export.xml"), os.path.join(folder, "export.st")
    done = subprocess.run([RUNGD, "export", *files, "-o", path], capture_output=True, text=True)
    if done.returncode != 0:
        return "not exported"
    error = generated(controler, schema, path, st)
    if error:
        return f"FAILED {error}"
    done = subprocess.run(
        [os.path.join(MATIEC, "iec2c"), "-I", os.path.join(MATIEC, "lib"), "-T", folder, st],
        capture_output=True, text=True,
    )
    if done.returncode != 0:
        return f"FAILED iec2c: {done.stderr.splitlines()[:2]}"
    period = int(re.search(r"INTERVAL := T#(\d+)ms", open(st, encoding="utf-8").read()).group(1))
    names = Names(folder, st)
    chance = random.Random(7)
    row, inputs = [0] * len(names.inputs), []
    for _ in range(scans):
        row = [1 - bit if chance.random() < 0.05 else bit for bit in row]
        inputs.append(row)
    header, rows = simulated(files, names, inputs, period, folder)
    with open(os.path.join(folder, "devices"), "w", encoding="utf-8") as file:
        well = (name.lower().replace(".", "_") for name in header if name.endswith(".Ok"))
        file.write("\n".join(well))
    found = [(at, name, names.expression(name)) for at, name in enumerate(header) if at > 1]
    common = [(at, name, c) for at, name, c in found if c]
    theirs = executed(folder, names, [c for _, _, c in common], inputs, period)
    for scan, (own, other) in enumerate(zip(rows, theirs)):
        for (at, name, _), value in zip(common, other):
            if float(own[at]) != float(value):
                return f"FAILED scan {scan}: {name} is {own[at]}, in MatIEC {value} ({folder})"
    return f"{len(common)} of {len(found)} columns, {len(rows)} scans: the same"


if __name__ == "__main__":
    HERE = os.getcwd()
    BEREMIZ, MATIEC, RUNGD = (os.path.abspath(path) for path in sys.argv[1:4])
    os.environ["PWD"] = HERE
    CONTROLER = beremiz(BEREMIZ)
    from lxml import etree

    SCHEMA = etree.XMLSchema(etree.parse(os.path.join(BEREMIZ, "plcopen/tc6_xml_v201.xsd")))
    FAILED = 0
    for LADDER in sys.argv[5:]:
        RESULT = compared(LADDER, CONTROLER, SCHEMA, int(sys.argv[4]))
        FAILED += RESULT.startswith("FAILED")
        print(f"{LADDER}: {RESULT}", flush=True)
    sys.exit(1 if FAILED else 0)
