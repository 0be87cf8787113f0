"""Bytes of the wire: heads as protobuf writes them, parts behind them, and the header in front of a message
(proto/WIRE.md)."""
from __future__ import annotations

import struct
from typing import Any, Iterator, Sequence, Union

import numpy as np

from ._types import Array
from ._hash import hash64, hash64_of
from .errors import BadInput, NetworkError

Buffer = Union[bytes, bytearray, memoryview]

VARINT, FIXED, BYTES = 0, 1, 2  # kinds of protobuf's fields that are used here
_U64 = struct.Struct("<Q")
_DOUBLE = struct.Struct("<d")


# ---- heads

def varint(value: int) -> bytes:
    if value < 0x80:
        return bytes((value,))
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def put_varint(head: bytearray, number: int, value: int) -> None:
    head += varint(number << 3)
    head += varint(value)


def put_fixed(head: bytearray, number: int, value: int) -> None:
    head += varint(number << 3 | FIXED)
    head += _U64.pack(value)


def put_bytes(head: bytearray, number: int, value: Buffer) -> None:
    head += varint(number << 3 | BYTES)
    head += varint(len(value))
    head += value


def bits_of(number: float) -> int:
    return int(_U64.unpack(_DOUBLE.pack(number))[0])


def number_of(bits: int) -> float:
    return float(_DOUBLE.unpack(_U64.pack(bits))[0])


def take_varint(view: memoryview, at: int) -> tuple[int, int]:
    """The number, and where it ends."""
    value = shift = 0
    while True:
        if at >= len(view) or shift > 63:
            raise BadInput("a message's head is cut off")
        byte = view[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value & 0xFFFFFFFFFFFFFFFF, at
        shift += 7


def fields_of(view: memoryview) -> Iterator[tuple[int, int, Any]]:
    """(number, kind, value) of each field: an int, or a view on bytes. Others are passed over."""
    at, end = 0, len(view)
    while at < end:
        tag, at = take_varint(view, at)
        number, kind = tag >> 3, tag & 7
        if kind == VARINT:
            value, at = take_varint(view, at)
            yield number, kind, value
        elif kind == FIXED:
            if at + 8 > end:
                raise BadInput("a message's head is cut off")
            yield number, kind, _U64.unpack_from(view, at)[0]
            at += 8
        elif kind == BYTES:
            size, at = take_varint(view, at)
            if size > end - at:
                raise BadInput("a message's head is cut off")
            yield number, kind, view[at:at + size]
            at += size
        elif kind == 5:
            at += 4
        else:
            raise BadInput("a message's head is no protobuf message")


# ---- parts

class Chain:
    """Bytes that lie in several places, to be sent one behind the other. What is large is never copied."""

    __slots__ = ("pieces", "size")
    SMALL = 4096

    def __init__(self, *pieces: Union[Buffer, "Chain"]) -> None:
        self.pieces: list[Any] = []
        self.size = 0
        for piece in pieces:
            self.append(piece)

    def append(self, piece: Union[Buffer, "Chain"]) -> None:
        if isinstance(piece, Chain):
            for each in piece.pieces:
                self.append(each)
            return
        size = len(piece)
        if size == 0:
            return
        self.size += size
        if size <= self.SMALL and self.pieces and isinstance(self.pieces[-1], bytearray):
            self.pieces[-1] += piece
        else:
            self.pieces.append(bytearray(piece) if size <= self.SMALL else piece)

    def __len__(self) -> int:
        return self.size

    def joined(self) -> bytes:
        return b"".join(self.pieces)


Part = Union[Buffer, Chain]


def view_of(array: Array) -> Part:
    """The bytes of an array, where they lie. It must be contiguous."""
    return array.reshape(-1).view(np.uint8).data if array.nbytes else b""


def join_parts(head: Buffer, parts: Sequence[Part]) -> Chain:
    begin = bytearray(struct.pack("<II", len(head), len(parts)))
    for part in parts:
        begin += _U64.pack(len(part))
    begin += head
    chain = Chain(begin)
    for part in parts:
        chain.append(part)
    return chain


def split_parts(payload: memoryview) -> tuple[memoryview, list[memoryview]]:
    """Head and parts, as views on the payload."""
    if len(payload) < 8:
        raise BadInput("a message is too short")
    head_size, count = struct.unpack_from("<II", payload)
    at = 8 + 8 * count
    if len(payload) - 8 < 8 * count or head_size > len(payload) - at:
        raise BadInput("a message is cut off")
    sizes = struct.unpack_from(f"<{count}Q", payload, 8)
    head = payload[at:at + head_size]
    at += head_size
    parts = []
    for size in sizes:
        if size > len(payload) - at:
            raise BadInput("a message is cut off")
        parts.append(payload[at:at + size])
        at += size
    if at != len(payload):
        raise BadInput(f"{len(payload) - at} bytes follow a message's end")
    return head, parts


# ---- the header in front of a message

HEADER_BYTES = 32
_MAGIC, _VERSION = b"TSRA", 1
_HEADER = struct.Struct("<4sHHIIQ")


def header_of(kind: int, epoch: int, payload: Chain) -> bytes:
    begin = _HEADER.pack(_MAGIC, _VERSION, kind, payload.size, 0, epoch)
    return begin + _U64.pack(hash64_of(payload.pieces, hash64(begin)))


class Header:
    """The 32 bytes as they came."""

    __slots__ = ("kind", "size", "epoch", "checksum", "seed")

    def __init__(self, data: Buffer) -> None:
        magic, version, self.kind, self.size, reserved, self.epoch = _HEADER.unpack_from(data)
        if magic != _MAGIC:
            raise NetworkError(f"not a Tessera server: it began a message with {bytes(data[:16])!r}")
        if version != _VERSION or reserved:
            raise NetworkError(f"the server frames its messages in version {version}, this package in {_VERSION}")
        self.checksum = _U64.unpack_from(data, 24)[0]
        self.seed = hash64(bytes(data[:24]))

    def check(self, payload: Buffer) -> None:
        if hash64(payload, self.seed) != self.checksum:
            raise NetworkError(f"a message of type {self.kind} with {self.size} bytes is damaged: its checksum is "
                               f"wrong")
