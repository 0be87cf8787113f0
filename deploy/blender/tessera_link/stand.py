"""Where objects stand: Blender's matrices and the wall's Transforms, and the two conventions of axes.

Blender has +Z up and its cameras and lights look along -Z, as the wall's do; the wall has +Y up. One Transform at the
link's root turns the whole collection, so that everything below has the same numbers on both sides."""
import math

import numpy as np
from mathutils import Matrix, Quaternion, Vector

UP = (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0)  # w, x, y, z: a quarter around x, +Z up becomes +Y up
FIELDS = ("translation", "rotation", "scale")
SHEAR = 1e-4  # of the longest column: more is said
_ROTATION_NOISE = 4e-7  # a rotation is taken out of a matrix of floats anew each time
_SCALE_NOISE = 1e-6
_THROUGH_WORLD = 2e-6  # of the largest number, where a matrix came by others
# Constraints that carry an object from where it stood
_CARRIERS = {"CHILD_OF", "FOLLOW_PATH", "ARMATURE", "FOLLOW_TRACK", "OBJECT_SOLVER"}


def _by_itself(thing, parent):
    """Blender computes its matrix from its own fields and its parent's alone."""
    return not thing.constraints and (thing.parent is None or thing.parent_type == "OBJECT") and thing.parent == parent


def local_matrix(thing, parent):
    """Relative to `parent` (an object, or None: to the world)."""
    if _by_itself(thing, parent):
        return thing.matrix_parent_inverse @ thing.matrix_basis if parent else thing.matrix_basis.copy()
    if parent is None:
        return thing.matrix_world.copy()
    return parent.matrix_world.inverted_safe() @ thing.matrix_world


def largest(thing, parent):
    """Of the numbers that its place is computed from, in its own units; 0: it is its own alone."""
    if _by_itself(thing, parent):
        return 0.0
    found = max(1.0, *map(abs, thing.matrix_world.translation))
    if parent is None:
        return found
    smallest = min(parent.matrix_world.to_scale(), key=abs)
    return max(found, *map(abs, parent.matrix_world.translation)) / (abs(smallest) or 1.0)


def read(thing, parent):
    """Its fields as a Transform has them, and whether it is sheared, which a Transform cannot hold."""
    matrix = local_matrix(thing, parent)
    translation, rotation, scale = matrix.decompose()
    if rotation.w < 0:
        rotation.negate()
    made = Matrix.LocRotScale(None, rotation, scale)
    longest = max(matrix.col[i].xyz.length for i in range(3)) or 1.0
    sheared = any((made.col[i].xyz - matrix.col[i].xyz).length > SHEAR * longest for i in range(3))
    return dict(zip(FIELDS, (tuple(translation), tuple(rotation), tuple(scale)))), sheared


def without_noise(now, here, most):
    """`now`, with what differs from `here` by rounding alone as it was there; `most`: `largest`."""
    found = dict(now)
    for name, value in now.items():
        before = here.get(name)
        if before is None or before == value:
            continue
        apart = max(abs(a - b) for a, b in zip(value, before))
        size = max(map(abs, before))
        if name == "rotation":
            same = apart <= (_THROUGH_WORLD if most else _ROTATION_NOISE)
        elif name == "scale":
            same = apart <= (_THROUGH_WORLD if most else _SCALE_NOISE) * size
        else:
            same = apart <= _THROUGH_WORLD * max(size, most) if most else False
        if same:
            found[name] = before
    return found


def is_held(wanted, now):
    """Blender's numbers are floats, and their squares, too: what is larger is infinite, and sizes that are smaller are
    none."""
    sizes = all(a or not b for a, b in zip(now.get("scale", ()), wanted["scale"]))
    return sizes and all(math.isfinite(part) for value in now.values() for part in value)


def alike(one, other):
    """Whether both are one place, but for rounding: what is mirrored has several turns and sizes."""
    if any(name not in fields for name in FIELDS for fields in (one, other)):
        return False
    size = max(1.0, *map(abs, other["translation"]))
    if any(abs(a - b) > SHEAR * size for a, b in zip(one["translation"], other["translation"])):
        return False
    if all(abs(a - b) <= _SCALE_NOISE for name in ("rotation", "scale") for a, b in zip(one[name], other[name])):
        return True
    columns = [matrix_of(fields)[:3, :3] for fields in (one, other)]
    return bool(np.abs(columns[0] - columns[1]).max() <= SHEAR * max(1.0, np.abs(columns[1]).max()))


def together(news, now, core):
    """Turn and sizes, if one of them is news and they are not the wall's, number by number, as those of what is
    mirrored."""
    pair = ("rotation", "scale")
    apart = any(abs(a - b) > SHEAR * max(1.0, abs(b)) for name in pair if name in core.here and name in core.there
                for a, b in zip(core.here[name], core.there[name]))
    return {name: now[name] for name in pair} if apart and any(name in news for name in pair) else {}


def write(thing, parent, fields):
    """Puts it where a Transform of these fields stands. Blender makes no step of undo of it."""
    matrix = Matrix.LocRotScale(Vector(fields["translation"]), Quaternion(fields["rotation"]).normalized(),
                                Vector(fields["scale"]))
    if _by_itself(thing, parent):
        thing.matrix_basis = thing.matrix_parent_inverse.inverted_safe() @ matrix if parent else matrix
        return
    world = parent.matrix_world @ matrix if parent else matrix
    carried = _carried(thing)
    if carried is not None:
        thing.matrix_world = carried.inverted_safe() @ world
        before = thing.matrix_basis.copy()
    thing.matrix_world = world
    if carried is not None:
        thing.matrix_basis = before


def _carried(thing):
    """By its constraints, from where its own fields and its parent have it. None: they carry nothing, at most they hold
    it."""
    if not any(each.type in _CARRIERS and not each.mute and each.influence for each in thing.constraints):
        return None
    now, basis = thing.matrix_world.copy(), thing.matrix_basis.copy()
    thing.matrix_world = Matrix()
    above = thing.matrix_basis.inverted_safe()  # what else stands above it
    thing.matrix_world, thing.matrix_basis = now, basis
    return now @ (above @ basis).inverted_safe()


def turn_of(quaternion):
    """3 × 3, of w, x, y, z."""
    w, x, y, z = np.asarray(quaternion, float) / np.linalg.norm(quaternion)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def matrix_of(fields):
    """4 × 4, in doubles."""
    matrix = np.eye(4)
    matrix[:3, :3] = turn_of(fields["rotation"]) * np.asarray(fields["scale"], float)
    matrix[:3, 3] = fields["translation"]
    return matrix


def view_of(camera, root, plan, units_per_metre):
    """Where a wall stands through whose first screen its first user sees what the camera sees: SetView's members.
    Screens have sizes of their own: the camera's angle of view stays Blender's."""
    place = matrix_of(root) @ np.array(camera.matrix_world, float)
    axes = place[:3, :3] / np.linalg.norm(place[:3, :3], axis=0)
    screen = plan.screens[0]
    corner = np.array(screen.lower_left)
    right, up = np.array(screen.lower_right) - corner, np.array(screen.upper_left) - corner
    right, up = right / np.linalg.norm(right), up / np.linalg.norm(up)
    turn = axes @ np.stack([right, up, np.cross(right, up)])  # what looks along -Z looks into the screen
    head = np.array(plan.users[0].position if len(plan.users) else (0, 0, 0))
    return {"position": tuple(place[:3, 3] - turn @ head * units_per_metre),
            "orientation": tuple(Matrix(turn.tolist()).to_quaternion()),
            "world_units_per_metre": units_per_metre}
