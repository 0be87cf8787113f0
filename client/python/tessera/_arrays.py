"""Large arrays: those of a proposal, in pieces before it, and those of the scene, fetched on a connection of their
own."""
from __future__ import annotations

import threading
import time
from typing import Any, Mapping, Optional

import numpy as np

from ._types import Array
from . import _wire
from ._channel import Channel, receive_all
from ._described import encode_message
from ._hash import array_id, hash64_of
from ._link import Link
from ._schema import Field, Schema
from .errors import LimitExceeded, NetworkError, NotFound, TesseraError, Timeout

_CHUNK = 1 << 20
_IN_FLIGHT = 4
_MOST_OF_A_PIECE = 4096  # arrays


def uploads_of(schema: Schema, arrays: Mapping[bytes, Array]) -> tuple[list[_wire.Chain], list[_wire.Part]]:
    """Messages that go before the proposal, and the small arrays that go with it: the server puts the former together
    while frames go by."""
    limits = schema.limits
    total = sum(data.nbytes for data in arrays.values())
    if total > limits["upload_bytes"]:
        raise LimitExceeded(f"the edit has {total} bytes of arrays, and {limits['upload_bytes'] >> 20} MiB may come "
                            f"with one; make it in parts")
    piece = limits["upload_piece_bytes"]
    small: list[_wire.Part] = []
    pieces: list[tuple[bytearray, _wire.Chain]] = []
    room, inline = 0, 0
    for name, data in arrays.items():
        if data.nbytes <= limits["inline_array_bytes"] - inline:
            inline += data.nbytes
            small.append(_wire.view_of(data))
            continue
        alone = data.nbytes > piece // 2
        if alone or not pieces or data.nbytes > room or len(pieces[-1][0]) >= 24 * _MOST_OF_A_PIECE:
            pieces.append((bytearray(), _wire.Chain()))
            room = piece
        pieces[-1][0].extend(name)
        whole = bytes_of(data)
        if not alone:
            pieces[-1][1].append(whole)
            room -= data.nbytes
            continue
        for at in range(0, data.nbytes, piece):
            if at:
                pieces.append((bytearray(), _wire.Chain()))
            pieces[-1][1].append(whole[at:at + piece])
        room = 0
    said = schema.messages["Upload"]
    return [encode_message(said, {"blobs": names, "bytes": data}) for names, data in pieces], small


def bytes_of(data: Array) -> memoryview:
    """Of an array of bytes, where they lie."""
    return data.data


class Fetcher:
    """Arrays of the scene, on the bulk channel, straight into where they stay. One at a time; any thread."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._lock = threading.Lock()
        self._channel: Optional[Channel] = None
        self._generation = -1

    def close(self) -> None:
        if self._channel is not None:
            self._channel.close()
            self._channel = None

    def fetch(self, name: Any, field: Field) -> Array:
        """Named by a record of hash and size: rows of a field's elements, or bytes."""
        size = int(name["bytes"])
        data = np.empty(size, np.uint8)
        if size:
            with self._lock:
                self._fetch_again(name, data, field, time.monotonic() + self._link.timeout)
            expected = int(name["low"]).to_bytes(8, "little") + int(name["high"]).to_bytes(8, "little")
            if array_id(data, self._link.schema.limits["array_leaf_bytes"]) != expected:
                raise NetworkError(f"{field.where} came damaged")
        if not field.each:
            return data
        found = data.view(field.element)
        return found.reshape(-1, field.each) if field.each > 1 else found

    def _fetch_again(self, name: Any, data: Array, field: Field, deadline: float) -> None:
        """On a fresh channel, where the one that is there has been closed: a console does so with one that nobody reads
        for a minute."""
        tries = 2 if self._channel is not None and self._generation == self._link.generation else 1
        for left in reversed(range(tries)):
            try:
                return self._fetch(name, data, deadline)
            except (OSError, TesseraError) as error:
                self.close()
                if left and isinstance(error, OSError) and not isinstance(error, Timeout) and self._link.connected:
                    continue
                if isinstance(error, TesseraError):
                    raise
                raise NetworkError(f"{field.where} could not be fetched: {error}") from None

    def _fetch(self, name: Any, data: Array, deadline: float) -> None:
        if self._channel is None or self._generation != self._link.generation:
            self.close()
            self._generation = self._link.generation
            self._channel = self._link.open_bulk(deadline)
        channel, target = self._channel, bytes_of(data)
        asked = got = 0
        while got < data.nbytes:
            while asked < data.nbytes and asked - got < _IN_FLIGHT * _CHUNK:
                length = min(_CHUNK, data.nbytes - asked)
                self._link._send(channel, "BlobRequest", encode_message(self._link.schema.messages["BlobRequest"], {
                    "id": (int(name["low"]), int(name["high"])), "offset": asked, "length": length}), deadline)
                asked += length
            got += self._chunk(channel, target, deadline)

    def _chunk(self, channel: Channel, target: memoryview, deadline: float) -> int:
        """Reads one message; its bytes go to their place at once, and are checked where they lie."""
        data = memoryview(bytearray(_wire.HEADER_BYTES))
        receive_all(channel, data, deadline)
        header = self._link._checked(_wire.Header(data))
        if self._link.schema.message_names[header.kind] != "BlobChunk" or header.size < 16:
            raise NetworkError("the server closed the connection for arrays")
        begin = memoryview(bytearray(16))
        receive_all(channel, begin, deadline)
        head_size, parts = np.frombuffer(begin, "<u4", 2).tolist()
        size = int(np.frombuffer(begin, "<u8", 1, 8)[0])
        if parts != 1 or 16 + head_size + size != header.size:
            raise NetworkError("the server sent a piece of an array that makes no sense")
        head = memoryview(bytearray(head_size))
        receive_all(channel, head, deadline)
        members = {each["name"]: each["number"] for each in self._link.schema.messages["BlobChunk"].fields
                   if "number" in each}
        said = {number: value for number, _, value in _wire.fields_of(head)}
        offset = said.get(members["offset"], 0)
        if not said.get(members["total_bytes"], 0):
            raise NotFound("the server does not have this array any more; read the field again")
        if offset + size > len(target):
            raise NetworkError("the server sent a piece of an array that makes no sense")
        place = target[offset:offset + size]
        receive_all(channel, place, deadline)
        if hash64_of([begin, head, place], header.seed) != header.checksum:
            raise NetworkError("a piece of an array came damaged")
        return size
