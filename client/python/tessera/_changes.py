"""Lists of changes as bytes and back (proto/change.proto): columns lie raw behind a small head."""
from __future__ import annotations

import struct
from typing import Any, Iterable, NamedTuple, Sequence

import numpy as np

from ._types import Array
from . import _wire
from ._schema import BLOB, BOOL, FLOAT, DOUBLE, INT, KINDS, MATRIX, REF, REFS, SCALARS, TEXT, Field, Schema, Type
from .errors import BadInput, TesseraError, Unsupported

FIRST_PLACEHOLDER = 1 << 63  # ids from here up stand for objects that a list creates
LAST = 0xFFFFFFFF  # an index: behind all others
_FIRST_COLUMN_PART = 8
RANGE = np.dtype([("object", "<u8"), ("offset", "<u8"), ("bytes", "<u8"), ("type", "<u2"), ("field", "<u2"),
                  ("unused", "<u4"),
                  ("low", "<u8"), ("high", "<u8"), ("result_bytes", "<u8")])
ARRAY_NAME = np.dtype([("low", "<u8"), ("high", "<u8"), ("bytes", "<u8")])


class Column(NamedTuple):
    """New values of one field for many objects of one type; `values` has a row for each of `ids`."""

    type: Type
    field: Field
    ids: Array
    values: Any


class Changes(NamedTuple):
    """A list as it came: who was created, placed, changed and destroyed, in this order."""

    sequence: int
    created: Array  # "id", "type"
    placed: Array  # "node", "parent" (0: taken out), "index"
    columns: list[Column]
    ranges: Array  # parts of arrays that were written
    destroyed: Array


def encode(creations: Sequence[tuple[int, int]], placements: Sequence[tuple[int, int, int]],
           columns: Iterable[tuple[Type, Field, Array, _wire.Part]],
           ranges: Array, range_bytes: _wire.Part, destructions: Sequence[int]) -> _wire.Chain:
    head = bytearray()
    made = np.array(creations, np.uint64).reshape(-1, 2)
    placed = np.array(placements, np.uint64).reshape(-1, 3)
    parts: list[_wire.Part] = [_wire.view_of(np.ascontiguousarray(made[:, 0])), _wire.view_of(made[:, 1].astype("<u2")),
                               _wire.view_of(np.ascontiguousarray(placed[:, 0])),
                               _wire.view_of(np.ascontiguousarray(placed[:, 1])),
                               _wire.view_of(placed[:, 2].astype("<u4")), _wire.view_of(np.array(destructions, "<u8")),
                               _wire.view_of(ranges), range_bytes]
    for kind, field, ids, values in columns:
        column = bytearray()
        for number, value in enumerate((kind.number, field.number, field.kind,
                                        1 if field.kind == MATRIX else field.width), 1):
            if value:
                _wire.put_varint(column, number, value)
        _wire.put_bytes(head, 1, column)
        parts.append(_wire.view_of(ids))
        parts.append(values)
    return _wire.join_parts(head, parts)


def pack_texts(texts: Sequence[bytes]) -> bytes:
    return struct.pack(f"<{len(texts)}I", *map(len, texts)) + b"".join(texts)


def pack_refs(lists: Sequence[Array]) -> bytes:
    return struct.pack(f"<{len(lists)}I", *map(len, lists)) + b"".join(each.tobytes() for each in lists)


def _unpack(field: Field, data: memoryview, rows: int) -> Any:
    if field.kind in SCALARS:
        values = np.frombuffer(data, SCALARS[field.kind])
        if len(values) != rows * field.width:
            raise BadInput(f"{len(data)} bytes for {rows} values of {field.where}")
        return values.reshape(rows, field.width) if field.width > 1 else values
    if field.kind == BLOB:
        return np.frombuffer(data, ARRAY_NAME)
    sizes = np.frombuffer(data[:4 * rows], "<u4")
    each = 8 if field.kind == REFS else 1
    found, at = [], 4 * rows
    for size in sizes.tolist():
        bytes_of_it = data[at:at + size * each]
        found.append(np.frombuffer(bytes_of_it, "<u8") if each == 8 else bytes(bytes_of_it).decode("utf-8", "replace"))
        at += size * each
    return found


def decode(schema: Schema, data: memoryview, sequence: int = 0) -> Changes:
    """Arrays in it are views of `data`. Unsupported: types or fields that this version does not know. BadInput: it
    makes no sense."""
    try:
        return _decode(schema, data, sequence)
    except (ValueError, LookupError, TypeError) as error:
        raise (error if isinstance(error, TesseraError)
               else BadInput(f"a list of changes makes no sense: {error}")) from None


def _decode(schema: Schema, data: memoryview, sequence: int) -> Changes:
    head, parts = _wire.split_parts(data)
    if len(parts) < _FIRST_COLUMN_PART:
        raise BadInput(f"a list of changes with {len(parts)} parts")
    created = np.zeros(len(parts[0]) // 8, [("id", "<u8"), ("type", "<u2")])
    created["id"], created["type"] = np.frombuffer(parts[0], "<u8"), np.frombuffer(parts[1], "<u2")
    placed = np.zeros(len(parts[2]) // 8, [("node", "<u8"), ("parent", "<u8"), ("index", "<u4")])
    placed["node"], placed["parent"], placed["index"] = (
        np.frombuffer(parts[at], kind) for at, kind in ((2, "<u8"), (3, "<u8"), (4, "<u4")))
    columns = []
    part = _FIRST_COLUMN_PART
    for number, form, value in _wire.fields_of(head):
        if number != 1 or form != _wire.BYTES:
            continue
        said = {at: word for at, form, word in _wire.fields_of(value) if form == _wire.VARINT}
        kind = schema.types_by_number.get(said.get(1, 0))
        field = kind.by_number.get(said.get(2, 0)) if kind else None
        if kind is None or field is None or field.kind != said.get(3, 0) or part + 2 > len(parts):
            raise Unsupported(f"a list of changes has field {said.get(2, 0)} of type {said.get(1, 0)}, which this "
                              f"version does not know")
        ids = np.frombuffer(parts[part], "<u8")
        columns.append(Column(kind, field, ids, _unpack(field, parts[part + 1], len(ids))))
        part += 2
    return Changes(sequence, created, placed, columns, np.frombuffer(parts[6], RANGE), np.frombuffer(parts[5], "<u8"))
