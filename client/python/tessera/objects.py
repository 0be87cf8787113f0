"""What a scene holds, as handles: nodes, what stands beside them, and many nodes at once. A handle keeps what it found
when it was asked for; fields are asked for each time."""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Iterator, Optional, Sequence, TypeVar, Union

import numpy as np

from ._types import Array
from ._changes import FIRST_PLACEHOLDER
from ._described import Told
from ._schema import BLOB, REF, REFS, Field, Type, nearest
from .errors import BadInput, NotFound, Refused, UnknownField

if TYPE_CHECKING:
    from ._edit import Edit
    from ._wall import Wall


def _set(target: "Union[Object, Nodes]", fields: dict[str, Any]) -> Optional[Told]:
    """At once, or in this thread's open edit, which is sent later: then None."""
    current = target._wall._current()
    edit = current or target._wall.edit()
    edit.set(target, **fields)
    return None if current else edit.commit()


H = TypeVar("H", bound="_Handle")


class _Handle:
    """What it stands for is on the wall: a copy is the same, and elsewhere it means nothing."""

    __slots__ = ()

    def __copy__(self: H) -> H:
        return self

    def __deepcopy__(self: H, memo: Any) -> H:
        return self

    def _on(self, wall: "Wall") -> None:
        """Numbers of one wall mean other things on another one."""
        if object.__getattribute__(self, "_wall") is not wall:
            raise BadInput(f"{self!r} is of another wall, or of another connection to it; look it up on this one")

    def __reduce__(self) -> str:
        raise TypeError(f"{self!r} belongs to its connection; keep its path or number")


class Object(_Handle):
    """Anything with a number: a core, a material, an image. Its fields are attributes: read, they are asked for at the
    server; assigned, they are granted when the assignment returns."""

    __slots__ = ("_wall", "_id", "_type", "_generation")
    _wall: "Wall"
    _id: int
    _type: Type
    _generation: int  # of the link that told its number

    def __init__(self, wall: "Wall", number: int, kind: Type, generation: int) -> None:
        for name, value in (("_wall", wall), ("_id", number), ("_type", kind), ("_generation", generation)):
            object.__setattr__(self, name, value)

    @property
    def id(self) -> int:
        """Its number in the scene."""
        return self._id

    @property
    def type(self) -> str:
        return self._type.name

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Object) and other._id == self._id and other._wall is self._wall

    def __hash__(self) -> int:
        return hash(self._id)

    def __repr__(self) -> str:
        return f"<{self._type.name} #{self._id}>"

    def __dir__(self) -> list[str]:
        return [*object.__dir__(self), *self._type.fields]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        owner, number = self._owner(name)
        return self._wall._read(owner, owner.field(name), number, self._generation)

    def __setattr__(self, name: str, value: Any) -> None:
        if name.startswith("_") or isinstance(getattr(type(self), name, None), property):
            object.__setattr__(self, name, value)
        else:
            self.set(**{name: value})

    def set(self, **fields: Any) -> Optional[Told]:
        """Several fields at once. What the server answers (`sequence`, `stopped`), or None within an edit, which is
        sent later."""
        return _set(self, fields)

    def fields(self) -> dict[str, Any]:
        """All of them with their values now. Arrays are not fetched: of these their sizes in bytes."""
        return self._wall._read_all(self._type, self._number(), self._generation)

    def write(self, field: str, first: int, values: Any) -> None:
        """New elements of a large array, from element `first` on (Edit.write)."""
        current = self._wall._current()
        edit = current or self._wall.edit()
        edit.write(self, field, first, values)
        if not current:
            edit.commit()

    def _owner(self, name: str) -> tuple[Type, int]:
        self._type.field(name)
        return self._type, self._number()

    def _number(self) -> int:
        """Its number, if it still means the same: a server without a journal begins anew. Looked at again when it is
        sent."""
        if not self._is_new and self._generation != self._wall._link.settled() and not self._wall.keeps_numbers:
            raise NotFound(f"{self!r} was found before the connection broke; look it up again")
        return self._id

    def _put(self, edit: "Edit", name: str, value: Any) -> None:
        owner, number = self._owner(name)
        edit._names(self)
        edit._put(owner, owner.field(name), number, value)

    @property
    def _is_new(self) -> bool:
        """Made in an edit that has not been sent: the server has not given it a number yet."""
        return self._id >= FIRST_PLACEHOLDER

    def _given(self, number: int, generation: int) -> None:
        object.__setattr__(self, "_id", number)
        object.__setattr__(self, "_generation", generation)

    def _settle(self, made: dict[int, "Object"]) -> None:
        pass


class Node(Object):
    """A place in the tree: its own fields, and those of its core."""

    __slots__ = ("_path", "_core", "_core_type")
    _path: str
    _core: int
    _core_type: Optional[Type]

    def __init__(self, wall: "Wall", number: int, kind: Type, generation: int, path: str, core: int,
                 core_type: Optional[Type]) -> None:
        super().__init__(wall, number, kind, generation)
        for name, value in (("_path", path), ("_core", core), ("_core_type", core_type)):
            object.__setattr__(self, name, value)

    @property
    def path(self) -> str:
        """As it was when this handle was made."""
        return self._path

    @property
    def core(self) -> Optional[Object]:
        """What stands at the node; several nodes may share it."""
        return Object(self._wall, self._core, self._core_type, self._generation) if self._core_type else None

    @core.setter
    def core(self, value: Optional[Object]) -> None:
        if value is not None and not isinstance(value, Object):
            raise BadInput(f"Node.core: {value!r} is no object; wall[\"/path\"].core is one")
        core = value.core if isinstance(value, Node) else value
        if core is None and value is not None:
            raise BadInput(f"Node.core: {value!r} has no core")
        self.set(core=core)
        object.__setattr__(self, "_core", core._id if core else 0)
        object.__setattr__(self, "_core_type", core._type if core else None)

    def __repr__(self) -> str:
        return f"<Node {self._path} #{self._id} ({self._core_type.name if self._core_type else 'no core'})>"

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(self._core_type.fields if self._core_type else ())]

    def __truediv__(self, name: str) -> "Node":
        """The child of that name."""
        return self._wall[f"{self._path.rstrip('/')}/{name}"]

    @property
    def children(self) -> list["Node"]:
        return self._wall._children(self._number(), self._generation)

    @property
    def parent(self) -> Optional["Node"]:
        (found,), generation = self._wall._describe([f"#{self._number()}"], self._generation)
        return self._wall._node(f"#{found.parent}", generation) if found.parent else None

    def fields(self) -> dict[str, Any]:
        found = super().fields()
        if self._core_type:
            of_core = self._wall._read_all(self._core_type, self._core, self._generation)
            found.update({name: value for name, value in of_core.items() if name not in found})
        return found

    def create(self, name: str, type: Optional[str] = "Transform", **fields: Any) -> "Node":
        """A new node below this one."""
        return self._wall.create(f"{self._path.rstrip('/')}/{name}", type, **fields)

    def remove(self) -> Told:
        """With everything below it, and what only they used."""
        return self._wall._edits("RemoveNode", self._generation, node=self._number())

    def clone(self, name: str = "", under: Optional["Node"] = None, deep: bool = False) -> "Node":
        """Once more with everything below it. `deep`: cores are copied, too, and not shared."""
        if under is not None and not isinstance(under, Node):
            raise BadInput(f"under: {under!r} is no node")
        since = min(self._generation, under._generation) if under else self._generation
        copied = self._wall._edits("CloneNode", since, node=self._number(), under=under._number() if under else 0,
                                   name=name, deep=deep)
        return self._wall._node(f"#{int(copied.ids['id'][0])}", copied._generation)

    def move(self, translation: Any = None, rotation: Any = None, scale: Any = None, by: bool = False,
             undo: Optional[str] = None) -> Told:
        """To a place, or with `by` by so much from where it is in the frame that makes the edit: of several who push
        it, all count. Moves the nearest Transform from here upwards. `stopped` of what comes back: kept there by a
        collision."""
        wish = {name: value for name, value in (("translation", translation), ("rotation", rotation), ("scale", scale))
                if value is not None}
        return self._wall._edits("MoveNode", self._generation, node=self._number(), relative=by,
                                 gesture=self._wall._gesture(undo), **wish)

    def play(self) -> None:
        """Of whatever plays: an Animation, a Motion, a Movie, a stream of particles."""
        self.set(playing=True)

    def pause(self) -> None:
        self.set(playing=False)

    def seek(self, seconds: float) -> None:
        self.set(time=seconds)

    def _owner(self, name: str) -> tuple[Type, int]:
        if not isinstance(name, str):
            raise UnknownField(f"{name!r} is no name of a field")
        if name in self._type.fields:
            return self._type, self._number()
        if self._core_type is None:
            raise UnknownField(f"{self._path} has no core, and a Node no field "
                               f"\"{name}\"{nearest(name, self._type.fields)}")
        if name not in self._core_type.fields:
            known = [*self._core_type.fields, *self._type.fields]
            raise UnknownField(f"{self._path} is a {self._core_type.name}, which has no field "
                               f"\"{name}\"{nearest(name, known)}")
        self._number()
        return self._core_type, self._core

    def _settle(self, made: dict[int, Object]) -> None:
        core = made.get(self._core)
        if core is not None:
            object.__setattr__(self, "_core", core._id)


class Nodes(_Handle):
    """Many nodes with cores of one type. Fields are attributes with a row for each node: `nodes.translation = array` (N
    × 3) is one edit, and costs no work for each of them here; a plural (`nodes.translations`) means the same."""

    __slots__ = ("_wall", "ids", "cores", "_type", "_generation")
    _wall: "Wall"
    _type: Optional[Type]
    _generation: int
    ids: Array
    cores: Array

    def __init__(self, wall: "Wall", ids: Any, cores: Any, kind: Optional[Type], generation: int) -> None:
        numbers, of_cores = np.array(ids, "<u8"), np.array(cores, "<u8")
        for given in (numbers, of_cores):
            given.setflags(write=False)
        for name, value in (("_wall", wall), ("ids", numbers), ("cores", of_cores), ("_type", kind),
                            ("_generation", generation)):
            object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self.ids)

    def __iter__(self) -> Iterator[Node]:
        return iter(self._wall._nodes([f"#{number}" for number in self.ids.tolist()], self._generation))

    def __repr__(self) -> str:
        return f"<{len(self)} nodes ({self._type.name if self._type else 'no core'})>"

    def __getattr__(self, name: str) -> Array:
        if name.startswith("_"):
            raise AttributeError(name)
        owner, field, ids = self._found(name)
        found: Array = self._wall._read_many(owner, field, ids, self._generation)
        return found

    def __setattr__(self, name: str, value: Any) -> None:
        self.set(**{name: value})

    def set(self, **fields: Any) -> Optional[Told]:
        """Several fields at once, an array of rows each."""
        return _set(self, fields)

    def _found(self, name: str) -> tuple[Type, Field, Array]:
        if self._generation != self._wall._link.settled() and not self._wall.keeps_numbers:
            raise NotFound("these nodes were found before the connection broke; look them up again")
        kind = self._wall.schema.type("Node")
        for word in (name, name[:-1] if name.endswith("s") else name):
            if word in kind.fields:
                return kind, kind.field(word), self.ids
            if self._type is not None and word in self._type.fields:
                return self._type, self._type.field(word), self.cores
        owner = self._type or kind
        raise UnknownField(f"a {owner.name} has no field \"{name}\"{nearest(name, owner.fields)}")

    def _put(self, edit: "Edit", name: str, value: Any) -> None:
        owner, field, ids = self._found(name)
        edit._names(self)
        edit._put_many(owner, field, ids, value)


def many(wall: "Wall", found: Sequence[Node]) -> Nodes:
    kinds = {node._core_type for node in found}
    if len(kinds) > 1:
        names = ", ".join(sorted(kind.name if kind else "no core" for kind in kinds))
        raise BadInput(f"these nodes have cores of several types ({names}); take those of one")
    since = min((node._generation for node in found), default=wall._link.generation)
    return Nodes(wall, [node._id for node in found], [node._core for node in found], kinds.pop() if kinds else None,
                 since)
