"""What both sides have of one object of the wall, so that each change travels once and only where it is news."""
import struct

_FLOAT = struct.Struct("f")
_NOTHING = {}  # one for all, as there are many Mirrors: never written to



def single(fields):
    """As the wall keeps them: numbers of materials and lights are floats there, and come back rounded."""
    found = {}
    for name, value in fields.items():
        if isinstance(value, float):
            value = _FLOAT.unpack(_FLOAT.pack(value))[0]
        elif isinstance(value, tuple):
            value = tuple(_FLOAT.unpack(_FLOAT.pack(part))[0] for part in value)
        found[name] = value
    return found


class Mirror:
    """An object of the wall that stands for something in Blender.

    `here`: its fields as Blender had them when both were last in step, `there`: as the wall had them. What Blender
    reads now and is not `here` has been changed here; what comes and is not `there` has been changed there. Neither is
    ever computed from the other, so rounding (float here, double there) never becomes a change."""

    __slots__ = ("type", "number", "asked", "owner", "core", "here", "there", "sending", "granted")

    def __init__(self, kind, owner=None):
        self.type, self.owner = kind, owner
        self.forget()

    def forget(self):
        """At a wall that knows nothing of it."""
        self.number, self.asked = 0, False
        self.core = None  # of a node: the Mirror of its core
        self.here, self.there = {}, {}
        self.sending = _NOTHING  # under way: fields with their values
        self.granted = 0  # the list in which the wall granted what was sent last

    @property
    def exists(self):
        """At the wall, or it will with the batch that is being made."""
        return bool(self.number or self.asked)

    def gone(self):
        """Destroyed at the wall. With undo it comes back as it was."""
        self.number, self.asked, self.sending = 0, False, _NOTHING

    def news(self, now):
        """Those of the fields that Blender has now which were changed here."""
        return {name: value for name, value in now.items() if self.here.get(name) != value}

    def send(self, now):
        """They are under way."""
        self.here.update(now)
        self.sending = {**self.sending, **now}

    def done(self, sequence):
        self.there.update(self.sending)
        self.sending, self.asked = _NOTHING, False
        self.granted = sequence

    def refused(self):
        """They are as if they had never been read: whoever reads again sends again."""
        for name in self.sending:
            self.here.pop(name, None)
        self.sending, self.asked = _NOTHING, False

    def in_step(self, now, there):
        """Both have the same now."""
        self.here.update(now)
        self.there.update(there)


class Batch:
    """Changes that the wall grants or refuses as one. Made where Blender's data may be read, sent by the courier's
    thread."""

    def __init__(self, epoch, root, gesture=""):
        self.epoch, self.root = epoch, root
        self.gesture = gesture  # changes in a row of one gesture are one step of the wall's undo
        self.steps = []  # ("object" | "node" | "set" | "place" | "shape" | "pixels", Mirror or subject, …)
        self.removed = []  # Mirrors of nodes, with all that is below them
        self.hung = {}  # subjects that hang elsewhere now, with what they hung below before
        self.subjects = {}  # whose changes these are, in order
        self.changes = 0  # fields, for the count
        self.creates = False
        self.begins = None  # the Mirror of the mark of a new root

    def __bool__(self):
        return bool(self.steps or self.removed)

    def create(self, mirror, fields):
        self.steps.append(("object", mirror, fields))
        mirror.asked, mirror.here, mirror.there = True, {}, {}
        mirror.send(fields)
        self.changes += len(fields)
        self.creates = True

    def node(self, mirror, under, name, core=None):
        self.steps.append(("node", mirror, under, name, core))
        mirror.core, mirror.asked = core, True
        mirror.send({"name": name})
        self.changes += 1
        self.creates = True

    def set(self, mirror, fields):
        if fields:
            self.steps.append(("set", mirror, fields))
            mirror.send(fields)
            self.changes += len(fields)

    def hang(self, subject, under, before):
        self.steps.append(("place", subject.node, under))
        self.hung[subject] = before
        self.changes += 1

    def shape(self, mesh, raw):
        """Arrays as Blender has them: what the wall wants is made of them beside Blender's thread."""
        self.steps.append(("shape", mesh, raw))
        self.changes += 1

    def pixels(self, mirror, fields, linear):
        """A new Image, or new pixels of one."""
        if not mirror.number:
            self.create(mirror, {})
        self.steps.append(("pixels", mirror, fields, linear))
        self.changes += len(fields)

    def remove(self, node):
        self.removed.append(node)
        self.changes += 1

    def mirrors(self):
        return {step[1]: None for step in self.steps if isinstance(step[1], Mirror)}
