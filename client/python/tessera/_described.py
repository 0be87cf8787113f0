"""Whatever is described (requests, answers, notices, messages of the session) as bytes and back, by its description
alone."""
from __future__ import annotations

import functools
from typing import Any, Iterator, Mapping, Optional, Sequence

import numpy as np

from ._types import DType, as_array, items_of, utf8
from . import _wire
from ._schema import Said, nearest
from .errors import BadInput, TesseraError, UnknownField, Unsupported

VECTORS = {"Vector": 3, "Rotation": 4, "Place": 2}
_SCALARS = {"bool": "<u4", "word": "<u4", "text": "<u4", "double": "<f8"}


class Told:
    """What the server has told: its members as attributes. Numbers of records are numpy arrays (views of what
    arrived)."""

    __slots__ = ("_said", "_values", "_generation")

    def __init__(self, said: str, values: dict[str, Any]) -> None:
        self._said = said
        self._values = values
        self._generation = 0  # of the link that brought it: what numbers of objects in it count by

    def __getattr__(self, name: str) -> Any:
        try:
            return self._values[name]
        except KeyError:
            raise UnknownField(f"{self._said} has no member \"{name}\"{nearest(name, self._values)}") from None

    def __dir__(self) -> list[str]:
        return list(self._values)

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __getitem__(self, name: str) -> Any:
        return self._values[name]

    def __repr__(self) -> str:
        return f"{self._said}({', '.join(f'{name}={value!r}' for name, value in self._values.items())})"

    def as_dict(self) -> dict[str, Any]:
        return dict(self._values)


# ---- records

def _has_text(field: Mapping[str, Any]) -> bool:
    return any(each["type"] == "text" or _has_text(each) for each in field.get("fields", ()))


def _dtype_of_field(field: Mapping[str, Any]) -> Any:
    kind = field["type"]
    if kind == "reserved":
        return np.dtype((np.void, field["bytes"]))
    if kind in VECTORS:
        return np.dtype(("<f8", (VECTORS[kind],)))
    if "fields" in field:
        return record_of(field)
    scalar = np.dtype(_SCALARS.get(kind) or f"<{kind[0]}{int(kind.lstrip('uint')) // 8}")
    return np.dtype((scalar, (field["count"],))) if field.get("count", 1) > 1 else scalar


_RECORDS: dict[int, DType] = {}


def record_of(field: Mapping[str, Any]) -> DType:
    """The layout of a record of a part."""
    known = _RECORDS.get(id(field))
    if known is None:
        parts = [(each["name"] or f"_reserved{at}", _dtype_of_field(each)) for at, each in enumerate(field["fields"])]
        known = _RECORDS[id(field)] = np.dtype(parts)
        if known.itemsize != field["bytes"]:
            raise Unsupported(f"records of {field['name']} have {field['bytes']} bytes, and are described with "
                              f"{known.itemsize}")
    return known


# ---- writing

def _whole(value: Any, field: Mapping[str, Any], where: str) -> int:
    words = field.get("words")
    if words and isinstance(value, str):
        if value not in words:
            raise BadInput(f"{where}: \"{value}\" is none of {', '.join(words)}")
        return int(words.index(value))
    try:
        number = int(value) if isinstance(value, np.bool_) else int(value.__index__())
    except (AttributeError, TypeError):
        raise BadInput(f"{where}: {value!r} is no whole number") from None
    if number < 0 or number >= 1 << 64:
        raise BadInput(f"{where}: {number} is not from 0 to 2^64 - 1")
    return number


def _real(value: Any, where: str) -> float:
    if isinstance(value, (str, bytes, bool, np.bool_)):
        raise BadInput(f"{where}: {value!r} is no number")
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise BadInput(f"{where}: {value!r} is no number") from None


def _text(value: Any, where: str) -> bytes:
    return bytes(value) if isinstance(value, (bytes, bytearray)) else utf8(value, where)


def _members_of(value: Any, where: str) -> Mapping[str, Any]:
    if isinstance(value, Told):
        return value.as_dict()
    if not isinstance(value, Mapping):
        raise BadInput(f"{where}: {value!r} has no members; write {{\"name\": value, …}}")
    return value


def _put(field: Mapping[str, Any], value: Any, head: bytearray, parts: list[_wire.Part], where: str,
         always: bool) -> None:
    kind, number = field["type"], field["number"]
    if kind == "text":
        data = _text(value, where)
        if data or always:
            _wire.put_bytes(head, number, data)
    elif kind == "double":
        bits = _wire.bits_of(_real(value, where))
        if bits or always:
            _wire.put_fixed(head, number, bits)
    elif kind == "fixed64":
        whole = _whole(value, field, where)
        if whole or always:
            _wire.put_fixed(head, number, whole)
    elif kind in VECTORS:
        numbers = np.asarray(value, dtype=object).reshape(-1)
        if len(numbers) != VECTORS[kind]:
            raise BadInput(f"{where}: {len(numbers)} numbers instead of {VECTORS[kind]}")
        inner = bytearray()
        for at, each in enumerate(numbers):
            bits = _wire.bits_of(_real(each, where))
            if bits:
                _wire.put_fixed(inner, at + 1, bits)
        _wire.put_bytes(head, number, inner)
    elif "fields" in field:
        inner = bytearray()
        put_members(field["fields"], _members_of(value, where), inner, parts, where)
        _wire.put_bytes(head, number, inner)
    else:
        whole = _whole(value, field, where)
        if whole or always:
            _wire.put_varint(head, number, whole)


def _put_many(field: Mapping[str, Any], said: Any, head: bytearray, parts: list[_wire.Part], where: str) -> None:
    values = items_of(said, where)
    if field["type"] == "text" or "fields" in field:
        for value in values:
            _put(field, value, head, parts, where, True)
    elif len(values):
        packed = bytearray()
        for value in values:
            if field["type"] == "double":
                packed += _wire._DOUBLE.pack(_real(value, where))
            else:
                packed += _wire.varint(_whole(value, field, where))
        _wire.put_bytes(head, field["number"], packed)


def _put_part(field: Mapping[str, Any], value: Any, parts: list[_wire.Part], where: str) -> None:
    if field.get("rest"):
        parts.extend(value if value is not None else ())
    elif field["type"] == "bytes":
        parts.append(value if value is not None else b"")
    elif "fields" not in field:
        numbers = as_array(value if value is not None else (), where, _dtype_of_field(field))
        parts.append(_wire.view_of(np.ascontiguousarray(numbers)))
    else:
        layout = record_of(field)
        if isinstance(value, (np.ndarray, np.void)):
            records, texts = np.ascontiguousarray(as_array(value, where, layout)).reshape(-1), b""
        else:
            rows = [] if value is None else [value] if field.get("optional") else items_of(value, where)
            records, texts = np.zeros(len(rows), layout), b""
            for at, row in enumerate(rows):
                for name in _members_of(row, where):
                    if name not in (layout.names or ()):
                        raise UnknownField(f"{where} has no \"{name}\"{nearest(name, layout.names or ())}")
                    if isinstance(row[name], str):
                        text = utf8(row[name], f"{where}.{name}")
                        texts += text
                        records[at][name] = len(text)
                    else:
                        records[at][name] = as_array(row[name], f"{where}.{name}", layout[name].base)
        parts.append(_wire.view_of(records))
        if _has_text(field):
            parts.append(texts)


def put_members(fields: Sequence[Mapping[str, Any]], values: Mapping[str, Any], head: bytearray,
                parts: list[_wire.Part], where: str) -> None:
    """What is not among the values is as if it had not been said."""
    for name in values:
        if not any(field["name"] == name for field in fields):
            raise UnknownField(f"{where} has no member \"{name}\"{nearest(name, [field['name'] for field in fields])}")
    for field in fields:
        value = values.get(field["name"])
        inside = f"{where}.{field['name']}"
        if field.get("part"):
            _put_part(field, value, parts, inside)
        elif value is None:
            if field["type"] in VECTORS and not (field.get("optional") or field.get("when")):
                raise BadInput(f"{inside} is missing")
        elif field.get("many"):
            _put_many(field, value, head, parts, inside)
        else:
            _put(field, value, head, parts, inside, bool(field.get("optional")))


def encode(said: Said, values: Mapping[str, Any]) -> _wire.Chain:
    """The body of a Request, of a Reply or of a Notice."""
    inner, parts = bytearray(), []  # type: bytearray, list[_wire.Part]
    put_members(said.fields, values, inner, parts, said.name)
    head = bytearray()
    _wire.put_bytes(head, said.number, inner)
    return _wire.join_parts(head, parts)


# ---- reading

def _zero(field: Mapping[str, Any]) -> Any:
    if field.get("many"):
        return []
    if field.get("optional"):
        return None
    kind = field["type"]
    if kind in VECTORS:
        return (0.0,) * VECTORS[kind]
    if "fields" in field:
        return Told(kind, {each["name"]: _zero(each) for each in field["fields"] if not each.get("part")})
    return {"text": "", "double": 0.0, "bool": False}.get(kind, field["words"][0] if "words" in field else 0)


def _taken(field: Mapping[str, Any], value: Any) -> Any:
    kind = field["type"]
    if kind == "text":
        return bytes(value).decode("utf-8", "replace")
    if kind == "double":
        return _wire.number_of(value)
    if kind in VECTORS:
        numbers = [0.0] * VECTORS[kind]
        for number, form, bits in _wire.fields_of(value):
            if form == _wire.FIXED and number <= len(numbers):
                numbers[number - 1] = _wire.number_of(bits)
        return tuple(numbers)
    if "fields" in field:
        return _take_head(field["fields"], value, kind)
    if kind == "bool":
        return bool(value)
    words = field.get("words")
    return words[value] if words and value < len(words) else value


def _kind_of(field: Mapping[str, Any]) -> int:
    if field["type"] == "text" or field["type"] in VECTORS or "fields" in field:
        return _wire.BYTES
    return _wire.FIXED if field["type"] in ("double", "fixed64") else _wire.VARINT


def _take_head(fields: Sequence[Mapping[str, Any]], head: memoryview, name: str) -> Told:
    values = {field["name"]: _zero(field) for field in fields if not field.get("part")}
    by_number = {field["number"]: field for field in fields if not field.get("part")}
    for number, form, value in _wire.fields_of(head):
        field = by_number.get(number)
        if field is None:
            continue
        single = form == _kind_of(field)  # of another kind it is as if it were not there
        if not field.get("many"):
            if single:
                values[field["name"]] = _taken(field, value)
        elif form == _wire.BYTES and not single:
            if field["type"] == "double":
                values[field["name"]].extend(np.frombuffer(value, "<f8").tolist())
            else:
                at = 0
                while at < len(value):
                    element, at = _wire.take_varint(value, at)
                    values[field["name"]].append(_taken(field, element))
        elif single:
            values[field["name"]].append(_taken(field, value))
    return Told(name, values)


def _records(field: Mapping[str, Any], data: memoryview, texts: Optional[memoryview]) -> Any:
    layout = record_of(field)
    if len(data) % layout.itemsize:
        raise BadInput(f"{field['name']} end in the middle of an entry")
    records = np.frombuffer(data, layout)
    if texts is None:
        return (records[0] if len(records) else None) if field.get("optional") else records
    told, at = [], 0
    for record in records:
        values = {each["name"]: record[each["name"]].item() for each in field["fields"]}
        for each in field["fields"]:
            if each["type"] == "text":
                size = values[each["name"]]
                values[each["name"]] = bytes(texts[at:at + size]).decode("utf-8", "replace")
                at += size
        told.append(Told(field["type"], values))
    return told


def _take_parts(fields: Sequence[Mapping[str, Any]], told: Told, parts: Iterator[memoryview]) -> None:
    for field in fields:
        name = field["name"]
        if field.get("rest"):
            told._values[name] = list(parts)
        elif field.get("part"):
            data = next(parts, memoryview(b""))
            if field["type"] == "bytes":
                told._values[name] = data
            elif "fields" in field:
                told._values[name] = _records(field, data, next(parts, memoryview(b"")) if _has_text(field) else None)
            else:
                told._values[name] = np.frombuffer(data, _dtype_of_field(field))
        elif "fields" in field and _has_parts(id(field), field):
            inner = told._values[name]
            for each in inner if field.get("many") else [inner] if inner is not None else []:
                _take_parts(field["fields"], each, parts)


_PARTS: dict[int, bool] = {}


def _has_parts(key: int, field: Mapping[str, Any]) -> bool:
    if key not in _PARTS:
        _PARTS[key] = any(each.get("part") or ("fields" in each and _has_parts(id(each), each))
                          for each in field["fields"])
    return _PARTS[key]


def decode(known: Mapping[int, Said], body: memoryview) -> Told:
    """Which of them it is, with its members. Unsupported: none of these. BadInput: it makes no sense."""
    try:
        return _decode(known, body)
    except (ValueError, LookupError, TypeError, OverflowError) as error:
        raise (error if isinstance(error, TesseraError)
               else BadInput(f"what the server told makes no sense: {error}")) from None


def _decode(known: Mapping[int, Said], body: memoryview) -> Told:
    head, parts = _wire.split_parts(body)
    for number, kind, value in _wire.fields_of(head):
        said = known.get(number)
        if said is None or kind != _wire.BYTES:
            continue
        told = _take_head(said.fields, value, said.name)
        _take_parts(said.fields, told, iter(parts))
        return told
    raise Unsupported("the server told something that this version does not know")


# ---- messages of the session (common/session/MessageFields.h)

@functools.lru_cache(maxsize=None)
def _blob_record() -> DType:
    return np.dtype([("low", "<u8"), ("high", "<u8"), ("bytes", "<u8")])


def encode_message(said: Said, values: Mapping[str, Any]) -> _wire.Chain:
    head, parts = bytearray(), []  # type: bytearray, list[_wire.Part]
    for field in said.fields:
        form, number = field["form"], field.get("number", 0)
        value = values.get(field["name"])
        if form in ("bytes", "records"):
            parts.append(value if value is not None else b"")
        elif not value:
            continue
        elif form == "varint":
            _wire.put_varint(head, number, int(value))
        elif form == "fixed":
            _wire.put_fixed(head, number, value & 0xFFFFFFFFFFFFFFFF)
        elif form in ("text", "reason"):
            _wire.put_bytes(head, number, value.encode() if isinstance(value, str) else value)
        elif form == "hash":
            for at, word in enumerate(value):
                if word:
                    _wire.put_fixed(head, number + at, word)
        else:
            raise Unsupported(f"an application does not say {said.name}.{field['name']}")
    return _wire.join_parts(head, parts)


def decode_message(said: Said, payload: memoryview) -> dict[str, Any]:
    """Its members by name: of a "list" its `sequence`, `state_hash`, `list` and `blobs`."""
    head, parts = _wire.split_parts(payload)
    numbers: dict[int, int] = {}
    texts: dict[int, memoryview] = {}
    for at, kind, told in _wire.fields_of(head):
        if kind == _wire.BYTES:
            texts[at] = told
        else:
            numbers[at] = told
    left = iter(parts)
    values: dict[str, Any] = {}
    for field in said.fields:
        form, number, name = field["form"], field.get("number", 0), field["name"]
        if form in ("varint", "fixed"):
            values[name] = numbers.get(number, 0)
        elif form in ("text", "reason"):
            values[name] = bytes(texts.get(number, b"")).decode("utf-8", "replace")
        elif form == "hash":
            values[name] = (numbers.get(number, 0), numbers.get(number + 1, 0))
        elif form == "blob":
            values[name] = tuple(numbers.get(number + at, 0) for at in range(3))
        elif form == "list":
            values["sequence"], values["state_hash"] = numbers.get(number, 0), numbers.get(number + 1, 0)
            values["list"] = next(left, memoryview(b""))
            values["blobs"] = np.frombuffer(next(left, b""), _blob_record())
        else:
            values[name] = next(left, memoryview(b""))
    return values
