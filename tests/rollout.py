#!/usr/bin/env python3
"""The rollout of docs/fleet.md (packaging/ansible/rollout.yml), run on controllers on this machine.

usage: tests/rollout.py RUNGD [CONTROLLERS]      with ansible-playbook (pip: ansible-core); default 7

Each controller is a process with its own folder and socket; Ansible reaches all of them by its local
connection. There are four rollouts: a good one, one that `rungd check` refuses, one whose program stops in its
probation at the third host, and one that is refused because an output is forced. After each rollout, every
controller must run the ladder that the page promises, and have it in its files. Exit code 77: Ansible is missing.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PLAYBOOK = os.path.join(HERE, "packaging/ansible/rollout.yml")
PROBATION = "2s"

CONTROLLER = f"""ladder = ["ladder.toml"]

[scan]
period = "20ms"
watchdog = "500ms"

[reload]
probation = "{PROBATION}"

[operator]
socket = "rungd.sock"
"""

LADDER = """[ladder]
name = "press"

[tags]
lamp = {{ at = "Y0" }}
shown = {{ at = "D0" }}

[[program]]
name = "Main"

[[program.rung]]
when = ["$On"]
do = ["MOVE {value} to=shown", "OUT lamp"]
{more}"""

# Rungs that stop the controller a second after the reload.
STOPS = """
[[program.rung]]
when = ["$On"]
do = ["TMR T0 preset=1s"]

[[program.rung]]
when = ["T0.Done"]
do = ["STOP"]
"""


class Plant:
    def __init__(self, rungd, count):
        self.rungd = os.path.abspath(rungd)
        self.folder = tempfile.mkdtemp(prefix="rungd-rollout-")
        self.names = [f"press-{number:02}" for number in range(count)]
        self.processes = []
        for name in self.names:
            self.put(self.etc(name), 1)
            self.put(self.source(name), 1)
        hosts = {
            name: {
                "folder": self.etc(name),
                "ansible_connection": "local",
                "ansible_python_interpreter": sys.executable,
                "rungd": f"env RUNGD_SOCKET={self.etc(name)}/rungd.sock {self.rungd}",
            }
            for name in self.names
        }
        with open(os.path.join(self.folder, "hosts.json"), "w") as file:
            json.dump({"all": {"children": {"controllers": {"hosts": hosts}}}}, file)

    def etc(self, name):
        return os.path.join(self.folder, "etc", name)

    def source(self, name):
        return os.path.join(self.folder, "plants", name)

    def put(self, folder, value, more=""):
        os.makedirs(folder, exist_ok=True)
        with open(os.path.join(folder, "controller.toml"), "w") as file:
            file.write(CONTROLLER)
        with open(os.path.join(folder, "ladder.toml"), "w") as file:
            file.write(LADDER.format(value=value, more=more))

    def start(self):
        for name in self.names:
            log = open(os.path.join(self.folder, f"{name}.log"), "w")
            command = [self.rungd, "run", os.path.join(self.etc(name), "controller.toml")]
            self.processes.append(subprocess.Popen(command, stderr=log, cwd=self.etc(name)))
        for name in self.names:
            self.wait(lambda: self.ask(name, "status", "--require-run").returncode == 0)

    def end(self):
        for process in self.processes:
            process.terminate()
        for process in self.processes:
            process.wait(60)
        shutil.rmtree(self.folder)

    def ask(self, name, *words):
        environment = dict(os.environ, RUNGD_SOCKET=os.path.join(self.etc(name), "rungd.sock"))
        return subprocess.run([self.rungd, *words], env=environment, capture_output=True, text=True)

    def wait(self, holds):
        until = time.monotonic() + 120
        while not holds():
            assert time.monotonic() < until, "it does not come"
            time.sleep(0.1)

    def shown(self, name):
        answer = json.loads(self.ask(name, "read", "--json", "shown").stdout)
        return answer["values"][0]["value"]

    def mode(self, name):
        return json.loads(self.ask(name, "status", "--json").stdout)["mode"]

    def rollout(self, *words):
        """Runs the rollout; returns the exit code and Ansible's output."""
        command = ["ansible-playbook", "-i", os.path.join(self.folder, "hosts.json"), PLAYBOOK]
        command += ["-e", f"source={self.folder}/plants", "-e", "probation_seconds=3", *words]
        environment = dict(os.environ, ANSIBLE_NOCOWS="1", ANSIBLE_LOCALHOST_WARNING="0")
        environment.update(ANSIBLE_HOME=os.path.join(self.folder, ".ansible"))
        done = subprocess.run(command, capture_output=True, text=True, env=environment)
        return done.returncode, done.stdout + done.stderr

    def judge(self, title, wanted):
        """Checks that each controller is in RUN with its expected value, which is in its ladder file too."""
        for name in self.names:
            self.wait(lambda: self.mode(name) == "RUN")
            self.wait(lambda: self.shown(name) == wanted[name])
            with open(os.path.join(self.etc(name), "ladder.toml")) as file:
                assert f"MOVE {wanted[name]} " in file.read(), (title, name)
        print(f"ok  {title}", flush=True)


def main():
    if len(sys.argv) < 2 or shutil.which("ansible-playbook") is None:
        print(__doc__)
        sys.exit(77 if len(sys.argv) > 1 else 2)
    plant = Plant(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 7)
    try:
        plant.start()
        play(plant)
    finally:
        plant.end()


def play(plant):
    begun = time.monotonic()
    for name in plant.names:
        plant.put(plant.source(name), 2)
    code, said = plant.rollout()
    assert code == 0, said
    plant.judge(f"{len(plant.names)} controllers run the new ladder", {name: 2 for name in plant.names})
    took = time.monotonic() - begun

    plant.put(plant.source(plant.names[-1]), "nothing")
    plant.put(plant.source(plant.names[0]), 3)
    code, said = plant.rollout()
    assert code != 0 and "nothing" in said, said
    plant.judge("a wrong file anywhere: no controller is touched", {name: 2 for name in plant.names})

    for name in plant.names:
        plant.put(plant.source(name), 3, STOPS if name == plant.names[2] else "")
    code, said = plant.rollout()
    assert code != 0 and "went back, or stopped" in said, said
    # An instruction stopped the controller, which is not a fault: a person starts it again.
    ran = plant.ask(plant.names[2], "mode", "run")
    assert ran.returncode == 0, (ran, said)
    wanted = {name: 3 if at in (0, 1) or 2 < at < 6 else 2 for at, name in enumerate(plant.names)}
    plant.judge("the third one stops: it has its old ladder, the batches behind it too", wanted)

    for name in plant.names:
        plant.put(plant.source(name), 4)
    assert plant.ask(plant.names[4], "force", "lamp", "0").returncode == 0
    code, said = plant.rollout()
    assert code != 0 and "has forces" in said, said
    plant.judge("somebody works at one: no controller is touched", wanted)
    print(f"a good rollout took {took:.0f} s, with 3 s of probation for each batch")


main()
