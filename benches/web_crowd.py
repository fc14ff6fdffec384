#!/usr/bin/env python3
"""A crowd at `rungd web`: does the controller behind it miss a scan?

    benches/web_crowd.py [target/release/rungd] [seconds]

A run has three phases of equal length: no clients, the crowd, no clients again. The crowd: 1,000
connections that send only the beginning of a request, 64 live pages that read nothing, and a client that
sends garbage as fast as it can. For each phase it prints the scans, overruns and skipped grid points, the
processor time of both processes, and the memory of `rungd web`.
"""

import json
import os
import pathlib
import re
import resource
import socket
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
RUNGD = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "target/release/rungd").resolve()
SECONDS = float(sys.argv[2]) if len(sys.argv) > 2 else 20.0
SLOW, FROZEN = 1000, 64


def status(sock):
    said = subprocess.run([RUNGD, "status", "--json", "--socket", sock], capture_output=True, check=True)
    return json.loads(said.stdout)["scan"]


def cpu_s(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory_mb(pid):
    text = pathlib.Path(f"/proc/{pid}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", text)[1]) / 1024


class Crowd:
    def __init__(self, port, cookie):
        self.port, self.cookie, self.open, self.over = port, cookie, [], threading.Event()
        self.sent = 0

    def connect(self, data):
        try:
            conn = socket.create_connection(("127.0.0.1", self.port), timeout=2)
            conn.sendall(data)
            return conn
        except OSError:
            return None

    def slow(self):
        while not self.over.is_set():
            mine = [self.connect(b"GET /api/ladder HTTP/1.1\r\nHos") for _ in range(SLOW // 4)]
            self.over.wait(5)
            for conn in filter(None, mine):
                conn.close()

    def frozen(self):
        request = f"GET /events?element=Main&from=1&to=9 HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\n"
        request += f"Cookie: {self.cookie}\r\n\r\n"
        self.open = [self.connect(request.encode()) for _ in range(FROZEN)]
        self.over.wait()

    def garbage(self):
        while not self.over.is_set():
            conn = self.connect(os.urandom(200) + b"\r\n\r\n")
            if conn:
                self.sent += 1
                conn.close()

    def run(self, seconds):
        # The live pages come first, because the slow clients may leave no seats for them.
        todo = [self.frozen] + [self.slow] * 4 + [self.garbage]
        threads = [threading.Thread(target=of, daemon=True) for of in todo]
        for at, thread in enumerate(threads):
            thread.start()
            time.sleep(0.5 if at == 0 else 0)
        time.sleep(seconds)
        self.over.set()
        for thread in threads:
            thread.join(10)
        for conn in filter(None, self.open):
            conn.close()


def main():
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(most, 8192), most))
    folder = tempfile.mkdtemp()
    sock = os.path.join(folder, "s")
    env = dict(os.environ, RUNGD_SOCKET=sock)
    log = open(os.path.join(folder, "log"), "w")
    plant = [RUNGD, "run", ROOT / "config/lift-station.toml"]
    run = subprocess.Popen(plant, env=env, stdout=log, stderr=log)
    time.sleep(2)
    web = subprocess.Popen(
        [RUNGD, "web", "--listen", "127.0.0.1:0", "--socket", sock], stderr=subprocess.PIPE, text=True
    )
    link = next(line for line in web.stderr if "://" in line)
    port, path = re.search(r"http://127\.0\.0\.1:(\d+)(\S+)", link).groups()
    threading.Thread(target=lambda: web.stderr.read(), daemon=True).start()
    with socket.create_connection(("127.0.0.1", int(port))) as conn:
        conn.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n".encode())
        cookie = re.search(r"set-cookie: ([^;]+)", conn.recv(4096).decode())[1]
    print(f"{'':14}{'scans':>8}{'overruns':>10}{'skipped':>9}{'controller':>12}{'web':>8}{'memory':>9}")
    for name in ["nobody", "the crowd", "nobody again"]:
        before, cpu, began = status(sock), (cpu_s(run.pid), cpu_s(web.pid)), time.monotonic()
        if name == "the crowd":
            crowd = Crowd(int(port), cookie)
            crowd.run(SECONDS)
        else:
            time.sleep(SECONDS)
        after, took = status(sock), time.monotonic() - began
        scans, overruns, skipped = (after[key] - before[key] for key in ["scans", "overruns", "skipped"])
        shares = [(now - then) / took * 100 for now, then in zip((cpu_s(run.pid), cpu_s(web.pid)), cpu)]
        print(
            f"{name:14}{scans:8}{overruns:10}{skipped:9}{shares[0]:10.1f} %{shares[1]:6.1f} %"
            f"{memory_mb(web.pid):6.0f} MB"
        )
    print(f"{crowd.sent} pieces of garbage were sent")
    web.terminate()
    run.terminate()
    run.wait()


main()
