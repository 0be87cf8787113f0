"""Edits: what is collected and then granted or refused as one."""
from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, Callable, Iterator, Mapping, Optional, Union

import numpy as np

from ._types import Array, whole
from . import _changes, _values, _wire
from ._described import Told
from ._schema import REF, REFS, BLOB, TEXT, Field, Type
from .errors import BadInput, LimitExceeded, NotFound, Refused
from .objects import Node, Nodes, Object

if TYPE_CHECKING:
    from ._wall import Wall


def _index(said: Any) -> int:
    """Of a child among its siblings."""
    return whole(said, _changes.LAST, "index is the place among the children")


def _restore(known: dict[Any, Any], before: Mapping[Any, Any]) -> None:
    for key, value in before.items():
        if value is None:
            known.pop(key, None)
        else:
            known[key] = value


class _Column:
    """New values of one field: whole arrays, and single ones, of which the last of an object counts."""

    def __init__(self) -> None:
        self.arrays: list[tuple[Array, Any]] = []
        self.single: dict[int, Any] = {}

    def rows(self, field: Field) -> tuple[Array, _wire.Part]:
        if not self.single and len(self.arrays) == 1 and isinstance(self.arrays[0][1], np.ndarray):
            ids, values = self.arrays[0]
            if len(ids) < 2 or bool((ids[1:] > ids[:-1]).all()) or len(np.unique(ids)) == len(ids):
                return ids, _wire.view_of(values)
        last: dict[int, Any] = {}
        for ids, values in self.arrays:
            last.update(zip(ids.tolist(), values))
        last.update(self.single)
        return np.array(list(last), "<u8"), _values.column(field, list(last.values()))


class Edit:
    """A batch. Get one from `wall.edit()`; what the same thread assigns within its `with` goes in, and all of it is
    granted or refused at the end. Belongs to one thread."""

    def __init__(self, wall: "Wall", undo: Optional[str]) -> None:
        self._wall = wall
        self._gesture = wall._gesture(undo)
        self._arrays = _values.Arrays(wall.schema.limits["array_leaf_bytes"])
        self._creations: list[tuple[int, int]] = []
        self._placements: list[tuple[int, int, int]] = []
        self._columns: dict[tuple[int, int], tuple[Type, Field, _Column]] = {}
        self._ranges: list[tuple[Any, ...]] = []
        self._range_bytes = _wire.Chain()
        self._made: dict[int, Object] = {}
        self._paths: dict[str, Node] = {}
        self._parents: dict[str, Node] = {}  # that were there before
        self._shown: dict[str, tuple[Node, Node, Object, Optional[Object]]] = {}  # by Wall.show
        self._since: Optional[int] = None  # the generation of the oldest handle in it
        self._back: Optional[list[Callable[[], Any]]] = None  # steps that take back what is under way
        self.committed: Optional[Told] = None  #: what the server answered: sequence, ids, stopped

    def __enter__(self) -> "Edit":
        self._wall._enter(self)
        return self

    def __exit__(self, kind: Any, value: Any, trace: Any) -> None:
        self._wall._leave(self)
        if kind is None:
            self.commit()

    @property
    def empty(self) -> bool:
        return not (self._creations or self._placements or self._columns or self._ranges)

    # ---- what goes in

    def set(self, target: Union[Object, Nodes], field: Optional[str] = None, value: Any = None, **fields: Any) -> None:
        """`set(node, translation=(1, 2, 3))`, or of many `set(nodes, "translation", array)`: a row for each."""
        given = dict(fields)
        if field is not None:
            if not isinstance(field, str):
                raise BadInput(f"{field!r} is no name of a field")
            given[field] = value
        if not isinstance(target, (Object, Nodes)):
            raise BadInput(f"{target!r} is neither an object nor nodes; wall[\"/path\"] is one")
        with self._all_or_nothing():
            for name, each in given.items():
                target._put(self, name, each)

    def create(self, path: str, type: Optional[str] = "Transform", index: int = _changes.LAST, **fields: Any) -> Node:
        """A new node at a path, whose last part is its name, with a new core of that type (None: with none) and these
        fields."""
        parent_path, slash, name = path.rstrip("/").rpartition("/") if isinstance(path, str) else ("", "", "")
        if not slash or not name:
            raise BadInput(f"{path!r} is no path of a new node; write \"/hall/crane\"")
        parent = self._paths.get(parent_path) or self._parents.get(parent_path)
        if parent is None:  # asked for once: each answer takes its way
            parent = self._parents[parent_path] = self._wall._node(parent_path or "/")
        if type is None and fields:
            raise BadInput(f"a node without a core has no field \"{next(iter(fields))}\"")
        if type is not None and not self._wall.schema.type(type).is_core:
            raise BadInput(f"a {type} cannot be the core of a node; make it with wall.object and refer to it")
        with self._all_or_nothing():
            self._names(parent)
            core = self.object(type, **fields) if type is not None else None
            return self._new_node(parent, name, path, core, index)

    def _new_node(self, parent: Node, name: str, path: str, core: Optional[Object], index: int = _changes.LAST) -> Node:
        kind = self._wall.schema.type("Node")
        node = Node(self._wall, self._placeholder(kind), kind, self._wall._link.generation, path,
                    core._id if core else 0, core._type if core else None)
        self._made[node._id] = node
        before = self._paths.get(path)
        self._paths[path] = node
        self._or_back(lambda: self._made.pop(node._id))
        self._or_back(lambda: _restore(self._paths, {path: before}))
        self._put(kind, kind.field("name"), node._id, name)
        if core is not None:
            self._put(kind, kind.field("core"), node._id, core)
        self._placements.append((node._id, parent._id, _index(index)))
        self._or_back(self._placements.pop)
        return node

    def add(self, under: Node, name: str, core: Optional[Object] = None, index: int = _changes.LAST) -> Node:
        """A new node below one that is there or new, with a core of its own or of others. Its name may be any text;
        nothing is asked."""
        if not isinstance(under, Node):
            raise BadInput(f"under: {under!r} is no node")
        if core is not None and (not isinstance(core, Object) or not core._type.is_core):
            raise BadInput(f"core: {core!r} cannot be the core of a node")
        with self._all_or_nothing():
            self._names(under)
            if core is not None:
                self._names(core)
            return self._new_node(under, name, f"{under.path.rstrip('/')}/{name}", core, index)

    def object(self, type: str, **fields: Any) -> Object:
        """A new object that something else refers to: a material, an image, key frames."""
        kind = self._wall.schema.type(type)
        for name in fields:
            kind.field(name)
        with self._all_or_nothing():
            made = Object(self._wall, self._placeholder(kind), kind, self._wall._link.generation)
            self._made[made._id] = made
            self._or_back(lambda: self._made.pop(made._id))
            for name, value in fields.items():
                self._put(kind, kind.field(name), made._id, value)
            return made

    def place(self, node: Node, under: Node, index: int = _changes.LAST) -> None:
        """Hangs a node below another; `index` among its children."""
        for each in (node, under):
            if not isinstance(each, Node):
                raise BadInput(f"{each!r} is no node")
        self._names(node, under)
        self._placements.append((node._number(), under._number(), _index(index)))

    def write(self, target: Object, field: str, first: int, values: Any) -> None:
        """New elements of a large array, from element `first` on: only these travel. The array keeps its size."""
        if not isinstance(target, Object):
            raise BadInput(f"{target!r} is no object; wall[\"/path\"] is one")
        self._names(target)
        owner, number = target._owner(field)
        info = owner.field(field)
        if info.kind != BLOB:
            raise BadInput(f"{info.where} is no array")
        begin = whole(first, 2 ** 53 - 1, f"{info.where}: first is the number of an element")
        data = _values.array(info, values)
        each = (info.each * info.element.itemsize if info.each
                else data.dtype.itemsize * (data.shape[-1] if data.ndim > 1 else 1))
        self._ranges.append((number, begin * each, data.nbytes, owner.number, info.number, 0, 0, 0, 0))
        self._range_bytes.append(_wire.view_of(data))

    # ---- inside

    @contextlib.contextmanager
    def _all_or_nothing(self) -> Iterator[None]:
        """What is refused within leaves nothing of itself in the edit: whoever catches the error goes on with what was
        there."""
        if self._back is not None:
            yield
            return
        self._back, arrays = [], len(self._arrays.by_name)
        try:
            yield
        except BaseException:
            for step in reversed(self._back):
                step()
            while len(self._arrays.by_name) > arrays:
                self._arrays.by_name.popitem()
            raise
        finally:
            self._back = None

    def _or_back(self, step: Callable[[], Any]) -> None:
        """How what has just been done is taken back."""
        if self._back is not None:
            self._back.append(step)

    def _names(self, *handles: Union[Object, Nodes]) -> None:
        """Their numbers go out with this edit."""
        for handle in handles:
            handle._on(self._wall)
            if isinstance(handle, Nodes) or not handle._is_new:
                self._since = handle._generation if self._since is None else min(self._since, handle._generation)

    def _placeholder(self, kind: Type) -> int:
        number = _changes.FIRST_PLACEHOLDER + len(self._creations)
        self._creations.append((number, kind.number))
        self._or_back(self._creations.pop)
        return number

    def _resolve(self, value: Any, field: Field) -> int:
        if isinstance(value, str) and value in self._paths:
            value = self._paths[value]
        elif isinstance(value, str):
            try:
                value = self._wall._node(value)
            except (BadInput, NotFound) as error:
                raise type(error)(f"{field.where}: {error}") from None
        if isinstance(value, Object):
            self._names(value)
        return self._wall._reference(value, field)

    def _column(self, kind: Type, field: Field) -> _Column:
        key = (kind.number, field.number)
        if key not in self._columns:
            self._columns[key] = (kind, field, _Column())
            self._or_back(lambda: self._columns.pop(key))
        return self._columns[key][2]

    def _put(self, kind: Type, field: Field, number: int, value: Any) -> None:
        row = _values.row(field, value, self._resolve, self._arrays)
        single = self._column(kind, field).single
        before = single.get(number)
        single[number] = row
        self._or_back(lambda: _restore(single, {number: before}))

    def _put_many(self, kind: Type, field: Field, ids: Array, values: Any) -> None:
        rows = _values.many(field, values, len(ids), self._resolve, self._arrays)
        column = self._column(kind, field)
        if column.single:  # a later word counts
            before = {number: column.single.get(number) for number in ids.tolist()}
            column.single.update(zip(ids.tolist(), rows))
            self._or_back(lambda: _restore(column.single, before))
        else:
            column.arrays.append((ids, rows))
            self._or_back(column.arrays.pop)

    def commit(self, timeout: Optional[float] = None) -> Optional[Told]:
        """Sends it, and returns when it is granted. Raises Refused and others: nothing has changed then."""
        if self.committed is not None:
            raise Refused("this edit has been sent already")
        if self.empty:
            return None
        columns = [(kind, field, *column.rows(field)) for kind, field, column in self._columns.values()]
        changes = _changes.encode(self._creations, self._placements, columns, np.array(self._ranges, _changes.RANGE),
                                  self._range_bytes, ())
        most = self._wall.schema.limits["proposal_bytes"]
        if changes.size > most:
            raise LimitExceeded(f"the edit has {changes.size} bytes beside its arrays, and {most} is the most; make "
                                f"it in parts")
        self.committed = self._wall._propose(changes, self._arrays.by_name, self._gesture, timeout, self._since)
        for placeholder, number in self.committed.ids.tolist():
            made = self._made.get(placeholder)
            if made is not None:
                made._given(number, self.committed._generation)
        for made in self._made.values():
            made._settle(self._made)
        return self.committed
