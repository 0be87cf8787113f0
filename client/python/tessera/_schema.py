"""What can be asked and what a scene holds, as `tessera-ctl requests --json` and `tessera-ctl types --json` have
printed it when this package was built. There is no table of requests, answers or types in Python: a new one needs no
line here."""
from __future__ import annotations

import difflib
import functools
import json
import pathlib
from typing import Any, Iterable, Mapping, Optional

import numpy as np

from ._types import DType
from .errors import UnknownField

# The shapes that a field can have, as change.proto numbers them.
KINDS = ("float", "double", "int", "ref", "text", "blob", "bool", "reference list", "matrix")
FLOAT, DOUBLE, INT, REF, TEXT, BLOB, BOOL, REFS, MATRIX = range(len(KINDS))
SCALARS: dict[int, Any] = {FLOAT: np.dtype("<f4"), DOUBLE: np.dtype("<f8"), INT: np.dtype("<i8"), REF: np.dtype("<u8"),
                           BOOL: np.dtype("u1"),
                           MATRIX: np.dtype("<f8")}


def nearest(name: Any, known: Iterable[str]) -> str:
    """Behind the message about a name that does not exist."""
    if not isinstance(name, str):
        return ""
    close = difflib.get_close_matches(name, list(known), 3, 0.5)
    return f"; is it {' or '.join(close)}?" if close else ""


_ELEMENTS = {"floats_each": "<f4", "doubles_each": "<f8",
             "uint8_each": "u1", "uint16_each": "<u2", "uint32_each": "<u4"}


class Field:
    """A field of a type of objects."""

    def __init__(self, json_field: Mapping[str, Any], owner: str) -> None:
        self.name: str = json_field["name"]
        self.number: int = json_field["number"]
        self.kind: int = KINDS.index(json_field["kind"])
        self.width: int = 16 if self.kind == MATRIX else json_field["width"]
        self.unit: str = json_field["unit"]
        self.words: Mapping[str, int] = json_field.get("words", {})
        self.flags: bool = json_field.get("flags", False)
        self.to: str = json_field.get("to", "")  # of references: the type's name, "any core" or "anything"
        self.default = json_field["default"]
        self.where = f"{owner}.{self.name}"
        # Of an array of numbers: how many an element has, and of which type; 0: it is an array of something else.
        self.each: int = 0
        self.element: DType = np.dtype("u1")
        for said, element in _ELEMENTS.items():
            if said in json_field:
                self.each, self.element = json_field[said], np.dtype(element)


class Type:
    """A type of objects."""

    def __init__(self, json_type: Mapping[str, Any]) -> None:
        self.name: str = json_type["name"]
        self.number: int = json_type["number"]
        self.is_core: bool = json_type["core"]
        self.fields = {each["name"]: Field(each, self.name) for each in json_type["fields"]}
        self.by_number = {field.number: field for field in self.fields.values()}

    def field(self, name: str) -> Field:
        found = self.fields.get(name) if isinstance(name, str) else None
        if found is None:
            raise UnknownField(f"a {self.name} has no field \"{name}\"{nearest(name, self.fields)}")
        return found


class Said:
    """A request, an answer, a notice or a message, as it is described."""

    def __init__(self, described: Mapping[str, Any]) -> None:
        self.name: str = described["name"]
        self.number: int = described["number"]
        self.fields: list[dict[str, Any]] = described["fields"]
        self.answer: Optional[str] = described.get("answer")
        self.help: str = described.get("help", "")


class Schema:
    def __init__(self, requests: Mapping[str, Any], types: Mapping[str, Any]) -> None:
        self.protocol: int = requests["protocol"]
        wire = requests["wire"]
        self.schema = int(wire["schema"], 16)
        self.errors: list[str] = wire["errors"]
        self.limits: dict[str, int] = wire["limits"]
        self.requests = {each["name"]: Said(each) for each in requests["requests"]}
        self.answers = {each["number"]: Said(each) for each in requests["answers"]}
        self.notices = {each["number"]: Said(each) for each in requests["notices"]}
        self.messages = {each["name"]: Said(each) for each in wire["messages"]}
        self.message_names = {each.number: each.name for each in self.messages.values()}
        self.most_bytes: dict[int, int] = {each["number"]: each["most_bytes"] for each in wire["messages"]}
        self.types = {each["name"]: Type(each) for each in types["types"]}
        self.types_by_number = {each.number: each for each in self.types.values()}
        self.subscriptions = self._subscriptions()

    def request(self, name: str) -> Said:
        found = self.requests.get(name) if isinstance(name, str) else None
        if found is None:
            raise UnknownField(f"there is no request \"{name}\"{nearest(name, self.requests)}")
        return found

    def type(self, name: str) -> Type:
        found = self.types.get(name) if isinstance(name, str) else None
        if found is None:
            raise UnknownField(f"there is no type \"{name}\"{nearest(name, self.types)}")
        return found

    def _subscriptions(self) -> dict[str, str]:
        """Which notice a member of SubscribeNews brings: the one that has its singular in its name."""
        found = {}
        for member in self.requests["SubscribeNews"].fields:
            for notice in self.notices.values():
                if member["name"].rstrip("s") in notice.name.lower():
                    found[member["name"]] = notice.name
        return found


@functools.lru_cache(maxsize=None)
def schema() -> Schema:
    folder = pathlib.Path(__file__).parent
    try:
        texts = [(folder / name).read_text(encoding="utf-8") for name in ("requests.json", "types.json")]
    except FileNotFoundError as missing:
        raise ImportError(f"tessera: {missing.filename} is missing; it is made with the package: ./deploy/build build "
                          f"tessera_python, "
                          "and then PYTHONPATH=build/python, or ./deploy/install PREFIX") from None
    return Schema(json.loads(texts[0]), json.loads(texts[1]))
