"""Values of fields, as people write them and as columns carry them. What makes no sense is refused here with the
field's name."""
from __future__ import annotations

from typing import Any, Callable, Optional, Sequence

import numpy as np

from ._types import Array, as_array, finite, items_of, utf8, written
from . import _wire
from ._changes import pack_refs, pack_texts
from ._hash import array_id
from ._schema import BLOB, BOOL, DOUBLE, FLOAT, INT, MATRIX, REF, REFS, SCALARS, TEXT, Field, nearest
from .errors import BadInput

Resolve = Callable[[Any, Field], int]  # an object, a path or a number as the number of an object


class Arrays:
    """The arrays that go with a list, each once, where they lie."""

    def __init__(self, leaf_bytes: int) -> None:
        self._leaf_bytes = leaf_bytes
        self.by_name: dict[bytes, Array] = {}

    def name_of(self, data: Array) -> bytes:
        """24 bytes: its hash and size; zeros of an empty one."""
        if data.nbytes == 0:
            return bytes(24)
        flat = data.reshape(-1).view(np.uint8)
        name = array_id(flat, self._leaf_bytes) + flat.nbytes.to_bytes(8, "little")
        self.by_name.setdefault(name, flat)
        return name


def numbers(field: Field, value: Any, rows: Optional[int] = None) -> Array:
    """One value, or `rows` of them, of a field of numbers: as it lies on the wire, without a copy where it does
    already."""
    dtype = SCALARS[field.kind]
    given = as_array(value, field.where)
    if given.dtype.kind not in "fiub" or (given.dtype.kind == "b" and field.kind != BOOL):
        raise BadInput(f"{field.where}: {written(value)} is no number" if given.size < 20
                       else f"{field.where}: {given.dtype} is no type of numbers")
    if field.kind == MATRIX and given.shape[-2:] == (4, 4):
        given = given.swapaxes(-1, -2).reshape(*given.shape[:-2], 16)  # on the wire column by column
    wanted: tuple[int, ...] = (field.width,) if rows is None else (rows, field.width)
    if given.size != np.prod(wanted, dtype=int) or (rows is not None and (given.ndim == 0 or len(given) != rows)):
        shape = field.width if rows is None else f"{rows} × {field.width}"
        raise BadInput(f"{field.where}: an array of {' × '.join(map(str, given.shape)) or 1} numbers instead of "
                       f"{shape}")
    if field.kind in (FLOAT, DOUBLE, MATRIX):
        return finite(given.reshape(wanted), dtype, field.where)
    if field.kind == INT and given.dtype.kind == "f":
        raise BadInput(f"{field.where}: {written(value)} is no whole number")
    if field.kind == INT and given.dtype.kind == "u" and given.size and int(given.max()) > np.iinfo(dtype).max:
        raise BadInput(f"{field.where}: {written(value)} is more than a whole number may be" if given.size < 20
                       else f"{field.where}: not all numbers are in its range")
    if field.kind == BOOL and given.dtype.kind != "b" and not np.isin(given, (0, 1)).all():
        raise BadInput(f"{field.where}: {written(value)} is neither true nor false")
    return np.ascontiguousarray(given.reshape(wanted), dtype)


def _of_words(field: Field, value: Any) -> int:
    words = [word.strip() for word in value.split(",")] if isinstance(value, str) else items_of(value, field.where)
    found = 0
    for word in words:
        if not isinstance(word, str):
            raise BadInput(f"{field.where}: {word!r} is no word")
        if word == "none" and field.flags:
            continue
        if word not in field.words or (len(words) > 1 and not field.flags):
            known = ", ".join(field.words) or "a number"
            raise BadInput(f"{field.where}: \"{value}\" is none of {known}{nearest(str(word), field.words)}")
        found |= field.words[word]
    return found


def _whole(field: Field, given: Array) -> Array:
    """Numbers as unsigned integers of the field's size, which they must be."""
    if given.dtype != field.element and given.size:
        most = np.iinfo(field.element).max
        if given.dtype.kind == "f":
            raise BadInput(f"{field.where}: its elements are {field.element.name}, not {given.dtype}; "
                           f"say .astype(\"{field.element.name}\")")
        if int(given.min()) < 0 or int(given.max()) > most:
            raise BadInput(f"{field.where}: its numbers are from 0 to {most}")
    return np.ascontiguousarray(given, field.element)


def array(field: Field, value: Any) -> Array:
    """An array of bytes or numbers as it lies on the wire; no copy where it does already."""
    if value is None:
        return np.zeros(0, np.uint8)
    # A view of numbers is no view of bytes.
    if isinstance(value, (bytes, bytearray)) or (
        isinstance(value, memoryview) and value.format in ("B", "b", "c") and value.c_contiguous):
        raw = np.frombuffer(value, np.uint8)
        if field.each and raw.nbytes % (field.each * field.element.itemsize):
            raise BadInput(f"{field.where}: {raw.nbytes} bytes are no elements of {field.each} {field.element.name}")
        return raw
    given = as_array(value, field.where)
    if given.dtype.kind not in "fiu":
        raise BadInput(f"{field.where}: {given.dtype} is no type of numbers")
    if field.each:
        if given.size % field.each:
            raise BadInput(f"{field.where}: {given.size} numbers are no elements of {field.each}")
        if field.element.kind == "u":
            return _whole(field, given)
        return finite(given, field.element, field.where)
    if not given.size:
        return np.zeros(0, np.uint8)
    if given.dtype.itemsize == 8 or (given.dtype.kind == "i" and given.dtype.itemsize > 1):
        raise BadInput(f"{field.where}: elements of {given.dtype} could mean two things; "
                       "say which you mean, as .astype(\"uint32\")")
    return np.ascontiguousarray(given)


def row(field: Field, value: Any, resolve: Resolve, arrays: Arrays) -> Any:
    """One value as a row of a column: an array of numbers, bytes of a text or of an array's name, or an array of
    references."""
    if field.kind == INT and field.words and not isinstance(value, (int, np.integer)):
        return np.array([_of_words(field, value)], "<i8")
    if field.kind == REF:
        return np.array([resolve(value, field)], "<u8")
    if field.kind == REFS and isinstance(value, np.ndarray) and value.dtype.kind == "u":  # `ids` of Nodes
        return np.ascontiguousarray(value.reshape(-1), "<u8")
    if field.kind == REFS:
        return np.array([resolve(each, field) for each in (() if value is None else items_of(value, field.where))],
                        "<u8")
    if field.kind == TEXT:
        return utf8(value, field.where)
    if field.kind == BLOB:
        return arrays.name_of(array(field, value))
    return numbers(field, value)


def column(field: Field, rows: Sequence[Any]) -> _wire.Part:
    """Rows one behind the other, as a part."""
    if field.kind == TEXT:
        return pack_texts(rows)
    if field.kind == REFS:
        return pack_refs(rows)
    if field.kind == BLOB:
        return b"".join(rows)
    return _wire.view_of(np.concatenate(rows)) if len(rows) > 1 else _wire.view_of(rows[0])


def many(field: Field, values: Any, rows: int, resolve: Resolve, arrays: Arrays) -> Any:
    """A whole column at once: an array for numbers, else a list of rows."""
    if field.kind in (FLOAT, DOUBLE, MATRIX,
                      BOOL) or (field.kind == INT and not isinstance(values, str) and not _holds_words(values)):
        return numbers(field, values, rows)
    if isinstance(values, str) or values is None:
        raise BadInput(f"{field.where}: one value for {rows} objects")
    given = items_of(values, field.where)
    if len(given) != rows:
        raise BadInput(f"{field.where}: {len(given)} values for {rows} objects")
    return [row(field, each, resolve, arrays) for each in given]


def _holds_words(values: Any) -> bool:
    return isinstance(values, (list, tuple)) and any(isinstance(each, str) for each in values)


def to_python(field: Field, value: Any) -> Any:
    """A row of a decoded column as people read it: words for words, tuples for a few numbers. References and arrays
    stay what they are."""
    if field.kind == INT and field.words:
        number = int(value)
        if field.flags:
            return ",".join(word for word, bit in field.words.items() if number & bit) or "none"
        return next((word for word, known in field.words.items() if known == number), number)
    if field.kind == MATRIX:
        return np.asarray(value).reshape(4, 4).T
    if field.kind in (FLOAT, DOUBLE):
        return tuple(np.asarray(value).tolist()) if field.width > 1 else float(value)
    if field.kind == BOOL:
        return bool(value)
    if field.kind == INT:
        return int(value)
    return value


def default(field: Field) -> Any:
    """What a fresh object has, as `to_python` tells it."""
    if field.kind == MATRIX:
        return np.asarray(field.default, float).reshape(4, 4).T
    if field.kind == REF:
        return None
    if field.kind == BLOB:  # without bytes
        return np.zeros((0, field.each) if field.each > 1 else 0, field.element)
    if field.kind == REFS:
        return []
    return field.default if field.kind == TEXT else to_python(field, field.default)
