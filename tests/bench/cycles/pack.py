"""Fibers of a pack, with numpy alone."""
import json

import numpy as np

KINDS = {"U8": "u1", "U16": "<u2", "U32": "<u4", "I32": "<i4", "F16": "<f2", "F32": "<f4", "F64": "<f8"}


def read_tensors(path):
    raw = open(path, "rb").read()
    start = 8 + int.from_bytes(raw[:8], "little")
    entries = json.loads(raw[8:start])
    return {
        name: np.frombuffer(raw[start:][slice(*e["data_offsets"])], KINDS[e["dtype"]]).reshape(e["shape"])
        for name, e in entries.items()
        if name != "__metadata__"
    }


def read_fibers(pack):
    return read_tensors(pack + "/fibers.safetensors")


def tile_size(fibers):
    """Width and height in millimetres."""
    return [float(x) for x in fibers["tile_mm"]]
