#!/usr/bin/env python3
"""Remote I/O for tests: Modbus TCP servers with a clock of their own, which note what changes when.

usage: watched_io.py [HOST:PORT[,watchdog=REGISTER:MS]]...

A process of its own, of Python's standard library alone. Each address given is a device with 65,536
coils, discrete inputs, holding and input registers. `watchdog=100:400` gives it what couplers have:
its coils and holding registers drop to zero where holding register 100 was not written for 400 ms;
the next write of that register ends it. It begins with the first write.

Standard output first says `{"listening": [PORT...]}`; then each line of standard input is a command,
answered by one line of JSON with the moment `at` (us of CLOCK_MONOTONIC) at which it was obeyed:

    mark                          nothing but the moment
    set DEVICE BANK ADDRESS VALUE move an input: BANK is discrete or input
    kill PID SIGNAL               the signal, by number
    write PATH TEXT               a file with this text
    silent DEVICE on|off          no request is answered, connections stay
    cut DEVICE                    connections are closed, new ones refused
    mend DEVICE                   the end of that
    history DEVICE                what changed since the last `history`, and forgets it
    values DEVICE BANK FIRST COUNT
    quit

The benches use `Device` and `Serving` as a library.
"""

import array
import json
import os
import selectors
import socket
import struct
import sys
import time

POINTS = 65536
BITS_MAX, WORDS_MAX = 2000, 125


def now_us():
    return time.monotonic_ns() // 1000


class Device:
    """One remote device: its memory, what changed in it, and its watchdog."""

    def __init__(self, address, watchdog=None):
        self.address = address
        self.banks = {
            "coil": array.array("B", bytes(POINTS)),
            "discrete": array.array("B", bytes(POINTS)),
            "holding": array.array("H", bytes(2 * POINTS)),
            "input": array.array("H", bytes(2 * POINTS)),
        }
        self.watchdog_register, self.watchdog_us = watchdog or (None, None)
        self.driven = set()
        self.fed_us = None
        self.tripped = False
        self.silent = False
        self.on_change = None
        self.requests = 0
        self.forget()

    def forget(self):
        """What the history starts anew with."""
        self.changes, self.events, self.last_write, self.writes = [], [], None, 0

    def note(self, bank, address, value, why):
        self.changes.append((now_us(), bank, address, value, why))
        if self.on_change:
            self.on_change(self, bank, address, value)

    def event(self, name):
        self.events.append((now_us(), name))

    def store(self, bank, first, values):
        """A client's write."""
        cells = self.banks[bank]
        self.writes += 1
        self.last_write = now_us()
        if bank == "holding" and self.watchdog_register is not None:
            if first <= self.watchdog_register < first + len(values):
                self.fed_us = now_us()
                if self.tripped:
                    self.tripped = False
                    self.event("fed again")
        for at, value in enumerate(values, first):
            if cells[at] != value and not self.tripped:
                cells[at] = value
                if bank != "holding" or at != self.watchdog_register:
                    self.driven.add((bank, at))
                    self.note(bank, at, value, "written")

    def look(self):
        """The device's own watchdog."""
        if self.fed_us is None or self.tripped or now_us() - self.fed_us <= self.watchdog_us:
            return
        self.tripped = True
        self.event("watchdog")
        for bank, at in sorted(self.driven):
            if self.banks[bank][at]:
                self.banks[bank][at] = 0
                self.note(bank, at, 0, "watchdog")
        self.driven.clear()

    def answer(self, pdu):
        """The reply to a request."""
        self.requests += 1
        code = pdu[0]
        try:
            if code in (1, 2):
                first, count = struct.unpack(">HH", pdu[1:5])
                if not 0 < count <= BITS_MAX:
                    return bytes([code | 0x80, 3])
                if first + count > POINTS:
                    return bytes([code | 0x80, 2])
                cells = self.banks["coil" if code == 1 else "discrete"][first : first + count]
                packed = int("".join(map(str, reversed(cells))), 2)
                size = (count + 7) // 8
                return bytes([code, size]) + packed.to_bytes(size, "little")
            if code in (3, 4):
                first, count = struct.unpack(">HH", pdu[1:5])
                if not 0 < count <= WORDS_MAX:
                    return bytes([code | 0x80, 3])
                if first + count > POINTS:
                    return bytes([code | 0x80, 2])
                cells = self.banks["holding" if code == 3 else "input"][first : first + count]
                cells.byteswap()
                return bytes([code, 2 * count]) + cells.tobytes()
            if code in (5, 6):
                first, value = struct.unpack(">HH", pdu[1:5])
                if code == 5:
                    self.store("coil", first, [1 if value == 0xFF00 else 0])
                else:
                    self.store("holding", first, [value])
                return pdu[:5]
            if code in (15, 16):
                first, count, size = struct.unpack(">HHB", pdu[1:6])
                if first + count > POINTS:
                    return bytes([code | 0x80, 2])
                data = pdu[6 : 6 + size]
                if code == 15:
                    bits = int.from_bytes(data, "little")
                    self.store("coil", first, [bits >> at & 1 for at in range(count)])
                else:
                    self.store("holding", first, struct.unpack(f">{count}H", data))
                return pdu[:5]
        except struct.error:
            return bytes([code | 0x80, 3])
        return bytes([code | 0x80, 1])


class Serving:
    """Devices behind their listeners, in one loop."""

    def __init__(self, devices):
        self.devices = devices
        self.selector = selectors.DefaultSelector()
        self.listeners, self.connections = {}, {}
        for device in devices:
            self.bind(device)
            self.open(device)

    def bind(self, device):
        """Its port is its own, even while nobody listens: then connections are refused."""
        listener = socket.socket()
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(device.address)
        device.address = listener.getsockname()
        self.listeners[device] = listener

    def open(self, device):
        listener = self.listeners[device]
        listener.listen()
        self.selector.register(listener, selectors.EVENT_READ, (self.accept, device))

    def close(self, device):
        """As a device without power: nobody listens, connections are gone."""
        self.selector.unregister(self.listeners[device])
        self.listeners[device].close()
        self.bind(device)
        for peer in [p for p, (owner, _) in self.connections.items() if owner is device]:
            # RST, so that the client knows at once.
            peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self.drop(peer)

    def accept(self, listener, device):
        peer, _ = listener.accept()
        peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.connections[peer] = (device, bytearray())
        self.selector.register(peer, selectors.EVENT_READ, (self.receive, device))
        device.event("connected")

    def drop(self, peer):
        device, _ = self.connections.pop(peer)
        device.event("disconnected")
        self.selector.unregister(peer)
        peer.close()

    def receive(self, peer, device):
        try:
            data = peer.recv(65536)
        except OSError:
            data = b""
        if not data:
            return self.drop(peer)
        if device.silent:
            return None
        buffer = self.connections[peer][1]
        buffer += data
        replies = bytearray()
        while len(buffer) >= 8:
            length = 6 + int.from_bytes(buffer[4:6], "big")
            if len(buffer) < length:
                break
            reply = device.answer(bytes(buffer[7:length]))
            replies += buffer[:4] + struct.pack(">HB", len(reply) + 1, buffer[6]) + reply
            del buffer[:length]
        if replies:
            try:
                peer.sendall(replies)
            except OSError:
                self.drop(peer)
        return None

    def turn(self, wait_s):
        """Serves what is there, for so long at most."""
        for key, _ in self.selector.select(wait_s):
            call, device = key.data
            if key.fileobj in self.connections or call != self.receive:
                call(key.fileobj, device)
        for device in self.devices:
            device.look()


class Commands:
    """Standard input, line by line."""

    def __init__(self, serving):
        self.serving = serving
        self.buffer = b""
        self.over = False
        os.set_blocking(0, False)
        serving.selector.register(0, selectors.EVENT_READ, (self.read, None))

    def read(self, _file, _device):
        data = os.read(0, 65536)
        self.over = self.over or not data
        self.buffer += data
        while b"\n" in self.buffer:
            line, self.buffer = self.buffer.split(b"\n", 1)
            at = now_us()
            print(json.dumps({"at": at, **(self.obey(*line.decode().split()) or {})}), flush=True)

    def obey(self, verb, *words):
        devices = self.serving.devices
        if verb == "set":
            devices[int(words[0])].banks[words[1]][int(words[2])] = int(words[3])
        elif verb == "kill":
            os.kill(int(words[0]), int(words[1]))
        elif verb == "write":
            with open(words[0] + ".new", "w", encoding="utf-8") as file:
                file.write(words[1])
            os.rename(words[0] + ".new", words[0])
        elif verb == "silent":
            devices[int(words[0])].silent = words[1] == "on"
        elif verb == "cut":
            self.serving.close(devices[int(words[0])])
        elif verb == "mend":
            self.serving.open(devices[int(words[0])])
        elif verb == "history":
            device = devices[int(words[0])]
            story = {"changes": device.changes, "events": device.events, "writes": device.writes}
            story["last_write"] = device.last_write
            device.forget()
            return story
        elif verb == "values":
            first, count = int(words[2]), int(words[3])
            return {"values": list(devices[int(words[0])].banks[words[1]][first : first + count])}
        elif verb == "quit":
            self.over = True
        return None


def device_of(text):
    """HOST:PORT[,watchdog=REGISTER:MS]"""
    place, *options = text.split(",")
    host, port = place.rsplit(":", 1)
    watchdog = None
    for option in options:
        register, limit_ms = option.removeprefix("watchdog=").split(":")
        watchdog = (int(register), 1000 * int(limit_ms))
    return Device((host, int(port)), watchdog)


def main():
    serving = Serving([device_of(text) for text in sys.argv[1:]])
    print(json.dumps({"listening": [d.address[1] for d in serving.devices]}), flush=True)
    commands = Commands(serving)
    watched = any(device.watchdog_us for device in serving.devices)
    while not commands.over:
        serving.turn(0.001 if watched else 1)


if __name__ == "__main__":
    main()
