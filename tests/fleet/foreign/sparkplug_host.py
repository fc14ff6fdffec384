#!/usr/bin/env python3
"""Sparkplug by a library that is not rungd's: pysparkplug (PyPI).

`sparkplug_host.py read` takes lines `TOPIC HEX` and prints a line of JSON for each: what the library
sees. Births are kept, so that aliases of data get their names. `sparkplug_host.py write` prints such
lines: a birth, data and a death as the library makes them.
"""

import json
import sys

import pysparkplug as spb

KINDS = {"NBIRTH": spb.NBirth, "NDATA": spb.NData, "NDEATH": spb.NDeath, "NCMD": spb.NCmd}


def read() -> None:
    births = {}
    for line in sys.stdin:
        topic, raw = line.split(" ")
        _, group, kind, node = topic.split("/")
        key = (group, node)
        payload = KINDS[kind].decode(bytes.fromhex(raw.strip()), birth=births.get(key))
        if kind == "NBIRTH":
            births[key] = payload
        metrics = [
            {
                "name": metric.name,
                "type": metric.datatype.name,
                "value": metric.value,
                "timestamp": metric.timestamp,
                "historical": metric.is_historical,
                "null": metric.is_null,
            }
            for metric in getattr(payload, "metrics", None) or [payload.bd_seq_metric]
        ]
        told = {"kind": kind, "seq": getattr(payload, "seq", None), "metrics": metrics}
        print(json.dumps(told), flush=True)


def metric(name, datatype, value, alias=None, at=1_790_000_000_000):
    return spb.Metric(timestamp=at, name=name, datatype=datatype, value=value, alias=alias)


def write() -> None:
    at = 1_790_000_000_000
    number = metric("bdSeq", spb.DataType.INT64, 7)
    born = [
        number,
        metric("level", spb.DataType.INT16, -3, alias=1),
        metric("rungd/mode", spb.DataType.STRING, "RUN", alias=2),
        metric("rungd/forces", spb.DataType.INT64, 2, alias=3),
        metric("rungd/history/replaying", spb.DataType.BOOLEAN, True, alias=4),
        metric("rungd/scan", spb.DataType.INT64, 100, alias=5),
    ]
    stopped = metric(None, spb.DataType.STRING, "STOP", alias=2)
    messages = [
        ("NBIRTH", spb.NBirth(timestamp=at, seq=0, metrics=tuple(born))),
        ("NDATA", spb.NData(timestamp=at, seq=1, metrics=(stopped,))),
        ("NDEATH", spb.NDeath(timestamp=at, bd_seq_metric=number)),
    ]
    for kind, payload in messages:
        print(f"spBv1.0/plant/{kind}/press {payload.encode().hex()}")


if __name__ == "__main__":
    {"read": read, "write": write}[sys.argv[1]]()
