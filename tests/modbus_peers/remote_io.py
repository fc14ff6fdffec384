"""Remote I/O by pymodbus, for the tests of the Modbus clients.

    remote_io.py tcp PORT UNIT...
    remote_io.py rtu DEVICE UNIT...
    remote_io.py probe tcp|rtu

The last one only finds out whether this Python can be such a peer.

Every unit has 100 of each table. Standard input sets what the field would: `UNIT discrete 3 1`,
`UNIT input 5 77`. Every change that the client writes is a line on standard output:
`UNIT coil 0 1`, `UNIT holding 5 77`. Coils and holding registers can be set as well.
"""

import asyncio
import functools
import sys

from pymodbus import FramerType
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

COUNT = 100
OF_FUNCTION = {1: "coil", 2: "discrete", 3: "holding", 4: "input"}
OF_WRITE = {5: "coil", 6: "holding", 15: "coil", 16: "holding"}


def say(*words):
    print(*words, flush=True)


async def act(unit, tables, function, start, address, count, registers, values):
    if function in OF_WRITE:
        table = OF_WRITE[function]
        # Once more without values: pymodbus reads back what it answers.
        for at, value in enumerate(values or [], address):
            if tables[table][at] != int(value):
                tables[table][at] = int(value)
                say(unit, table, at, int(value))
        return None
    table = tables[OF_FUNCTION[function]]
    if function in (1, 2):
        for word in range(len(registers)):
            bits = table[(start + word) * 16:(start + word + 1) * 16]
            registers[word] = sum(bit << at for at, bit in enumerate(bits))
    else:
        for at in range(address, address + count):
            registers[at - start] = table[at]
    return None


def device(unit, tables):
    def bits():
        return [SimData(0, values=[False] * COUNT, datatype=DataType.BITS)]

    def words():
        return [SimData(0, count=COUNT, values=0, datatype=DataType.REGISTERS)]

    action = functools.partial(act, unit, tables)
    return SimDevice(unit, simdata=(bits(), bits(), words(), words()), action=action)


def keep_silent(units, is_sending, packet):
    """Nobody answers for a unit that is not on the line."""
    return b"" if is_sending and packet and packet[0] not in units else packet


async def obey(units):
    reader = asyncio.StreamReader()
    loop = asyncio.get_running_loop()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    while line := (await reader.readline()).decode().split():
        unit, table, at, value = line
        units[int(unit)][table][int(at)] = int(value)


def probe(way):
    device(1, {table: [0] * COUNT for table in OF_FUNCTION.values()})
    if way == "rtu":
        import serial  # noqa: F401


async def main(way, place, *units):
    units = {int(unit): {t: [0] * COUNT for t in OF_FUNCTION.values()} for unit in units}
    devices = [device(unit, tables) for unit, tables in units.items()]
    if way == "tcp":
        server = ModbusTcpServer(devices, address=("127.0.0.1", int(place)))
    else:
        server = ModbusSerialServer(
            devices,
            framer=FramerType.RTU,
            port=place,
            baudrate=19200,
            parity="N",
            trace_packet=functools.partial(keep_silent, units),
        )
    await server.serve_forever(background=True)
    say("ready")
    await obey(units)


if sys.argv[1] == "probe":
    probe(sys.argv[2])
else:
    asyncio.run(main(*sys.argv[1:]))
