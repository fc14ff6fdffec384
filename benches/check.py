#!/usr/bin/env python3
"""Time and memory of `rungd check` on huge generated files.

    cargo build --release && benches/check.py target/release/rungd [NAME ...]

Makes one file (or folder) for each case and runs `check` on it. Prints the seconds, the peak of
resident memory, the bytes of the answer, the exit code and the answer's last line. It has no
limits to pass or fail (docs/speed.md, *Judging large files*).
"""
import os, resource, subprocess, sys, tempfile, time

MAIN = '[[program]]\nname = "Main"\n'
N = int(os.environ.get("RUNGS", "10000"))


def rungs(n, rung):
    return "".join(f"[[program.rung]]\n{rung(k)}\n" for k in range(n))


def tags(n, at="C0"):
    return "[tags]\n" + "".join(f'tag_number_{k} = {{ at = "{at}" }}\n' for k in range(n))


def ladder(rung, tag_count=0, head=""):
    return tags(tag_count) + head + MAIN + rungs(N, rung)


def blocks(n):
    return MAIN + "".join(f'[[program]]\nname = "P{k}-x"\nrung = []\n' for k in range(n))


def stages(n, body):
    return MAIN + '[[program]]\nname = "P"\nautostart = true\n' + "".join(
        f'[[program.stage]]\nname = "S{k}x"\nrung = [{{ when = ["X0"], do = [{body(k)}] }}]\n'
        for k in range(n))


OK = 'when = ["X0"]\ndo = ["SET C0", "RST C0"]'
MEMORY = "[memory]\n" + "".join(f"{space} = 65536\n" for space in "XYCD")
TEMPLATE = '[[template]]\nname = "T"\nrung = [{ when = ["X0"], do = ["SET C0", "RST C0"] }]\n[template.parameters]\n'


def many(item):
    return ", ".join(item(k) for k in range(N))


def template(argument):
    parameters = "".join(f'par_number_{k} = {{ type = "bit" }}\n' for k in range(N))
    given = many(lambda k: f'{argument}_{k} = "X0"')
    return TEMPLATE + parameters + MAIN + f'rung = [{{ use = "T", name = "u", with = {{ {given} }} }}]\n'


def device(keys, row):
    return f'[[device]]\nname = "rio"\n{keys}\nmap = [{many(row)}]\n'


CASES = {
    # rungs, each with one mistake
    "fine": lambda: ladder(lambda k: OK),
    "unknown-name": lambda: ladder(lambda k: f'when = ["tga_number_{k}"]\ndo = ["SET C0"]', N),
    "unknown-name-far": lambda: ladder(lambda k: f'when = ["pressure_{k}"]\ndo = ["SET C0"]', N),
    "unknown-block": lambda: ladder(lambda k: f'when = ["X0"]\ndo = ["RUN Q{k}-x"]', 0, blocks(N).removeprefix(MAIN)),
    "unknown-stage": lambda: stages(N, lambda k: f'"JMP T{k}x"'),
    "unknown-stage-bit": lambda: stages(N, lambda k: '"SET C0"') + MAIN.replace("Main", "Two")
        + rungs(N, lambda k: f'when = ["P.T{k}x"]\ndo = ["RST C0"]'),
    "unknown-instruction": lambda: ladder(lambda k: f'when = ["X0"]\ndo = ["OTU{k} C0"]'),
    "unknown-key": lambda: ladder(lambda k: f'whem = ["X0"]\ndo = ["SET C0"]'),
    "unknown-member": lambda: ladder(lambda k: 'when = ["T0.Don"]\ndo = ["SET C0"]'),
    "unknown-allow": lambda: ladder(lambda k: OK + f'\nallow = ["mixed-{k}"]'),
    "contact-syntax": lambda: ladder(lambda k: 'when = ["X0 X1"]\ndo = ["SET C0"]'),
    "instruction-syntax": lambda: ladder(lambda k: 'when = ["X0"]\ndo = ["SET C0 = 3"]'),
    "wrong-type": lambda: ladder(lambda k: 'when = 3\ndo = ["SET C0"]'),
    "bare-string": lambda: ladder(lambda k: 'when = "X0"\ndo = ["SET C0"]'),
    "missing-key": lambda: MAIN + "[[task]]\n" * N,
    "no-contacts": lambda: ladder(lambda k: 'do = ["SET C0"]'),
    "operand-type": lambda: ladder(lambda k: 'when = ["D0"]\ndo = ["SET C0"]'),
    "write-to-input": lambda: ladder(lambda k: 'when = ["X0"]\ndo = ["SET X0"]'),
    "beyond-memory": lambda: ladder(lambda k: 'when = ["X99999"]\ndo = ["SET C0"]'),
    "out-of-range": lambda: ladder(lambda k: 'when = ["X0"]\ndo = ["TMR T0 preset=-3"]'),
    "missing-leg": lambda: ladder(lambda k: 'leg.up = ["X0"]\ndo = ["CNT CT0 preset=3"]'),
    "duplicate-out": lambda: ladder(lambda k: 'when = ["X0"]\ndo = ["OUT C0"]', N),
    "owned-twice": lambda: ladder(lambda k: 'when = ["X0"]\ndo = ["TMR T0 preset=3s"]', N),
    "reset-without-owner": lambda: ladder(lambda k: 'when = ["X0"]\ndo = ["RSTT T0"]', N),
    "sensaphone-same": lambda: ladder(lambda k: 'when = ["X0"]\ndo = ["CTU N0 preset=3"]', N),
    "rung-names": lambda: ladder(lambda k: OK + '\nname = "again"'),
    # rungs, each with one warning
    "bare-timer-value": lambda: ladder(lambda k: 'when = ["T0.Acc > 5"]\ndo = ["SET C0", "RST C0"]', N),
    "constant-compare": lambda: ladder(lambda k: 'when = ["V0 > 70000"]\ndo = ["SET C0", "RST C0"]', N),
    "constant-saturates": lambda: ladder(lambda k: 'when = ["X0"]\ndo = ["MOVE 70000 to=V0"]', N),
    "mixed-and-or": lambda: ladder(lambda k: 'when = ["X0 & X1 | X2"]\ndo = ["SET C0", "RST C0"]', N),
    "array-elements": lambda: '[tags]\ni = { at = "D0", initial = 0 }\n' + "".join(
        f'a{k} = {{ at = "C{k % 999}", count = 2, initial = false }}\n' for k in range(N))
        + MAIN + rungs(N, lambda k: f'when = ["a{k}[i] & X1 | X2"]\ndo = ["SET C0", "RST C0"]'),
    "allowed": lambda: ladder(lambda k: 'when = ["X0 & X1 | X2"]\nallow = ["mixed-and-or"]\ndo = ["SET C0", "RST C0"]', N),
    "unused-tag": lambda: tags(N) + MAIN + rungs(N, lambda k: OK),
    "unused-tag-named": lambda: "[tags]\n" + "".join(f'u{k}u = {{ at = "D{k%4096}" }}\n' for k in range(N))
        + MAIN + rungs(N, lambda k: f'when = ["D{k%4096} > 3"]\ndo = ["SET C0", "RST C0"]'),
    "out-elsewhere": lambda: MAIN + "".join(
        f'[[program]]\nname = "P{k}-x"\nautostart = true\nrung = [{{ when = ["X0"], do = ["OUT C0"] }}]\n' for k in range(N)),
    "stage-never-entered": lambda: stages(N, lambda k: '"SET C0", "RST C0"'),
    "stage-cycle": lambda: stages(N, lambda k: f'"SET C0", "RST C0", "JMP S{(k // 2) * 2 + (k + 1) % 2}x"'),
    "block-never-started": lambda: blocks(N),
    "jump-back": lambda: stages(N, lambda k: f'"OUT C0", "JMP S{max(0, k - 1)}x"'),
    "entask-conflict": lambda: '[[task]]\nname = "R"\n' + ladder(lambda k: 'when = ["X0"]\ndo = ["ENTASK R every=1s"]'),
    "multi-scan": lambda: MAIN + '[[program.rung]]\nwhen = ["X0"]\ndo = ["ENTASK R"]\n[[task]]\nname = "R"\n'
        + rungs(N, lambda k: 'when = ["X0"]\ndo = ["TMR T0 preset=3s"]').replace("program", "task"),
    # templates
    "template-arguments": lambda: template("par_number"),
    "template-unknown-arguments": lambda: template("pra_number"),
    "template-unknown-names": lambda: '[[template]]\nname = "T"\n[template.tags]\n' + "".join(
        f'tag_number_{k} = {{ type = "bit", spare = true }}\n' for k in range(N))
        + rungs(N, lambda k: f'when = ["tga_number_{k}"]\ndo = ["STOP"]').replace("program.rung", "template.rung")
        + MAIN + 'rung = [{ use = "T", name = "u" }]\n',
    # names
    "duplicate-tags-blocks": lambda: MAIN + '[[program]]\nname = "P"\n' * N,
    "order": lambda: "[ladder]\norder = [\"Main\"]\n" + blocks(N),
    "aliases": lambda: "[tags]\n" + "".join(f'a{k}a = {{ at = "D0", initial = {k} }}\n' for k in range(N)) + MAIN,
    "headers": lambda: MAIN + '[[task]]\nname = "R"\n' + '[[program.rung]]\nwhen = ["X0"]\ndo = ["EXIT"]\n[[task.rung]]\nwhen = ["X0"]\ndo = ["EXIT"]\n' * N,
    "duplicate-keys": lambda: MAIN + '[program.rung]\nwhen = ["X0"]\n' * N,
    "syntax": lambda: MAIN + 'x = = 3\n' * N,
    "control": lambda: MAIN + 'x = "\x01"\n' * N,
    # size
    "long-name": lambda: MAIN + f'[[program.rung]]\nwhen = ["{"n" * 10_000_000}"]\ndo = ["SET C0"]\n',
    "long-dashes": lambda: MAIN + f'[[program.rung]]\nwhen = ["n{"-" * 10_000_000}"]\ndo = ["SET C0"]\n',
    "long-tag": lambda: f'[tags]\n{"n" * 10_000_000} = {{ at = "C0" }}\n' + MAIN + rungs(N, lambda k: 'when = ["C0"]\ndo = ["OUT C0"]'),
    "long-number": lambda: MAIN + f'[[program.rung]]\nwhen = ["D0 > {"9" * 10_000_000}"]\ndo = ["SET C0"]\n',
    "long-mnemonic": lambda: MAIN + f'[[program.rung]]\nwhen = ["X0"]\ndo = ["{"n" * 10_000_000} C0"]\n',
    "long-key": lambda: MAIN + f'{"n" * 10_000_000} = 3\n',
    "long-series": lambda: MAIN + f'[[program.rung]]\nwhen = ["X0{" & X0" * 2_000_000}"]\ndo = ["SET C0", "RST C0"]\n',
    "long-mixed": lambda: MAIN + f'[[program.rung]]\nwhen = ["X0{" & X0 | X1" * 1_000_000}"]\ndo = ["SET C0", "RST C0"]\n',
    "long-do": lambda: MAIN + f'[[program.rung]]\nwhen = ["X0"]\ndo = [{chr(34)}SET C0", {chr(34)}RST C0{chr(34)}{", " + chr(34) + "OUT C1" + chr(34)} ]\n'.replace(', "OUT C1"', ', "OUT C1"' * N),
    "long-operands": lambda: MAIN + f'[[program.rung]]\nwhen = ["X0"]\ndo = ["SET{" C0" * N}"]\n',
    "long-keys": lambda: MAIN + f'[[program.rung]]\nwhen = ["X0"]\ndo = ["TMR T0{" preset=3s" * N}"]\n',
    "branches": lambda: MAIN + '[[program.rung]]\nwhen = ["X0"]\n' + '[[program.rung.branch]]\nwhen = ["X1"]\ndo = ["OUT C0"]\n' * N,
    "deep-parens": lambda: MAIN + f'[[program.rung]]\nwhen = ["{"(" * 1_000_000}X0{")" * 1_000_000}"]\ndo = ["SET C0"]\n',
    "deep-arrays": lambda: "x = " + "[" * 1_000_000 + "]" * 1_000_000 + "\n",
    "deep-tables": lambda: "[" + ".".join(["a"] * 1_000_000) + "]\nx = 1\n",
    "deep-tables-many": lambda: "".join("[" + ".".join([f"a{k}"] * 70) + "]\n" for k in range(N)),
    "big-comment": lambda: "#" + "x" * (250 << 20) + "\n" + MAIN,
    "big-string": lambda: '[ladder]\ndoc = "' + "x" * (250 << 20) + '"\n' + MAIN,
    "big-array": lambda: "x = [" + "1," * (125 << 20) + "]\n" + MAIN,
    "big-newlines": lambda: "\n" * (250 << 20) + MAIN,
    "big-keys": lambda: "".join(f"k{k}=1\n" for k in range(20_000_000)) + MAIN,
    "big-brackets": lambda: "[" * (250 << 20),
    "big-contacts": lambda: MAIN + "[[program.rung]]\nwhen = [" + '"",' * (80 << 20) + ']\ndo = ["SET C0"]\n',
    "big-empty-tables": lambda: MAIN + "rung = [" + "{}," * (80 << 20) + "]\n",
}


def files(n, text):
    return {f"f{k}.toml": text(k) for k in range(n)}


def controlled(controller, head=""):
    return {"controller.toml": f'ladder = ["f.toml"]\n{controller}', "f.toml": head + MAIN + rungs(1, lambda k: OK)}


FOLDERS = {
    "many-files": lambda: {"controller.toml": "ladder = [" + ", ".join(f'"f{k}.toml"' for k in range(N)) + "]\n",
        **files(N, lambda k: MAIN if k == 0 else f'[[task]]\nname = "R{k}-x"\n')},
    "retain-names": lambda: {"controller.toml": 'ladder = ["f.toml"]\n[retain]\nranges = ['
        + ", ".join(f'"tga_number_{k}"' for k in range(N)) + "]\n", "f.toml": tags(N, "D0") + MAIN},
    "retain-tags": lambda: controlled("[retain]\ntags = [" + many(lambda k: f'"tag_number_{k}"') + "]\n", tags(N, "D0")),
    "retain-unknown-tags": lambda: controlled("[retain]\ntags = [" + many(lambda k: f'"tga_number_{k}"') + "]\n", tags(N, "D0")),
    "retain-patterns": lambda: controlled("[retain]\ntags = [" + many(lambda k: f'"*_number_{k}"') + "]\n", tags(N, "D0")),
    "retain-ranges": lambda: controlled(MEMORY + "[retain]\nranges = [" + many(lambda k: '"D0..D65535"') + "]\n"),
    "plant-points": lambda: controlled(device('driver = "simulated"\npart = [' + many(
        lambda k: f'{{ kind = "motor", name = "motor_number_{k}", run = "motor_number_0.running" }}') + "]",
        lambda k: f'{{ from = "Y0", to = "mtoor_number_{k}.run" }}')),
    "device-lines": lambda: controlled(MEMORY + device('driver = "gpio"\nchip = "/dev/gpiochip0"',
        lambda k: f'{{ from = "line {k}", to = "X{k}" }}')),
    "device-outputs": lambda: controlled(MEMORY + device('driver = "modbus-tcp"\naddress = "127.0.0.1:502"',
        lambda k: f'{{ from = "Y{k}", to = "coil {k // 2}" }}')),
    "device-long-rows": lambda: controlled(MEMORY + device('driver = "modbus-tcp"\naddress = "127.0.0.1:502"',
        lambda k: '{ from = "coil 0..65535", to = "X0..X65535" }')),
    "modbus-map": lambda: controlled(MEMORY + "[modbus-server]\nstandard-map = false\nwritable = ["
        + many(lambda k: f'"D{k}"') + "]\n" + "".join(
        f'[[modbus-server.map]]\noperand = "D{k}"\ntable = "holding"\naddress = {2 * k % 65536}\n' for k in range(N))),
    "simulated-inputs": lambda: controlled(MEMORY + "".join(
        f'[[simulated-device]]\ninput = "X{k}"\nfollows = "tga_number_{k}"\n' for k in range(N)), tags(N, "D0")),
    "outputs-held": lambda: controlled(MEMORY + "[outputs]\non = [" + many(lambda k: f'"Y{k}"') + "]\nhold = ["
        + many(lambda k: '"Y32768..Y65535"') + "]\n"),
    "panels": lambda: controlled(MEMORY + "[web]\nwrite = [" + many(lambda k: f'"C{k}"') + "]\n" + "".join(
        f'[[panel]]\nname = "p{k}"\nshow = [{{ button = "C{k}" }}, {{ lamp = "tga_number_{k}" }}]\n' for k in range(N)),
        tags(N, "D0")),
    "retain-unreadable": lambda: {"controller.toml": 'ladder = ["f.toml", "gone.toml"]\n[retain]\nranges = ['
        + ", ".join(f'"t{k}t"' for k in range(N)) + "]\n", "f.toml": MAIN},
}


def run(rungd, path):
    start = time.monotonic()
    limit = int(os.environ.get("MEMORY_GB", "6")) << 30
    with tempfile.TemporaryFile() as out:
        child = subprocess.Popen([rungd, "check", path], stdout=out, stderr=out,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))
        timer = __import__("threading").Timer(float(os.environ.get("SECONDS_MAX", "60")), child.kill)
        timer.start()
        _, status, usage = os.wait4(child.pid, 0)
        timer.cancel()
        size = out.tell() or out.seek(0, 2)
        out.seek(max(0, size - 300))
        last = out.read().decode(errors="replace").strip().splitlines()[-1:]
    code = os.waitstatus_to_exitcode(status)
    return time.monotonic() - start, usage.ru_maxrss / 1024, size, code, (last or [""])[0][:70]


def main():
    rungd, names = sys.argv[1], sys.argv[2:]
    print(f"{N} rungs\n{'case':22} {'s':>7} {'MiB':>6} {'bytes':>9} exit  last line")
    for name in names or [*CASES, *FOLDERS]:
        with tempfile.TemporaryDirectory() as folder:
            made = CASES[name] if name in CASES else FOLDERS[name]
            made = made()
            made = made if isinstance(made, dict) else {"ladder.toml": made}
            for file, text in made.items():
                with open(os.path.join(folder, file), "w") as f:
                    f.write(text)
            first = os.path.join(folder, next(iter(made)))
            seconds, mib, size, code, last = run(rungd, first)
            print(f"{name:22} {seconds:7.2f} {mib:6.0f} {size:9} {code:4}  {last}", flush=True)


main()
