"""Meshes: out of Blender as fast as they can be copied, and, beside Blender's thread, into what a Geometry holds."""
import ctypes

import numpy as np

KINDS = {"MESH", "CURVE", "SURFACE", "FONT", "META"}  # Blender makes triangles of all of these
_LOOKED_AT = 8  # places at which an array in Blender's memory is compared with what Blender says


class RawMesh:
    """Arrays as Blender has them."""

    __slots__ = ("positions", "corners", "triangles", "polygons", "materials", "texcoords", "vertex_normals",
                 "polygon_normals", "smooth",
                 "corner_normals")


def _attribute(items, name, count, width, dtype):
    found = np.empty(count * width, dtype)
    items.foreach_get(name, found)
    return found.reshape(count, width) if width > 1 else found


def _column(items, name, count, width, dtype, offset=0):
    """The values of one attribute of all items. Where they lie in memory as expected they are copied from there:
    Blender itself takes 45 ns for each, which is half a second for a million triangles."""
    if count > 1024:
        first = items[0].as_pointer()
        step = items[1].as_pointer() - first
        if step >= offset + width * np.dtype(dtype).itemsize and items[count - 1].as_pointer() == first + (
            count - 1) * step:
            memory = (ctypes.c_char * (step * count)).from_address(first)
            strides = (step, np.dtype(dtype).itemsize)
            found = np.ndarray((count, width), dtype, memory, offset, strides).copy()
            looked_at = np.linspace(0, count - 1, _LOOKED_AT).astype(int).tolist()
            said = [getattr(items[at], name) for at in looked_at]
            if np.array_equal(np.array(said, dtype).reshape(-1, width), found[looked_at],
                              equal_nan=np.dtype(dtype).kind == "f"):
                return found if width > 1 else found[:, 0]
    return _attribute(items, name, count, width, dtype)


def read(thing, depsgraph):
    """The mesh of an object as it is drawn, with its modifiers. None: it has no surface."""
    evaluated = thing.evaluated_get(depsgraph)
    apart = thing.type != "MESH" or thing.mode == "EDIT"
    mesh = evaluated.to_mesh() if apart else evaluated.data
    try:
        return _read(mesh, len(thing.material_slots)) if mesh is not None and len(mesh.polygons) else None
    finally:
        if apart:
            evaluated.to_mesh_clear()


def _read(mesh, slots):
    raw = RawMesh()
    mesh.calc_loop_triangles()
    vertices, corners, faces, triangles = len(mesh.vertices), len(mesh.loops), len(mesh.polygons), len(
        mesh.loop_triangles)
    raw.positions = _column(mesh.vertices, "co", vertices, 3, np.float32)
    raw.corners = _column(mesh.loops, "vertex_index", corners, 1, np.int32)
    raw.triangles = _column(mesh.loop_triangles, "loops", triangles, 3, np.int32)
    raw.polygons = _column(mesh.loop_triangles, "polygon_index", triangles, 1, np.int32, 12)
    raw.materials = _attribute(mesh.polygons, "material_index", faces, 1, np.int32) if slots > 1 else None
    layer = mesh.uv_layers.active
    raw.texcoords = _column(layer.data, "uv", corners, 2, np.float32) if layer and len(layer.data) == corners else None
    raw.vertex_normals = raw.polygon_normals = raw.smooth = raw.corner_normals = None
    if mesh.use_auto_smooth or mesh.has_custom_normals:
        mesh.calc_normals_split()
        raw.corner_normals = _attribute(mesh.loops, "normal", corners, 3, np.float32)
        return raw
    raw.smooth = _attribute(mesh.polygons, "use_smooth", faces, 1, np.bool_)
    if raw.smooth.any():
        raw.vertex_normals = _column(mesh.vertex_normals, "vector", vertices, 3, np.float32)
    if not raw.smooth.all():
        raw.polygon_normals = _column(mesh.polygon_normals, "vector", faces, 3, np.float32)
    return raw


def slots_of(raw):
    """The material slots that its triangles use, in order."""
    if raw is None:
        return []
    return [0] if raw.materials is None else np.unique(raw.materials).tolist()


def _normals(raw, corners, polygons):
    """Of corners of these polygons."""
    if raw.corner_normals is not None:
        return raw.corner_normals[corners]
    if raw.polygon_normals is None:
        return raw.vertex_normals[raw.corners[corners]]
    flat = raw.polygon_normals[polygons]
    return (flat if raw.vertex_normals is None
            else np.where(raw.smooth[polygons, None], raw.vertex_normals[raw.corners[corners]], flat))


def shape_of(raw, slot):
    """The fields of a Geometry: the triangles of one material slot. Corners of one vertex that look as its first one
    become one."""
    chosen = slice(None) if raw.materials is None else np.flatnonzero(raw.materials[raw.polygons] == slot)
    triangles, polygons = raw.triangles[chosen], raw.polygons[chosen]
    polygon_of = np.full(len(raw.corners), -1, np.int32)
    polygon_of[triangles] = polygons[:, None]
    corners = np.flatnonzero(polygon_of >= 0)
    corners = corners[np.argsort(raw.corners[corners], kind="stable")]
    vertices = raw.corners[corners]
    looks = [_normals(raw, corners, polygon_of[corners])]
    if raw.texcoords is not None:
        looks.append(raw.texcoords[corners])
    begins = np.empty(len(vertices), bool)
    begins[:1] = True
    np.not_equal(vertices[1:], vertices[:-1], out=begins[1:])
    first = np.maximum.accumulate(np.where(begins, np.arange(len(vertices)), 0))
    same = np.ones(len(vertices), bool)
    for look in looks:
        same &= (look == look[first]).all(axis=1)
    own = begins | ~same
    numbers = np.cumsum(own) - 1
    number_of = np.empty(len(raw.corners), np.uint32)
    number_of[corners] = np.where(same, numbers[first], numbers)
    fields = {"positions": raw.positions[vertices[own]], "normals": looks[0][own],
              "indices": number_of[triangles].reshape(-1), "texcoords": None}
    if raw.texcoords is not None:
        texcoords = looks[1][own]
        # The wall's pictures begin above
        fields["texcoords"] = np.stack([texcoords[:, 0], 1 - texcoords[:, 1]], axis=1)
    return fields
