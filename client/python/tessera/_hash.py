"""XXH3 by the system's own library, over bytes where they lie.

ctypes on libxxhash.so.0 and not python3-xxhash: apt itself needs that library, so each Debian 12 has it, and it hashes
a buffer in pieces, without a copy and without Python's lock.
"""
from __future__ import annotations

import ctypes
import ctypes.util
import sys
from typing import Any, Iterable

import numpy as np

from ._types import Array

if sys.byteorder != "little":
    raise ImportError("tessera: the wire is little-endian, and this machine is not")


class _Hash128(ctypes.Structure):
    _fields_ = [("low", ctypes.c_uint64), ("high", ctypes.c_uint64)]


def _load() -> ctypes.CDLL:
    for name in ("libxxhash.so.0", ctypes.util.find_library("xxhash")):
        try:
            if name:
                return ctypes.CDLL(name)
        except OSError:
            continue
    raise ImportError("tessera: libxxhash.so.0 is missing; install it with: apt-get install libxxhash0")


_library = _load()
_hash64 = _library.XXH3_64bits_withSeed
_hash64.restype = ctypes.c_uint64
_hash64.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_uint64]
_hash128 = _library.XXH3_128bits
_hash128.restype = _Hash128
_hash128.argtypes = [ctypes.c_void_p, ctypes.c_size_t]
_create = _library.XXH3_createState
_create.restype = ctypes.c_void_p
_create.argtypes = []
_free = _library.XXH3_freeState
_free.argtypes = [ctypes.c_void_p]
_reset = _library.XXH3_64bits_reset_withSeed
_reset.argtypes = [ctypes.c_void_p, ctypes.c_uint64]
_update = _library.XXH3_64bits_update
_update.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t]
_digest = _library.XXH3_64bits_digest
_digest.restype = ctypes.c_uint64
_digest.argtypes = [ctypes.c_void_p]


def _place(buffer: Any) -> tuple[Array, int, int]:
    """The bytes (which the caller keeps), their address and how many they are."""
    view = np.frombuffer(buffer, np.uint8) if len(buffer) else np.empty(0, np.uint8)
    return view, view.ctypes.data, view.nbytes


def hash64(buffer: Any, seed: int = 0) -> int:
    if isinstance(buffer, bytes):
        return int(_hash64(buffer, len(buffer), seed))
    view, at, size = _place(buffer)
    return int(_hash64(at, size, seed))


def hash64_of(buffers: Iterable[Any], seed: int) -> int:
    """Of bytes that lie in several places, as if they were one behind the other."""
    state = _create()
    try:
        _reset(state, seed)
        for buffer in buffers:
            if isinstance(buffer, bytes):
                _update(state, buffer, len(buffer))
            else:
                view, at, size = _place(buffer)
                _update(state, at, size)
        return int(_digest(state))
    finally:
        _free(state)


def array_id(data: Array, leaf_bytes: int) -> bytes:
    """The name of an array (16 bytes): the hash of its bytes; of more than a leaf, of its leaves' hashes
    (common/base/Blob.h)."""
    at, size = data.ctypes.data, data.nbytes
    if size <= leaf_bytes:
        return bytes(_hash128(at, size))
    leaves = bytearray()
    for begin in range(0, size, leaf_bytes):
        leaves += bytes(_hash128(at + begin, min(leaf_bytes, size - begin)))
    leaves += size.to_bytes(8, "little") + leaf_bytes.to_bytes(8, "little")
    view, place, count = _place(leaves)
    return bytes(_hash128(place, count))
