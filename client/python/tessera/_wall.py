"""A running wall, as a program sees it."""
from __future__ import annotations

import os
import threading
import time
import weakref
from typing import Any, Iterator, Mapping, Optional, Sequence, Union

import numpy as np

from ._types import Array, items_of, seconds, utf8, whole
from . import _changes, _door, _values, _wire
from ._arrays import Fetcher, uploads_of
from ._channel import ByPort, Way
from ._described import Told, decode, encode
from ._edit import Edit
from ._hash import hash64
from ._link import Link, Stale
from ._picture import encode_png, mosaic_of
from ._schema import BLOB, REF, REFS, Field, Type, schema
from ._subscription import ChangesSubscription, Subscription, Subscriptions
from ._tunnel import ByLink
from .errors import BadInput, NotFound, Refused, TesseraError, Timeout, Unsupported
from .objects import Node, Nodes, Object, many
from .shapes import Shown

_NAMES_AT_ONCE = 64  # what is asked for costs the server time between two frames
_LOAD_TIMEOUT = 600.0  # the server may need minutes of a busy machine
_IMAGE_TIMEOUT = 120.0
_MOST_TAKEN = 4096  # names of arrays
_ALL_LEVELS = 2 ** 32 - 1


def _way_to(said: str, token_file: Optional[str], keys: Optional[str]) -> Way:
    if keys and token_file:
        raise BadInput("a key says who comes in; a file with a token is for who has none")
    if "://" not in said:
        return ByPort(said, token_file, keys)
    if token_file:
        raise BadInput("a link has its token in it; a file with a token goes with an address, HOST:PORT")
    if keys:
        raise BadInput("a link has its token in it; a key goes with an address, HOST:PORT")
    return ByLink(said)


def _close(fetcher: Fetcher, link: Link) -> None:
    fetcher.close()
    link.close()


class Wall:
    """Get one from `tessera.connect`. Any thread may call anything, at any time; each waits for its own answers, at
    most `timeout` seconds (Timeout). A thread inside answers the server's heartbeats and dials again for `redial`
    seconds where the connection breaks: what was under way then raises NetworkError, what is asked meanwhile waits, and
    subscriptions are made again. A wall that nothing holds any more is closed. In the child of a fork it is the
    parent's: what is asked there raises NetworkError."""

    def __init__(self, address: Optional[str] = None, *, token_file: Optional[str] = None, keys: Optional[str] = None,
                 name: str = "python",
                 timeout: float = 10.0, redial: float = 60.0) -> None:
        self.schema = schema()
        wait, patience = seconds(timeout, "timeout"), seconds(redial, "redial")
        if wait is None or patience is None:
            raise BadInput("timeout, redial: numbers of seconds, and not None")
        self.timeout: float = wait
        utf8(name, "name")
        for what, said in (("address", address), ("token_file", token_file), ("keys", keys)):
            if said is not None and not isinstance(said, (str, os.PathLike)):
                raise BadInput(f"{what}: {said!r} is no text")
        way = _way_to(_door.address_of(address), token_file, os.fspath(keys) if keys is not None else None)
        self.address = way.address
        self.name = name
        self._local = threading.local()
        self._subscriptions = Subscriptions(self)
        self._keeps: dict[int, bool] = {}
        self._taken: dict[bytes, None] = {}  # arrays that the server has had from here, the oldest first
        self._shown = Shown()
        self._link = Link(self.schema, way, name=name, timeout=self.timeout, redial=patience, follows=False,
                          on_message=self._subscriptions.told, on_back=self._subscriptions.back,
                          on_end=self._subscriptions.ended)
        self._fetcher = Fetcher(self._link)
        self._dropped = weakref.finalize(self, _close, self._fetcher, self._link)
        self._dropped.atexit = False

    # ---- the connection

    def close(self) -> None:
        """Subscriptions end, and whoever waits is told."""
        self._dropped()
        self._subscriptions.ended(None)
        self._subscriptions.close_apart()

    def __enter__(self) -> "Wall":
        return self

    def __exit__(self, kind: Any, value: Any, trace: Any) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<tessera wall at {self.address}{'' if self.connected else ' (not connected)'}>"

    @property
    def connected(self) -> bool:
        """False: the connection broke and is dialled again, or has ended."""
        return self._link.connected

    @property
    def over(self) -> bool:
        """The server has ended, as it was told to."""
        return self._link.over

    @property
    def keeps_numbers(self) -> bool:
        """Whether numbers of objects still mean the same after the connection broke: the server has a journal."""
        generation = self._link.settled()
        while True:
            try:
                return self._keeps_at(generation)
            except Stale as stale:
                generation = stale.generation

    def ask(self, request: str, *, timeout: Optional[float] = None, **members: Any) -> Told:
        """Any request that `tessera-ctl requests` lists, with its members; its answer. The other methods are shorter
        words for some."""
        return self._ask(request, None, members, timeout)

    def status(self) -> Told:
        """How the wall is: hosts, frame, scene, journal, detail."""
        return self.ask("GetStatus")

    def whoami(self) -> Told:
        """As whom the server knows this program: `name`, and `role`: "viewer" (looks), "editor" (changes the scene),
        "operator" (all)."""
        return self.ask("WhoAmI")

    # ---- the scene

    def __getitem__(self, path: str) -> Node:
        """The node at a path ("/hall/crane") or number ("#17"). NotFound says which step failed."""
        if not isinstance(path, str):
            raise BadInput(f"{path!r} is no path of a node")
        current = self._current()
        made = current._paths.get(path) if current else None
        return made or self._node(path)

    def __contains__(self, path: str) -> bool:
        return bool(self._describe([path])[0][0].id)

    @property
    def root(self) -> Node:
        return self._node("/")

    def handle(self, number: int, type: str = "Node", core: int = 0, core_type: Optional[str] = None) -> Object:
        """Of an object whose number and type are known, as `tree` and `follow("changes")` tell them: nothing is
        asked."""
        kind, of_core = self.schema.type(type), self.schema.type(core_type) if core_type is not None else None
        number = whole(number, _changes.FIRST_PLACEHOLDER - 1, "number: of an object")
        if kind.name != "Node":
            return Object(self, number, kind, self._link.generation)
        return Node(self, number, kind, self._link.generation, f"#{number}",
                    whole(core, _changes.FIRST_PLACEHOLDER - 1, "core: of an object"), of_core)

    def tree(self, node: Node) -> Iterator[tuple[Array, _changes.Changes]]:
        """What is at and below a node, page by page: rows of "node", "parent" and "children" (how many), and a list
        that would make these nodes and their cores."""
        if not isinstance(node, Node):
            raise BadInput(f"node: {node!r} is no node")
        node._on(self)
        number, since = node._number(), node._generation
        after: Any = ()
        while True:
            page = self._ask("GetTree", since, {"node": number, "levels": _ALL_LEVELS, "after": after})
            yield page.nodes, _changes.decode(self.schema, page.content, page.sequence)
            after, since = page.next, page._generation
            if not len(after):
                return

    def find(self, expression: str, type: Optional[str] = None, below: Optional[Node] = None) -> list[Node]:
        """The nodes that an expression names: "/hall/**/wheel*"; with `type` only those with such a core."""
        found: list[Node] = []
        after: Any = ()
        number = self.schema.type(type).number if type is not None else 0
        if below is not None and not isinstance(below, Node):
            raise BadInput(f"below: {below!r} is no node")
        if below is not None:
            below._on(self)
        top, since = (below._number(), below._generation) if below is not None else (1, None)
        while True:
            page = self._ask("FindNodes", since,
                             {"expression": expression, "node": top, "core_type": number, "page_size": 256,
                              "after": after})
            found.extend(self._node_of(info, page._generation) for info in page.nodes)
            after, since = page.next, page._generation
            if not len(after):
                return found

    def nodes(self, which: Union[str, Sequence[Union[str, Node]]]) -> Nodes:
        """Many at once: of an expression, of paths, or of nodes. Their cores are of one type."""
        if isinstance(which, str):
            return many(self, self.find(which))
        given = list(which) if isinstance(which, Nodes) else items_of(which, "nodes")
        for each in given:
            if not isinstance(each, (str, Node)):
                raise BadInput(f"nodes: {each!r} is neither a node nor the path of one")
            if isinstance(each, Node):
                each._on(self)
        paths = [each for each in given if isinstance(each, str)]
        told = dict(zip(paths, self._nodes(paths)))
        return many(self, [told[each] if isinstance(each, str) else each for each in given])

    def edit(self, undo: Optional[str] = None) -> Edit:
        """`with wall.edit(): …` : all that this thread assigns and creates within is granted or refused as one. Edits
        in a row with the same `undo` are taken back as one step."""
        return Edit(self, undo)

    def create(self, path: str, type: Optional[str] = "Transform", **fields: Any) -> Node:
        """A new node at a path, with a new core of that type."""
        current = self._current()
        edit = current or self.edit()
        node = edit.create(path, type, **fields)
        if not current:
            edit.commit()
        return node

    def object(self, type: str, **fields: Any) -> Object:
        """A new object beside the tree, which something refers to: within the same edit, or it goes with the next
        undo."""
        current = self._current()
        edit = current or self.edit()
        made = edit.object(type, **fields)
        if not current:
            edit.commit()
        return made

    def remove(self, path: str) -> Told:
        return self[path].remove()

    def load(self, path: str, under: Union[None, str, Node] = None, timeout: float = _LOAD_TIMEOUT,
             **placing: Any) -> Node:
        """A file on the server's disk, or "asset://NAME". `at`, `scale`, `fit`, `up`, `point_radius` say how it stands.
        With `reload=True` one that is there already is taken in again in its place: what has changed in it."""
        parent = self[under] if isinstance(under, str) else under
        if parent is not None and not isinstance(parent, Node):
            raise BadInput(f"under: {under!r} is neither a node nor the path of one")
        if parent is not None:
            parent._on(self)
        where = {"parent": parent._number() if parent else 0, **placing}
        since = parent._generation if parent else None
        if not isinstance(path, str):
            raise BadInput(f"{path!r} is no path of a file")
        if path.startswith("asset://"):
            loaded = self._ask("LoadAsset", since, {"name": path[8:], **where}, timeout)
        else:
            loaded = self._ask("LoadFile", since, {"path": path, **where}, timeout)
        return self._node(f"#{loaded.node}", loaded._generation)

    def undo(self) -> Told:
        """Takes back the last step, whoever made it."""
        return self.ask("UndoStep")

    def redo(self) -> Told:
        return self.ask("RedoStep")

    # ---- what is seen

    def image(self, timeout: float = _IMAGE_TIMEOUT) -> Array:
        """What the wall shows, height × width × 3 (uint8): the visible pixels of all screens side by side, lossless,
        and not older than this program's last granted edit. Tiles that nobody draws are black. The server waits as
        long as hosts draw, a minute at most."""
        deadline = time.monotonic() + timeout
        while True:
            told = self.ask("GetImages", timeout=max(0.001, deadline - time.monotonic()))
            frames = {int(tile.frame) for tile in told.tiles}
            if len(frames) == 1:
                return mosaic_of(self._link.configuration, told)
            if not frames:
                raise Refused("no host gave its picture in time: none draws now, or all are at a slow frame; status() "
                              "says which")
            if time.monotonic() >= deadline:
                raise Timeout(f"the tiles show different frames, {min(frames)} to {max(frames)}")

    def _repr_png_(self) -> Optional[bytes]:
        """For notebooks."""
        try:
            return encode_png(self.image())
        except TesseraError:
            return None

    def show(self, x: Any, path: Optional[str] = None, **look: Any) -> Node:
        """Anything with vertices and faces, or points, on the wall (shapes.Shown.show says what it takes and which
        looks there are). The same path again replaces what is there."""
        return self._shown.show(self, x, path, **look)

    def view(self, **wish: Any) -> None:
        """`position`, `orientation`, `world_units_per_metre` of the wall; `user` and `head`; `reset`."""
        self.ask("SetView", **wish)

    def pick(self, x_px: float, y_px: float) -> Told:
        """What is at a pixel of the first screen's mosaic, from its upper left; `node` is a number, `hit` false where
        there is nothing."""
        return self.ask("PickAt", x_px=x_px, y_px=y_px)

    # ---- collisions

    def contacts(self) -> Array:
        """What touches in the newest frame."""
        found: Array = self.ask("GetContacts").contacts
        return found

    def questions(self) -> Array:
        """Motions that were stopped and wait for a decision."""
        found: Array = self.ask("GetQuestions").questions
        return found

    def respond(self, question: Any, decision: str, **pose: Any) -> None:
        """Decides a question (its record, or its number): "stop", "pass", or "move" with `translation`, `rotation`,
        `scale`."""
        if isinstance(decision, str) and decision == "move":
            pose = {"translation": (0, 0, 0), "rotation": (1, 0, 0, 0), "scale": (1, 1, 1), **pose}
        number = question["id"] if isinstance(question, np.void) else question
        self.ask("AnswerQuestion", question=number, decision=decision, **pose)

    # ---- what happens

    def follow(self, what: str, *, timeout: Optional[float] = None, most: int = 1024, **options: bool) -> Subscription:
        """An iterator of what the server tells of each frame from now on: "frames", "contacts", "events" (`stays=True`:
        those that go on, too), "distances", "questions", "picks", "poses", or "changes" of the scene. It waits for the
        next one, at most `timeout` seconds (Timeout; None: however long), and ends when the wall does. Of `most` that
        wait unread the oldest go; `missed` counts them, `gaps` how often the connection broke and came back."""
        if isinstance(what, str) and what == "changes":
            return ChangesSubscription(self, timeout, most)
        return self._subscriptions.open(what, timeout, most, options)

    def frames(self, timeout: Optional[float] = None) -> Subscription:
        """`follow("frames")`: a wall's own clock."""
        return self.follow("frames", timeout=timeout)

    # ---- inside

    def _enter(self, edit: Edit) -> None:
        if self._current() is not None:
            raise Refused("an edit is open already in this thread; edits do not stand one within the other")
        self._local.edit = edit

    def _leave(self, edit: Edit) -> None:
        self._local.edit = None

    def _current(self) -> Optional[Edit]:
        current: Optional[Edit] = getattr(self._local, "edit", None)
        return current

    def _gesture(self, undo: Optional[str]) -> int:
        word = utf8(undo, "undo") if undo is not None else b""
        return hash64(word + f"\0{id(self)}".encode()) | 1 if word else 0

    # What goes out with numbers of objects says of which generation they are: checked when it is sent, it cannot mean
    # others.

    def _ask(self, request: str, since: Optional[int], members: Mapping[str, Any],
             timeout: Optional[float] = None) -> Told:
        """`since`: the generation of the numbers among the members; None: there are none."""
        return self._send(encode(self.schema.request(request), members), (), timeout, since)

    def _send(self, body: _wire.Chain, uploads: Sequence[_wire.Chain], timeout: Optional[float],
              since: Optional[int]) -> Told:
        timeout = seconds(timeout, "timeout")
        while True:
            try:
                return self._told(self._link.answer(self._link.request(body, uploads, timeout, since), timeout))
            except Stale as stale:
                try:
                    kept = self._keeps_at(stale.generation)
                except Stale:
                    continue
                if not kept:
                    raise NotFound("what this names was found before the connection broke; look it up again") from None
                since = stale.generation

    def _told(self, reply: Mapping[str, Any]) -> Told:
        told = decode(self.schema.answers, reply["body"])
        told._generation = reply["generation"]
        return told

    def _keeps_at(self, generation: int) -> bool:
        """Stale: that one is over."""
        if generation not in self._keeps:
            asked = self._link.request(encode(self.schema.request("GetStatus"), {}), since=generation)
            self._keeps[generation] = bool(self._told(self._link.answer(asked)).journal)
        return self._keeps[generation]

    def _edits(self, request: str, since: int, **members: Any) -> Told:
        if self._current() is not None:
            raise Refused(f"{request} is a step of its own: it cannot stand within an edit")
        return self._ask(request, since, members)

    def _propose(self, changes: _wire.Chain, arrays: Mapping[bytes, Array], gesture: int, timeout: Optional[float],
                 since: Optional[int]) -> Told:
        """Arrays that the server took earlier are named alone. Where it has one no more it says NotFound, and all of
        them are sent."""
        fresh = {name: data for name, data in arrays.items() if name not in self._taken}
        try:
            told = self._said(changes, fresh, gesture, timeout, since)
        except NotFound:
            if len(fresh) == len(arrays):
                raise
            told = self._said(changes, arrays, gesture, timeout, since)
        self._taken.update(dict.fromkeys(arrays))
        for name in list(self._taken)[:max(0, len(self._taken) - _MOST_TAKEN)]:
            self._taken.pop(name, None)
        return told

    def _said(self, changes: _wire.Chain, arrays: Mapping[bytes, Array], gesture: int, timeout: Optional[float],
              since: Optional[int]) -> Told:
        uploads, small = uploads_of(self.schema, arrays)
        body = encode(self.schema.request("ProposeChanges"), {"list": changes, "blobs": small, "gesture": gesture})
        return self._send(body, uploads, timeout, since)

    def _describe(self, names: Sequence[str], since: Optional[int] = None, *,
                  paths: bool = False) -> tuple[list[Told], int]:
        """Each of them, and the generation that its numbers are of; `since`: that of numbers among the names."""
        found: list[Told] = []
        for at in range(0, len(names), _NAMES_AT_ONCE):
            told = self._ask("GetObjects", since, {"names": names[at:at + _NAMES_AT_ONCE], "paths": paths})
            since = told._generation
            found.extend(told.objects)
        return found, self._link.generation if since is None else since

    def _node_of(self, info: Told, generation: int) -> Node:
        kind = self.schema.types_by_number[info.type]
        if kind.name != "Node":
            raise NotFound(f"#{info.id} is a {kind.name}, not a node")
        return Node(self, info.id, kind, generation, info.path, info.core,
                    self.schema.types_by_number.get(info.core_type))

    def _nodes(self, names: Sequence[str], since: Optional[int] = None) -> list[Node]:
        found, generation = self._describe(names, since, paths=True)
        for info in found:
            if not info.id:
                raise NotFound(info.path)
        return [self._node_of(info, generation) for info in found]

    def _node(self, name: str, since: Optional[int] = None) -> Node:
        return self._nodes([name], since)[0]

    def _children(self, number: int, since: int) -> list[Node]:
        children: list[int] = []
        after: Any = ()
        while True:
            page = self._ask("GetTree", since, {"node": number, "levels": 1, "after": after})
            children.extend(page.nodes["node"][page.nodes["parent"] == number].tolist())
            after, since = page.next, page._generation
            if not len(after):
                return self._nodes([f"#{child}" for child in children], since)

    def _reference(self, value: Any, field: Field) -> int:
        if value is None:
            return 0
        if isinstance(value, Object):
            value._on(self)
        if isinstance(value, Node) and field.to != "Node":
            value._number()
            if not value._core:
                raise BadInput(f"{field.where}: {value.path} has no core, and it refers to {field.to}")
            return value._core
        if isinstance(value, Object):
            return value._number()
        if isinstance(value, (int, np.integer)) and not isinstance(
            value, bool) and 0 <= value < _changes.FIRST_PLACEHOLDER:
            return int(value)
        raise BadInput(f"{field.where}: {value!r} is no object")

    # Reading: what the server does not say of an object is as in a fresh one.

    def _content(self, numbers: Sequence[int], since: int) -> tuple[list[_changes.Changes], int]:
        """What they hold, and the generation that the numbers in it are of."""
        found = []
        for at in range(0, len(numbers), _NAMES_AT_ONCE):
            told = self._ask("GetObjects", since,
                             {"names": [f"#{number}" for number in numbers[at:at + _NAMES_AT_ONCE]], "content": True})
            for info in told.objects:
                if not info.id:
                    raise NotFound(info.path)
            since = told._generation
            found.append(_changes.decode(self.schema, told.content))
        return found, since

    def _value(self, field: Field, value: Any, since: int) -> Any:
        if field.kind == BLOB:
            return self._fetcher.fetch(value, field)
        if field.kind == REF:
            return self._object(int(value), since)
        if field.kind == REFS:
            return [self._object(number, since) for number in value.tolist()]
        return _values.to_python(field, value)

    def _object(self, number: int, since: int) -> Optional[Object]:
        if number == 0:
            return None
        (info,), generation = self._describe([f"#{number}"], since, paths=True)
        kind = self.schema.types_by_number.get(info.type)
        if not info.id or kind is None:
            return None
        return self._node_of(info, generation) if kind.name == "Node" else Object(self, number, kind, generation)

    def _read(self, owner: Type, field: Field, number: int, since: int) -> Any:
        (content,), generation = self._content([number], since)
        for column in content.columns:
            if column.type is owner and column.field is field and number in column.ids:
                return self._value(field, column.values[column.ids.tolist().index(number)], generation)
        return _values.default(field)

    def _read_all(self, owner: Type, number: int, since: int) -> dict[str, Any]:
        values = {field.name: 0 if field.kind == BLOB else _values.default(field) for field in owner.fields.values()}
        (content,), generation = self._content([number], since)
        for column in content.columns:
            if column.type is owner and number in column.ids:
                value = column.values[column.ids.tolist().index(number)]
                values[column.field.name] = (int(value["bytes"]) if column.field.kind == BLOB
                                             else self._value(column.field, value, generation))
        return values

    def _read_many(self, owner: Type, field: Field, ids: Array, since: int) -> Array:
        if field.kind in (BLOB, REFS):
            raise Unsupported(f"{field.where} is read object by object")
        told: dict[int, Any] = {}
        for content in self._content(ids.tolist(), since)[0]:
            for column in content.columns:
                if column.type is owner and column.field is field:
                    told.update(zip(column.ids.tolist(), column.values))
        fresh = _values.default(field)
        return np.array([_values.to_python(field, told[number]) if number in told else fresh
                         for number in ids.tolist()])
