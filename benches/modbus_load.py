#!/usr/bin/env python3
"""Wake-up lateness of the scan under a load of Modbus clients, compared with an idle server.

usage: benches/modbus_load.py [--rungd PATH] [--rounds 6] [--seconds 10] [--connections 300]
                              [--rate 1000]

Starts rungd with a period of 1 ms and its Modbus server on loopback. After a warm-up, phases without
clients and phases with `connections` clients alternate; together the clients send `rate` requests a
second. A third of the requests is malformed: functions and addresses that do not exist, writes to
elements outside the map, requests shorter than their length field, and bytes that are not Modbus
(after which the client connects again). A second third writes. The figures come from rungd's own
statistics, one line a second: the sum of the overruns, and the median of the lines' percentiles of
lateness. The processor time that the hypervisor took (steal) is printed beside them, because it
delays every process.
"""

import argparse, asyncio, json, os, random, statistics, struct, subprocess, tempfile, threading, time

LADDER = '[[program]]\nname = "Main"\n[[program.rung]]\nwhen = ["MC1"]\ndo = ["OUT Y0"]\n'
CONTROLLER = """ladder = ["ladder.toml"]
[scan]
period   = "1ms"
[realtime]
{policy}
cpu-latency = "0us"
[log]
statistics = "1s"
[modbus-server]
listen      = "127.0.0.1:{port}"
connections = {connections}
writable    = ["MC1..MC64", "MHR1..MHR64"]
"""
GOOD = [bytes([1, 0, 0, 0, 64]), bytes([2, 0, 0, 0, 16]), bytes([3, 0, 0, 0, 125]),
        bytes([4, 0, 0, 0, 8])]
WRITES = [bytes([5, 0, 0, 0xFF, 0]), bytes([6, 0, 3, 0, 7]), bytes([15, 0, 0, 0, 9, 2, 255, 1]),
          bytes([16, 0, 0, 0, 2, 4, 0, 1, 0, 2])]
BAD = [bytes([99, 0, 0]), bytes([3, 0xFF, 0xFF, 0, 9]), bytes([6, 0, 200, 0, 1]), bytes([3, 0]),
       bytes([15, 0, 0, 0, 9, 9, 1]), None]


def frame(number, pdu):
    if pdu is None:
        return b"GET / HTTP/1.1\r\n\r\n"
    return struct.pack(">HHHB", number & 0xFFFF, 0, len(pdu) + 1, 1) + pdu


async def client(port, at, arguments, counts, ends):
    """Sends a request every `connections / rate` seconds, the first one after a delay."""
    chance, every = random.Random(at), arguments.connections / arguments.rate
    due = time.monotonic() + every * at / arguments.connections
    stream, number = None, 0
    while due < ends:
        await asyncio.sleep(max(0.0, due - time.monotonic()))
        due, number = due + every, number + 1
        try:
            stream = stream or await asyncio.open_connection("127.0.0.1", port)
            reader, writer = stream
            pdu = chance.choice((GOOD, WRITES, BAD)[number % 3])
            writer.write(frame(number, pdu))
            counts["sent"] += 1
            counts["malformed"] += number % 3 == 2
            head = await asyncio.wait_for(reader.readexactly(7), 15)
            reply = await asyncio.wait_for(reader.readexactly(head[5] - 1), 15)
            counts["answered"] += 1
            counts["exceptions"] += reply[0] >= 0x80
        except (OSError, asyncio.IncompleteReadError, asyncio.TimeoutError):
            counts["closed"] += 1
            if stream:
                stream[1].close()
            stream = None
    if stream:
        stream[1].close()


async def load(port, arguments, counts):
    ends = time.monotonic() + arguments.seconds
    await asyncio.gather(*(client(port, at, arguments, counts, ends)
                           for at in range(arguments.connections)))


def stolen():
    with open("/proc/stat") as file:
        return int(file.readline().split()[8]) * 1000 / os.sysconf("SC_CLK_TCK")


def phases(lines, spans):
    """Sums up the statistics of all phases of one kind."""
    inside = [line for came, line in lines
              if any(begin + 1.1 <= came <= end for begin, end, _ in spans)]
    middle = lambda field: round(statistics.median(line[field] for line in inside), 1)
    total = lambda field: sum(line[field] for line in inside)
    return {"seconds": len(inside), "scans": total("scans"), "overruns": total("overruns"),
            "skipped": total("skipped"), "late_us_p50": middle("late_us_p50"),
            "late_us_p99": middle("late_us_p99"), "scan_us_p99": middle("scan_us_p99"),
            "steal_ms": sum(steal for _, _, steal in spans)}


def span(act):
    begin, before = time.monotonic(), stolen()
    act()
    return begin, time.monotonic(), stolen() - before


def may_be_realtime():
    try:
        done = subprocess.run(["chrt", "-f", "80", "true"], stderr=subprocess.DEVNULL, check=False)
        return done.returncode == 0
    except OSError:
        return False


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--rungd", default="target/release/rungd")
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--connections", type=int, default=300)
    parser.add_argument("--rate", type=float, default=1000)
    parser.add_argument("--port", type=int, default=15020)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        policy = 'policy = "fifo"\npriority = 80' if may_be_realtime() else ""
        with open(os.path.join(folder, "ladder.toml"), "w") as file:
            file.write(LADDER)
        with open(os.path.join(folder, "controller.toml"), "w") as file:
            file.write(CONTROLLER.format(policy=policy, port=arguments.port,
                                         connections=arguments.connections + 20))
        command = [arguments.rungd, "run", os.path.join(folder, "controller.toml"),
                   "--log-format", "json"]
        rungd = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        lines, granted = [], []

        def read():
            for text in rungd.stderr:
                line = json.loads(text)
                if line["message"].startswith("scan statistics of the last"):
                    lines.append((time.monotonic(), line))
                elif line["message"] == "real-time posture":
                    granted.append(line["granted"])

        reader = threading.Thread(target=read)
        reader.start()
        counts = dict.fromkeys(("sent", "malformed", "answered", "exceptions", "closed"), 0)
        try:
            time.sleep(2)
            idle, busy = [], []
            for _ in range(arguments.rounds):
                idle.append(span(lambda: time.sleep(arguments.seconds)))
                busy.append(span(lambda: asyncio.run(load(arguments.port, arguments, counts))))
        finally:
            rungd.terminate()
            rungd.wait()
            reader.join()
    idle, busy = phases(lines, idle), phases(lines, busy)
    print("posture:", *granted)
    print("idle:", json.dumps(idle))
    print("load:", json.dumps(busy))
    print("clients:", json.dumps(counts), "exit code:", rungd.returncode)
    print(f"p99 lateness: {busy['late_us_p99'] - idle['late_us_p99']:+.1f} us; "
          f"overruns: {busy['overruns'] - idle['overruns']:+d}")


if __name__ == "__main__":
    main()
