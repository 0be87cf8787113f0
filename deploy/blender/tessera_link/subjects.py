"""What is linked, one class for each kind of thing in Blender: each says what of it is news, and takes in what the wall
says."""
import re
import uuid

import bpy

from . import lights, materials, meshes, stand
from .courier import MARK
from .mirror import Mirror, single

_KEY = re.compile("[0-9a-f]{32}")
PROPERTY = "tessera"  # of objects and collections: what is kept in the file
_REMEMBERED = 32  # places, by which undo is told from undo


class Subject:
    """Something in Blender that one or more Mirrors stand for."""

    def __init__(self, known_as):
        self.known_as = known_as  # in Blender, where it is found by that: its address changes with each undo
        self.alone = False  # was refused among others: is sent by itself
        self.unsent = False  # under way

    @property
    def name(self):
        return self.known_as[0]

    def collect(self, link, batch):
        """Adds what is news."""
        raise NotImplementedError

    def take(self, link, mirror, name, value):
        """Takes in a field that was changed at the wall."""


class FieldsSubject(Subject):
    """One whose fields are read and written one by one."""

    kind = ""

    def __init__(self, known_as, kind):
        super().__init__(known_as)
        self.mirror = Mirror(kind, self)

    def get(self):
        raise NotImplementedError

    def now(self, link, thing):
        raise NotImplementedError

    def put(self, thing, name, value):
        raise NotImplementedError

    def collect(self, link, batch):
        thing = self.get()
        if thing is None:
            return
        now = self.now(link, thing)
        if self.mirror.exists:
            batch.set(self.mirror, self.mirror.news(now))
        else:
            batch.create(self.mirror, now)

    def take(self, link, mirror, name, value):
        thing = self.get()
        if thing is None:
            return
        now = self.now(link, thing)
        if name not in now or now[name] != mirror.here.get(name):
            return  # Blender's alone, or changed here too and on its way: the last writer wins
        self.put(thing, name, value)
        mirror.in_step({name: self.now(link, thing).get(name)}, {name: value})


class MaterialSubject(FieldsSubject):
    kind = "materials"

    def __init__(self, known_as):
        super().__init__(known_as, "Material")

    def get(self):
        return bpy.data.materials.get(self.known_as)

    def now(self, link, thing):
        fields, left = materials.read(thing)
        link.note(("material", self.known_as), left and f"material {self.name}: {left}")
        return single(fields)

    def put(self, thing, name, value):
        materials.write(thing, name, value)

    def collect(self, link, batch):
        super().collect(link, batch)
        thing = self.get()
        picture = materials.image_of(thing) if thing is not None else None
        image = link.contents.image_of(picture) if picture is not None else None
        if image is not None and not image.mirror.exists:
            image.collect(link, batch)
        if thing is not None:
            batch.set(self.mirror, self.mirror.news({"baseColorImage": image and image.mirror}))


class ImageSubject(Subject):
    kind = "images"

    def __init__(self, known_as):
        super().__init__(known_as)
        self.mirror = Mirror("Image", self)

    def collect(self, link, batch):
        image = bpy.data.images.get(self.known_as)
        if image is None:
            return
        fields, left = materials.read_image(image)
        link.note(("image", self.known_as), left)
        if fields is None and not self.mirror.exists:
            batch.create(self.mirror, {})
        elif fields is not None:
            # Pixels of files of 8 bits are told as the file has them.
            batch.pixels(self.mirror, fields, image.is_float and image.colorspace_settings.name != "sRGB")


class LightSubject(FieldsSubject):
    kind = "lights"

    def __init__(self, known_as, kind):
        super().__init__(known_as, lights.TYPES[kind])
        self.of = kind

    def get(self):
        found = bpy.data.lights.get(self.known_as)
        return found if found is not None and found.type == self.of else None

    def now(self, link, thing):
        return single(lights.read(thing))

    def put(self, thing, name, value):
        lights.write(thing, name, value)

    @property
    def cores(self):
        return {0: self.mirror}

    def known(self, number, kind, _):
        """The Mirror of a light that the wall has."""
        return self.mirror if kind == self.mirror.type and self.mirror.number in (0, number) else Mirror(kind)


class MeshSubject(Subject):
    """Triangles that one or more objects show: a Geometry for each material slot in use."""

    kind = "meshes"

    def __init__(self, known_as):
        super().__init__(known_as)
        self.found_by = None  # among all meshes
        self.cores = {}  # by slot
        self.users = {}  # objects, in order
        # Mirrors of Geometries that the wall has already, by their numbers, with the numbers of their materials
        self.found = {}
        self.due = 0.0  # a large mesh that is being edited is not read again at once

    def known(self, number, kind, material):
        """The Mirror of a Geometry that the wall has."""
        for core in self.cores.values():
            if core.number == number:
                return core
        if kind != "Geometry" or self.cores:
            return Mirror(kind)
        return self.found.setdefault(number, (Mirror(kind, self), material))[0]

    def collect(self, link, batch):
        # Not of what was removed there
        user = next((each for each in self.users if link.objects.get(each.key) is each), None)
        thing = user.get() if user is not None else None
        if thing is None:
            return
        raw = meshes.read(thing, link.depsgraph())
        slots = meshes.slots_of(raw)
        for slot in slots:
            material = thing.material_slots[slot].material if slot < len(thing.material_slots) else None
            subject = link.contents.material_of(material) if material is not None else None
            core = self.cores.get(slot)
            if core is None:
                core = self.cores[slot] = Mirror("Geometry", self)
                link.dirty_all("objects", self.users)
                if self.found:
                    core, of_material = self.found.pop(next(iter(self.found)))
                    self.cores[slot] = core
                    if subject is not None and of_material and not subject.mirror.exists:
                        subject.mirror.number = of_material
                        link.courier.watch(subject.mirror)
            if subject is not None:
                subject.collect(link, batch)
            fields = {"material": subject and subject.mirror}
            if core.exists:
                batch.set(core, core.news(fields))
            else:
                batch.create(core, fields)
                link.dirty_all("objects", self.users)  # it may have been refused before
        if list(self.cores) != slots:
            self.cores = {slot: self.cores[slot] for slot in slots}
            link.dirty_all("objects", self.users)  # they show other parts
        if raw is not None:
            batch.shape(self, raw)
            self.unsent = True


class ObjectSubject(Subject):
    """An object: a node with a Transform, below it one for each part of what it shows, and one by which it is found
    again."""

    kind = "objects"

    def __init__(self, known_as, key):
        super().__init__(known_as)
        self.key = key
        self.thing = None  # Blender's; looking one up by its name takes as long as there are objects
        self.node, self.core, self.mark = Mirror("Node", self), Mirror("Transform", self), Mirror("Node", self)
        self.parent = None  # an ObjectSubject
        self.waiting = {}  # those that hang below this one, until it is there
        self.hung = None  # below which it hangs at the wall; None: below the root
        self.hung_at = 0  # the list in which the wall granted that
        self.content = None  # a MeshSubject or a LightSubject
        self.parts = []  # Mirrors of nodes
        self.kept = None  # where the wall had it when the file was saved
        self.was = ""  # at the wall, as far as is known: the stamp of the root that it is below
        self.away = []  # removed at the wall: the collections that it was in
        self.remains = ("", None)  # once it is deleted here: what it showed
        self.own = ()  # where it was put here
        self.overridden = ()  # where it was when others put it elsewhere
        self.passed = ()  # fields that others changed while they were being changed here

    def get(self):
        try:
            if self.thing is not None and self.thing.name is not None:
                return self.thing
        except ReferenceError:  # deleted, or made anew by undo
            pass
        self.thing = bpy.data.objects.get(self.known_as)
        if self.thing is not None and key_of(self.thing) not in ("", self.key):
            self.thing = None  # another one is called so now
        return self.thing

    def known(self):
        """One that is there."""
        thing = self.get()
        if thing is None:
            raise ReferenceError(self.name)
        return thing

    def parent_thing(self):
        return self.parent.get() if self.parent else None

    def forget(self):
        for mirror in (self.node, self.core, self.mark):
            mirror.forget()
        self.parts, self.hung, self.hung_at, self.was = [], None, 0, ""
        self.own = self.overridden = self.passed = ()

    def now(self, link, thing):
        fields, sheared = stand.read(thing, self.parent_thing())
        link.note(("shear", self.key), sheared and f"{self.name} is sheared: it is shown without that")
        return stand.without_noise(fields, self.core.here, stand.largest(thing, self.parent_thing()))

    def has_moved(self, link):
        thing = self.get()
        return thing is not None and bool(self.core.news(self.now(link, thing)))

    def collect(self, link, batch):
        thing = self.get()
        if thing is None or link.objects.get(self.key) is not self:  # it was removed meanwhile
            return
        if self.parent is not None and not self.parent.node.exists:
            return self._wait(link)
        if not self.node.exists:
            return self._create(link, batch, thing)
        if self.node.asked:
            return None
        now = self.now(link, thing)
        if self.passed:  # Blender may have gone back since, as undo does
            self.put(link, {name: self.core.there[name] for name in self.passed
                            if now[name] == self.core.here.get(name)})
            self.passed, now = (), self.now(link, thing)
        news = self.core.news(now)
        if news and link.undone and self._is_of_others(now):
            self.put(link, dict(self.core.there))
            news = self.core.news(self.now(link, thing))
        if news:
            self.own = _remembered(self.own, now)
            link.note(("held", self.key), "")
            batch.set(self.core, {**stand.together(news, now, self.core), **news})
        batch.set(self.node, self.node.news({"name": self.name}))
        if self.hung is not self.parent:
            batch.hang(self, self.parent.node if self.parent else link.root, self.hung)
            self.hung = self.parent
        return self.settle(link, batch)

    def _wait(self, link):
        """For the one above it."""
        above = self.parent
        above.waiting[self] = None
        if link.objects.get(above.key) is not above:
            link.rescan = True  # it was removed meanwhile: another one is above this
        elif above in link.refused:
            link.refuse(self, f"{above.name}, which it hangs below, is not there")
        else:
            link.dirty(above)

    def _is_of_others(self, now):
        """Blender's undo goes back to a whole file: it has taken back what others did since, too, which was no step of
        Blender's."""
        place = _place(now)
        return place in self.overridden and (place == self.own[-1] if place in self.own else True)

    def _create(self, link, batch, thing):
        link.ensure_root(batch)
        now = self.now(link, thing)
        self.own = _remembered(self.own, now)
        batch.create(self.core, now)
        batch.node(self.node, self.parent.node if self.parent else link.root, self.name, self.core)
        batch.node(self.mark, self.node, MARK + self.key, link.marks)
        self.hung = self.parent
        link.grown += 1
        waiting, self.waiting = self.waiting, {}
        link.dirty_all("objects", [each for each in waiting if link.objects.get(each.key) is each])
        self.settle(link, batch)

    def settle(self, link, batch):
        """A node below for each part of what is shown."""
        if not self.node.exists:
            return
        if isinstance(self.content, LightSubject) and not self.content.mirror.exists:
            self.content.collect(link, batch)
        cores = [core for core in self.content.cores.values() if core.exists] if self.content else []
        self.parts = [part for part in self.parts if part.exists]
        shown = {part.core for part in self.parts}
        for at, core in enumerate(cores):
            if core not in shown:
                part = Mirror("Node", self)
                self.parts.append(part)
                batch.node(part, self.node, f"{self.name} {at + 1}" if at else self.name, core)
        for part in [part for part in self.parts if part.core not in cores]:
            self.parts.remove(part)
            if part.number:
                batch.remove(part)

    def put(self, link, fields):
        thing = self.get()
        if thing is None or not fields:
            return
        here, there, parent = self.core.here, self.core.there, self.parent_thing()
        before = self.now(link, thing)
        in_step = [name for name in before if name in fields or before[name] == here.get(name)]
        # A mirrored one is another turn and other sizes here than there: together they are the same.
        wanted = {**before, **{name: there[name] for name in in_step if name in there}, **fields}
        stand.write(thing, parent, wanted)
        now = stand.read(thing, parent)[0]
        held = stand.is_held(wanted, {name: now[name] for name in in_step})
        link.note(("held", self.key),
                  "" if held else f"{self.name} stands at the wall where Blender has no numbers for it")
        if not held:
            stand.write(thing, parent, before)
            now = stand.read(thing, parent)[0]
        self.core.in_step({name: now[name] for name in in_step}, fields)

    def take(self, link, mirror, name, value):
        thing = self.get()
        if thing is None:  # deleted here, which may be taken back on either side
            if mirror is self.core:
                self._pass(name, value)
            return
        if thing.library is not None:
            link.note(("library", self.key),
                      f"{self.name} is of {thing.library.name}: what is changed at the wall is not saved here")
        if mirror is self.node:
            # A library's would not be found again
            if thing.library is None and thing.name == self.node.here.get("name"):
                thing.name = value
                link.renamed(self, thing)
                self.node.in_step({"name": thing.name}, {"name": value})
            elif thing.library is None:  # called otherwise here, too: Blender's counts
                self.node.here.pop("name", None)
                link.dirty(self)
            return
        now = self.now(link, thing)
        if mirror is not self.core:
            return
        if now[name] != self.core.here.get(name):  # changed here, too, which Blender does not tell of what is hidden
            self._pass(name, value)
            link.dirty(self)
            return
        self.overridden = _remembered(self.overridden, now)
        self.put(link, {name: value})

    def _pass(self, name, value):
        """Changed at the wall, and not to be changed here now."""
        self.core.there[name] = value
        self.passed = (*(each for each in self.passed if each != name), name)

    def granted(self, link, held):
        """`held`: where the wall kept it, if it did. How far it came is told as any change is."""
        link.note(("stopped", self.key),
                  f"{self.name}: the wall stopped it; it stands here as it does there" if held else "")
        self.core.there.update(held)
        self.put(link, held)

    def watch(self, link):
        for mirror in (self.node, self.core, self.mark, *self.parts, *(part.core for part in self.parts)):
            link.courier.watch(mirror)

    def is_as(self, link, found):
        """Nothing is news: it was looked at again."""
        mirrors = (self.node, self.core, self.mark, *self.parts)
        numbers = [found.node, found.core, found.mark, *(part[0] for part in found.parts)]
        if numbers != [mirror.number for mirror in mirrors] or any(mirror.sending for mirror in mirrors) or self.passed:
            return False
        if link.at(found.parent) is not self.hung or (self.hung is None and found.parent != link.root.number):
            return False
        same = self.core.there == found.stand and self.node.there.get("name") == found.name
        return same and stand.alike(self.core.here, self.core.there)

    def adopt(self, link, found):
        """The wall has it already. Who has changed it since both were last in step?"""
        before = self.hung if self.was == link.stamp and self.hung is self.parent else False
        self.node.number, self.core.number, self.mark.number = found.node, found.core, found.mark
        self.node.core, self.mark.core = self.core, link.marks
        self.parts = []
        for number, core, kind, material in found.parts:
            part = Mirror("Node", self)
            part.number, part.core = number, self.content.known(core, kind, material) if self.content else Mirror(kind)
            part.core.number = core
            self.parts.append(part)
        for mirror in (self.node, self.core, self.mark, *self.parts):
            mirror.refused()  # what was under way may have been granted or not
        self.watch(link)
        self.was = link.stamp
        link.grown += 1
        thing = self.get()
        now = self.now(link, thing)
        unknown = not self.core.here and not self.core.there  # else all of it was under way
        if unknown and self.kept:
            self.core.here, self.core.there = dict(self.kept["here"]), dict(self.kept["there"])
            self.node.here, self.node.there = {"name": self.kept["name"]}, {"name": self.kept["name"]}
        elif unknown:  # here: as it was made there, if it was
            self.core.here, self.node.here = (dict(zip(stand.FIELDS, self.own[-1])) if self.own else dict(now),
                                              {"name": self.name})
        self.own = _remembered(self.own, {**now, **self.core.here})
        self.hung, self.hung_at = link.at(found.parent), 0
        link.hangs_below_others(self, found.parent)
        if before is not False and before is not self.hung:  # changed there alone
            self.hung = before
            link.hung_elsewhere(self, found.parent)
        there = {name: value for name, value in found.stand.items() if self.core.there.get(name) != value}
        now = self.now(link, thing)
        self.put(link, {name: value for name, value in there.items() if now[name] == self.core.here.get(name)})
        self.core.there.update(there)
        if not stand.alike(self.core.here, self.core.there) and ("held", self.key) not in link.notes:
            self.core.here = {}  # one of both was not heard: Blender's counts
        if self.node.there.get("name") != found.name and self.node.here.get("name") == self.name:
            self.take(link, self.node, "name", found.name)
        self.node.there = {"name": found.name}

    def keep(self, link_key):
        """In the file: by what it is found again, and what both had when it was saved."""
        thing = self.get()
        if thing is None or thing.library is not None:
            return
        kept = {"key": self.key, "link": link_key, "root": self.was}
        if self.was and all(name in self.core.here and name in self.core.there for name in stand.FIELDS):
            kept["name"] = self.node.here.get("name", self.name)
            for side, fields in (("here", self.core.here), ("there", self.core.there)):
                kept[side] = {name: list(fields[name]) for name in stand.FIELDS}
        thing[PROPERTY] = kept

    def read_kept(self, thing, link_key):
        """Of this link: an object may be in several collections, each of which was linked once."""
        kept = thing.get(PROPERTY)
        try:
            sides = {side: {name: tuple(float(part) for part in kept[side][name]) for name in stand.FIELDS}
                     for side in ("here", "there")}
            said = {"name": str(kept["name"]), "root": str(kept["root"]), **sides}
            self.kept = said if kept["link"] == link_key else None
        except (TypeError, KeyError, ValueError, AttributeError):
            self.kept = None


def _place(fields):
    return tuple(fields[name] for name in stand.FIELDS)


def _remembered(places, fields):
    return (*places, _place(fields))[-_REMEMBERED:]


def known_as(thing):
    """Its name, and the file that it is linked from: no two of a kind have both."""
    return thing.name, thing.library.filepath if thing.library is not None else None


def key_of(thing):
    """As the file has it, or ""."""
    kept = thing.get(PROPERTY)
    try:
        key = kept["key"]
        return key if _KEY.fullmatch(key) else ""
    except (TypeError, KeyError):
        return ""


def new_key():
    return uuid.uuid4().hex


def key_by_name(link_key, thing):
    return uuid.uuid5(uuid.NAMESPACE_URL, f"{link_key}\0{known_as(thing)}").hex
