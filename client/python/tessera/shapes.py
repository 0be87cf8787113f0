"""Whatever has vertices and faces, or points, as a Geometry: told by what it has, so that none of the libraries is
required."""
from __future__ import annotations

import dataclasses
import inspect
import threading
from typing import TYPE_CHECKING, Any, Mapping, Optional

import numpy as np

from ._types import Array, as_array, finite
from . import colours
from ._schema import nearest
from .errors import BadInput, NotFound, Refused, UnknownField
from .objects import Node, Object

if TYPE_CHECKING:
    from ._edit import Edit
    from ._wall import Wall


@dataclasses.dataclass
class Shape:
    """Arrays as a Geometry has them."""

    positions: Array  # N × 3 (float32)
    primitive: str = "triangles"
    indices: Optional[Array] = None  # uint32
    lengths: Optional[Array] = None  # uint32, of polygons and strips
    colours: Optional[Array] = None  # N × 4 (uint8)
    normals: Optional[Array] = None  # N × 3 (float32)


def _places(value: Any, where: str) -> Array:
    given = as_array(value, where)
    if given.ndim != 2 or given.shape[1] != 3 or given.dtype.kind not in "fiu":
        raise BadInput(f"{where}: an array of shape {given.shape} and type {given.dtype}; places are N × 3 numbers")
    return finite(given, np.float32, where)


def _corners(value: Any, vertices: int, where: str) -> Array:
    """Numbers of vertices, of any shape."""
    given = as_array(value, where)
    if given.size and given.dtype.kind not in "iu":
        raise BadInput(f"{where}: faces of {given.dtype}; they are whole numbers")
    if given.size and (int(given.min()) < 0 or int(given.max()) >= vertices):
        raise BadInput(f"{where}: a face names vertex {int(given.max() if given.min() >= 0 else given.min())}, and "
                       f"there are {vertices}")
    return np.ascontiguousarray(given, np.uint32)


def _of_rows(shape: Shape, faces: Array, where: str) -> Shape:
    if faces.ndim != 2 or faces.shape[1] < 3:
        raise BadInput(f"{where}: faces of shape {faces.shape}; wanted is M × 3, or more corners each")
    if faces.shape[1] == 3:
        shape.indices = faces
    else:
        shape.primitive, shape.indices = "polygons", faces
        shape.lengths = np.full(len(faces), faces.shape[1], np.uint32)
    return shape


def _of_packed(shape: Shape, packed: Array, primitive: str, where: str) -> Shape:
    """VTK's way: of each face how many corners it has, and these, one behind the other."""
    flat = as_array(packed, where).reshape(-1)
    sizes, starts, at = [], [], 0
    if len(flat) and flat[0] > 0 and len(flat) % (flat[0] + 1) == 0 and (flat[::flat[0] + 1] == flat[0]).all():
        rows = flat.reshape(-1, flat[0] + 1)[:, 1:]
        if primitive == "polygons":
            return _of_rows(shape, _corners(rows, len(shape.positions), where), where)
        corners, sizes = rows.reshape(-1), [rows.shape[1]] * len(rows)
    else:
        while at < len(flat):
            size = int(flat[at])
            if size < 1 or at + 1 + size > len(flat):
                raise BadInput(f"{where}: its packed faces end in the middle of one")
            sizes.append(size)
            starts.append(at)
            at += size + 1
        corners = np.delete(flat, starts)
    shape.primitive, shape.indices = primitive, _corners(corners, len(shape.positions), where)
    shape.lengths = np.array(sizes, np.uint32)
    return shape


def _filled(owner: Any, *names: str) -> Any:
    """The first of these that is there and not empty."""
    for name in names:
        value = getattr(owner, name, None)
        if value is not None and not callable(value) and as_array(value, name).size:
            return value
    return None


def shape_of(x: Any) -> Shape:
    """trimesh (`vertices`, `faces`, `visual`), pyvista (`points`, `faces`, `lines`), open3d (`vertices`, `triangles`;
    `points`), a pair (vertices, faces), or an array of N × 3 points. BadInput: it is none of these, or makes no
    sense."""
    where = type(x).__name__
    if isinstance(x, Shape):
        return x
    if isinstance(x, (tuple, list)) and len(x) == 2 and as_array(x[0], "vertices").ndim == 2:
        shape = Shape(_places(x[0], "vertices"))
        return _of_rows(shape, _corners(x[1], len(shape.positions), "faces"), "faces")
    places = _filled(x, "vertices", "points")
    if places is None:
        if isinstance(x, (np.ndarray, list, tuple)):
            return Shape(_places(x, "points"), "points")
        raise BadInput(f"a {where} has neither vertices and faces nor points that are not empty; wanted is a mesh of "
                       f"trimesh, pyvista or open3d, "
                       "a pair (vertices, faces), or an array of N × 3 points")
    shape = Shape(_places(places, where))
    rows = len(shape.positions)
    faces = _filled(x, "triangles", "faces")
    if faces is not None:
        flat = as_array(faces, where)
        if flat.ndim == 1:
            shape = _of_packed(shape, flat, "polygons", where)
        else:
            shape = _of_rows(shape, _corners(flat, rows, where), where)
    elif (lines := _filled(x, "lines")) is not None:
        flat = as_array(lines, where)
        if flat.ndim == 1:
            shape = _of_packed(shape, flat, "line-strips", where)
        else:
            shape.primitive, shape.indices = "lines", _corners(flat, rows, where)
    else:
        shape.primitive = "points"
    visual = getattr(x, "visual", None)
    kind = getattr(visual, "kind", None)
    own = _filled(x, "vertex_colors", "colors")
    if own is None and visual is not None and kind in (None, "vertex"):
        own = _filled(visual, "vertex_colors")
    if own is not None and len(as_array(own, where)) == rows:
        shape.colours = colours.of_any(own, rows, where)
    elif (visual is not None and kind == "face" and shape.primitive == "triangles" and shape.indices is not None
          and _filled(visual, "face_colors") is not None):
        painted = colours.of_any(visual.face_colors, len(shape.indices), where)  # each face gets corners of its own
        shape.positions, shape.indices = np.ascontiguousarray(shape.positions[shape.indices.reshape(-1)]), None
        shape.colours = np.repeat(painted, 3, axis=0)
    normals = x.__dict__.get("vertex_normals") if hasattr(x, "__dict__") else None
    if normals is not None and as_array(normals, where).shape == shape.positions.shape:
        shape.normals = _places(normals, where)
    return shape


Parts = tuple[Node, Node, Object, Optional[Object]]  # of what is shown: its node, the one below it, geometry, material


class Shown:
    """What `wall.show` has put on the wall, by its path: numbers, as handles would hold the wall."""

    def __init__(self) -> None:
        self._count = 0
        self._alone = threading.Lock()
        # The generation of the link; node, its core, the node below, geometry, material
        self._known: dict[str, tuple[int, int, int, int, int, int]] = {}

    def show(self, wall: "Wall", x: Any, path: Optional[str] = None, *, scalars: Any = None, cmap: str = "viridis",
             clim: Optional[tuple[float, float]] = None, colors: Any = None, color: Any = None,
             radius: Optional[float] = None,
             line: bool = False, line_width: Optional[float] = None, at: Any = None, rotation: Any = None,
             scale: Any = None,
             unlit: Optional[bool] = None, undo: Optional[str] = None, **unknown: Any) -> "Node":
        """`scalars`: a number for each vertex, coloured by `cmap` ("viridis", "grey", "blue-red") from `clim[0]` to
        `clim[1]`. `colors`: a colour for each; `color`: one for all. `radius`: of points, world units. `line`: points
        are corners of one line, `line_width` pixels wide. `at`, `rotation`, `scale`: where it stands. Returns its node,
        a Transform: move it as you like; shown again, it stays there. Threads may show at one path; of several programs
        that do so for the first time each makes a node of its own."""
        for name in unknown:
            known_looks = [each.name for each in inspect.signature(self.show).parameters.values()
                           if each.kind == each.KEYWORD_ONLY]
            raise UnknownField(f"show has no look \"{name}\"{nearest(name, known_looks)}; there is "
                               f"{', '.join(known_looks)}")
        shape = shape_of(x)
        if line:
            shape.primitive = "line-strips"
        rows = len(shape.positions)
        if scalars is not None:
            given = as_array(scalars, "scalars")
            if given.size != rows:
                raise BadInput(f"scalars: {given.size} numbers for {rows} vertices")
            shape.colours = colours.of_scalars(scalars, cmap, clim)
        if colors is not None:
            shape.colours = colours.of_any(colors, rows, "colors")
        fields: dict[str, Any] = {"positions": shape.positions, "indices": shape.indices, "lengths": shape.lengths,
                                  "colors": shape.colours,
                                  "normals": shape.normals, "primitive": shape.primitive}
        if radius is not None:
            fields["pointRadius"] = radius
        if line_width is not None:
            fields["lineWidth"] = line_width
        pose = {name: value for name, value in (("translation", at), ("rotation", rotation), ("scale", scale))
                if value is not None}
        look: dict[str, Any] = {}
        if color is not None:
            look["baseColor"] = colours.linear(color)
        if unlit is not None:
            look["unlit"] = unlit
        if path is None:
            path = self._free_path(wall, type(x).__name__)
        elif not isinstance(path, str) or not all(path.split("/")[1:]) or not path.startswith("/"):
            raise BadInput(f"{path!r} is no path to show anything at; say one like \"/cloud\"")
        doubled = shape.primitive not in ("points", "lines")
        current = wall._current()
        if current:
            return self._put(current, path, self._find(wall, current, path), fields, pose, look, doubled)
        with self._alone:  # of two threads that show at one path the second finds what the first has made
            return self._show_at(wall, path, undo, fields, pose, look, doubled)

    def _show_at(self, wall: "Wall", path: str, undo: Optional[str], fields: Mapping[str, Any], pose: Mapping[str, Any],
                 look: Mapping[str, Any],
                 doubled: bool) -> "Node":
        remembered = self._remembered(wall, path) if not look else None  # whose material it has now is asked
        if remembered is not None:
            try:
                return self._put_alone(wall.edit(undo), path, remembered, fields, pose, look, doubled)
            except (NotFound, Refused):
                self._known.pop(path, None)  # perhaps somebody has removed it since
        edit = wall.edit(undo)
        return self._put_alone(edit, path, self._find(wall, edit, path), fields, pose, look, doubled)

    def _put_alone(self, edit: "Edit", path: str, *what: Any) -> "Node":
        node = self._put(edit, path, *what)
        told = edit.commit()
        if told is not None:
            _, inner, geometry, material = edit._shown[path]
            self._known[path] = (told._generation, node._id, node._core, inner._id, geometry._id,
                                 material._id if material else 0)
        return node

    def _put(self, edit: "Edit", path: str, found: Optional[Parts], fields: Mapping[str, Any], pose: Mapping[str, Any],
             look: Mapping[str, Any],
             doubled: bool) -> "Node":
        with edit._all_or_nothing():
            if found:
                node, inner, geometry, material = found
                edit.set(inner, core=geometry)  # refused where it is not there any more
                edit.set(geometry, **fields)
                edit.set(node, **pose)
                if material:
                    edit.set(material, **look)
                elif look:
                    material = edit.object("Material", **look)
                    edit.set(geometry, material=material)
            else:
                fresh: dict[str, Any] = {"doubleSided": doubled}
                if fields["colors"] is not None:
                    fresh["baseColor"] = (1.0, 1.0, 1.0, 1.0)
                material = edit.object("Material", **{**fresh, **look})
                there = self._bare(edit, path)
                if there is not None:
                    edit.set(there, **pose)
                node = there or edit.create(path, "Transform", **pose)
                given = {name: value for name, value in fields.items() if value is not None}
                inner = edit.create(f"{path}/shape", "Geometry", material=material, **given)
                geometry = edit._made[inner._core]
        edit._shown[path] = (node, inner, geometry, material)
        return node

    @staticmethod
    def _bare(edit: "Edit", path: str) -> Optional[Node]:
        """What has been shown there, without what was below it."""
        try:
            node = edit._wall._node(path)
        except NotFound:
            return None
        return node if node.core is not None and node.core.type == "Transform" else None

    def _free_path(self, wall: "Wall", name: str) -> str:
        while True:
            self._count += 1
            path = f"/{name.lower()}-{self._count}"
            if path not in wall:
                return path

    def _remembered(self, wall: "Wall", path: str) -> Optional[Parts]:
        generation, node, core, inner, geometry, material = self._known.get(path, (None, 0, 0, 0, 0, 0))
        if generation is None or generation != wall._link.generation:
            return None
        types = wall.schema.type
        return (Node(wall, node, types("Node"), generation, path, core, types("Transform")),
                Node(wall, inner, types("Node"), generation, f"{path}/shape", geometry, types("Geometry")),
                Object(wall, geometry, types("Geometry"), generation),
                Object(wall, material, types("Material"), generation) if material else None)

    @staticmethod
    def _find(wall: "Wall", edit: "Edit", path: str) -> Optional[Parts]:
        if path in edit._shown:
            return edit._shown[path]
        try:
            inner = wall._node(f"{path}/shape")
        except NotFound:
            return None
        node, geometry = wall._node(path), inner.core
        if geometry is None or geometry.type != "Geometry" or node.core is None or node.core.type != "Transform":
            raise BadInput(f"{path} holds something that show has not made; say another path")
        return node, inner, geometry, geometry.material
