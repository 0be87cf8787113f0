"""A collection and a wall, kept in step: what is linked, what is news on either side, and in which order it goes."""
import gc
import math
import time

import bpy

from . import stand
from .contents import Contents
from .courier import ROOT_MARK, Courier
from .gestures import Gestures
from .mirror import Batch, Mirror
from .removals import make_again, put_back, step_of_undo, take_out
from .rest import Rest
from .scan import MOST_GONE, Scan
from .take_up import take_up
from .subjects import MeshSubject, ObjectSubject, known_as, new_key
from .whole import Whole

BUDGET = 0.004  # s of Blender's thread, each time
_MOST_CHANGES = 4000  # in one batch
_MESH_SHARE = 10  # a mesh is read again after so many times what reading it took
_MOST_NOTES = 200
_KINDS = ("images", "materials", "lights", "meshes", "objects")  # what others refer to goes first
_GROWN = 256  # objects
_FEW = 16  # objects that a person moves: they go first


class Link(Scan):
    """`pump` does all that is to be done now, within its budget; nothing here waits for the network."""

    stamps = {}  # of all roots that this Blender has made

    def __init__(self, tessera, way, collection, link_key):
        self.key, self._whole = link_key, Whole(collection, link_key)
        self.courier = Courier(tessera, way, link_key)
        self.root, self.root_core = Mirror("Node", self), Mirror("Transform", self)
        self.marks, self.root_mark = Mirror("ApplicationData", self), Mirror("Node", self)
        self.objects = {}  # by key
        self.by_name = {}
        self.contents = Contents(self)
        self.removed_there, self.deleted_here = {}, {}  # by key
        self.staying = {}  # keys of a library's objects that were removed there
        self.notes, self.refused = {}, {}
        self.stamp, self.superfluous, self._rest = "", [], Rest()
        self.counts = {"sent": 0, "batches": 0, "pumps": 0, "taken": 0, "longest_ms": 0.0}
        self.plan, self.undone, self.root_lost = None, False, False
        self._dirty = {kind: {} for kind in _KINDS}
        self.removals, self.rescan, self._news, self._placed = [], True, {}, {}
        self._under_way, self._taking_up, self._scanning = None, None, None
        self._looked = False  # through all that is linked, once
        self._unknown = {}  # names by which Blender told of changes and that were not known, and whether of shapes
        self._fresh = {}  # that came, and of which nothing is known yet
        self._moved = {}
        self._epoch = 0
        self.gestures = Gestures()
        self._camera = None
        self.camera_leads, self.units_per_metre = False, 1.0
        self.grown = 0  # objects, since Python was told to leave them alone
        self.wants_step = ""  # of Blender's undo, for what was made behind its last one
        self._still = False  # the collection was removed

    # ---- what Blender says

    @property
    def collection(self):
        """None: it was removed here."""
        found = self._whole.find(lambda thing: known_as(thing) in self.by_name)
        self.note(("collection",),
                  "" if found is not None else f"the collection {self._whole.name} was removed here: nothing is "
                                               f"followed "
                  "until undo brings it back, and the wall keeps what it has")
        return found

    @staticmethod
    def depsgraph():
        return bpy.context.evaluated_depsgraph_get()

    def mark(self, updates):
        """What a depsgraph has updated."""
        few = len(updates) <= _FEW
        for update in updates:
            thing = update.id
            if isinstance(thing, bpy.types.Object):
                self._mark_object(known_as(thing), update.is_updated_geometry)
                if few and known_as(thing) in self.by_name:
                    self._moved[self.by_name[known_as(thing)]] = None
            elif isinstance(thing, bpy.types.Material):
                self.contents.mark_material(known_as(thing))
                # It may have been the material
                self.dirty_all("meshes", [each for each in self.refused if each.kind == "meshes"])
            elif isinstance(thing, bpy.types.Light):
                self.contents.mark("lights", known_as(thing))
            elif isinstance(thing, bpy.types.Image):
                self.contents.mark("images", known_as(thing))
            elif isinstance(thing, (bpy.types.Collection, bpy.types.Scene)):
                self.rescan = True
                self._whole.seek()

    def dirty(self, subject):
        """Something of it may be news."""
        self._dirty[subject.kind][subject] = None

    def dirty_all(self, kind, subjects):
        self._dirty[kind].update(dict.fromkeys(subjects))

    def clean(self, subject):
        self._dirty[subject.kind].pop(subject, None)

    def _mark_object(self, known, geometry):
        subject = self.by_name.get(known)
        thing = subject.get() if subject is not None and not self.rescan else None  # after undo none is known as it was
        if thing is None or known_as(thing) != known:
            self.rescan = True
            self._unknown[known] = geometry or self._unknown.get(known, False)
            return
        self.dirty(subject)
        self._rest.touch(subject)
        if geometry:
            self.contents.choose(subject, thing)
            if isinstance(subject.content, MeshSubject):
                self.dirty(subject.content)

    def mark_all(self, undone=False):
        """Anything may have changed; `undone`: by Blender's undo."""
        self.rescan, self.undone = True, self.undone or undone
        self.look_again_soon()
        self._whole.seek(undone=True)
        self._scanning = None  # it holds objects that may not be touched any more
        for subject in (*self.objects.values(), *self.removed_there.values(), *self.deleted_here.values()):
            subject.thing = None
        self.dirty_all("objects", self.objects.values())
        for kind in ("materials", "lights", "meshes"):
            self.dirty_all(kind, self.contents.of(kind).values())

    # ---- the pump

    def pump(self, budget=BUDGET):
        begun = time.perf_counter()
        self._go(begun + budget)
        if self.wants_step:
            step_of_undo(self.wants_step)
            self.wants_step = ""
        if self.grown >= _GROWN:  # Python looks through all of them again and again, and holds Blender for that time
            gc.freeze()
            self.grown = 0
        self.counts["pumps"] += 1
        self.counts["longest_ms"] = max(self.counts["longest_ms"], (time.perf_counter() - begun) * 1e3)

    def _go(self, end):
        if self.collection is None:
            self._still = True
            self.courier.events()
            return
        if self._still:  # nobody has listened meanwhile
            self._still, self.rescan, self._epoch, self._taking_up = False, True, 0, None
            self._lose()
            self._rest.begin_at_once()
            self.courier.look_again(False)
        if self.rescan and self._scanning is None and self._epoch:
            self._scanning = self._scan()
        while (event := self.courier.event()) is not None:  # one by one: a fault with one loses no other
            getattr(self, f"_on_{event[0]}")(*event[1:])
        if self._rest.is_due and self._under_way is None and self._taking_up is None and self._epoch:
            patient = self._rest.begin()
            self._epoch = self._epoch if patient else 0
            self.courier.look_again(patient)
        self._scanning = self._go_on(self._scanning, end)
        if self._taking_up is not None and self._scanning is None and not self.rescan:
            self._go_on_taking_up(end)
        busy = self._scanning or self._taking_up or self.rescan
        if self._epoch and not busy and self.courier.state == "linked":
            self._take_news(end)
            self._take_places()
            if self._under_way is None and not self.root_lost:
                self._send(end)
            self._lead()
        elif self._epoch and self._moved and not self._taking_up and self.courier.state == "linked":
            if self._under_way is None and not self.root_lost:
                self._send_moved()

    def _go_on_taking_up(self, end):
        if self._rest.patient and (self.courier.is_disturbed or self._rest.is_moved(self)):
            self._taking_up = None
            self._rest.disturbed()
            self.courier.begin()
            return
        self._taking_up = self._go_on(self._taking_up, end)
        if self.rescan:
            self.look_again_soon()  # it was given up
        elif self._taking_up is None:
            self._rest.done()

    def _go_on(self, work, end):
        """With what is done slice by slice; None: it is done."""
        try:
            for _ in work or ():
                if time.perf_counter() > end:
                    return work
        except ReferenceError:  # an object was deleted between two slices
            self.rescan = True
        return None

    @property
    def idle(self):
        """All that is known has been sent and granted."""
        looking = self._taking_up or self._scanning or self.rescan or self._rest.is_awaited or not self._epoch
        leaving = self._under_way or self.removals or self.superfluous or any(self._dirty.values())
        return self.courier.state == "linked" and not (looking or leaving or self._news or self._placed)

    @property
    def waiting(self):
        return sum(map(len, self._dirty.values())) + len(self.removals) + (
            len(self._under_way.subjects) if self._under_way else 0)

    def close(self):
        self.keep()
        self.courier.close()

    def keep(self):
        """In Blender's data, which are about to be saved."""
        if self.collection is not None:
            self._whole.put_key()
        for subject in self.objects.values():
            subject.keep(self.key)

    def note(self, key, text):
        """What a person should know; an empty text takes it back."""
        if text and (key in self.notes or len(self.notes) < _MOST_NOTES):
            self.notes[key] = text
        elif not text:
            self.notes.pop(key, None)

    def renamed(self, subject, thing):
        self.by_name.pop(subject.known_as, None)
        subject.known_as = known_as(thing)
        self.by_name[subject.known_as] = subject

    def at(self, number):
        """The object whose node has this number."""
        mirror = self.courier.watched.get(number)
        return (mirror.owner if mirror is not None and isinstance(mirror.owner, ObjectSubject)
                and mirror is mirror.owner.node else None)

    # ---- to the wall

    def ensure_root(self, batch):
        if self.root.exists:
            return
        batch.create(self.root_core, {"translation": (0.0, 0.0, 0.0), "rotation": stand.UP, "scale": (1.0, 1.0, 1.0)})
        self.stamp = f"blender {new_key()}"
        self.stamps[self.stamp] = None
        batch.create(self.marks, {"key": self.stamp})
        self.root.owner = self
        top = Mirror("Node")
        top.number = 1
        batch.node(self.root, top, self._whole.name, self.root_core)
        batch.node(self.root_mark, self.root, ROOT_MARK + self.key, self.marks)
        batch.begins = self.root_mark

    def _send(self, end):
        batch = Batch(self._epoch, self.root)
        looked_at = 0
        first = {subject: None for subject in self._moved if subject in self._dirty["objects"]}
        self._moved = {}
        if first:
            self._dirty["objects"] = {**first, **self._dirty["objects"]}
        for kind in _KINDS:
            looked_at += self._collect(kind, batch, 0 if looked_at and time.perf_counter() > end else end)
        if not any(self._dirty.values()):
            self.undone = False
            self._remove(batch)
        self._give(batch)

    def _send_moved(self):
        """While all are looked through, which takes as long as there are objects."""
        batch = Batch(self._epoch, self.root)
        moved, self._moved = self._moved, {}
        for subject in moved:
            if self.objects.get(subject.key) is subject and subject.node.number and not subject.alone:
                before = len(batch.steps) + len(batch.removed)
                subject.collect(self, batch)
                if len(batch.steps) + len(batch.removed) > before:
                    batch.subjects[subject] = None
        self._give(batch)

    def _give(self, batch):
        batch.gesture = self.gestures.name_for(frozenset(batch.subjects))
        if batch.creates:
            self.gestures.end()  # what is made is a step of its own, before it is moved
        if batch:
            self._under_way = batch
            self._rest.put_off()
            self.counts["sent"] += batch.changes
            self.counts["batches"] += 1
            self.courier.send(batch)

    def _remove(self, batch):
        """One that was refused among others by itself."""
        for node in self.superfluous:
            batch.remove(node)
        self.superfluous = []
        alone = [subject for subject in self.removals if subject.alone][:1]
        if alone and batch:
            return
        for subject in alone or self.removals:
            if subject.node.number:
                batch.remove(subject.node)
        self.removals = [subject for subject in self.removals if alone and subject is not alone[0]]

    def _collect(self, kind, batch, end):
        """How many it has looked at: one at least, unless there is no time at all."""
        dirty, later, looked_at = self._dirty[kind], {}, 0
        while dirty and end:
            now, subject = time.perf_counter(), next(iter(dirty))
            if looked_at and now > end:
                break
            if batch.subjects and (batch.changes > _MOST_CHANGES or subject.alone or next(iter(batch.subjects)).alone):
                break
            looked_at += 1
            del dirty[subject]
            if kind == "meshes" and now < subject.due:
                later[subject] = None
                continue
            before = len(batch.steps) + len(batch.removed)
            subject.collect(self, batch)
            if len(batch.steps) + len(batch.removed) > before:
                batch.subjects[subject] = None
            if kind == "meshes":
                subject.due = time.perf_counter() * (1 + _MESH_SHARE) - _MESH_SHARE * now
        dirty.update(later)
        return looked_at

    def _lead(self):
        """The wall's view follows the scene's camera."""
        camera = bpy.context.scene.camera if self.camera_leads else None
        if camera is None or self.plan is None or not len(self.plan.screens):
            self._camera = None
            return
        stand_of_root = {**self.root_core.here, **self.root_core.there}
        now = (tuple(map(tuple, camera.matrix_world)), tuple(stand_of_root.get("translation", ())),
               self.units_per_metre, self._epoch)
        if now != self._camera and stand_of_root:
            self._camera = now
            self.courier.look(stand.view_of(camera, stand_of_root, self.plan, self.units_per_metre))

    # ---- from the wall

    def _on_state(self, state, message):
        if state != "linked":
            self._lose()

    def _lose(self):
        """What is under way: it may be granted or not, and what is found tells."""
        if self._under_way is not None:
            self.superfluous += [node for node in self._under_way.removed if node.owner is None]
            for subject, before in self._under_way.hung.items():
                subject.hung = before
                self.dirty(subject)
            self._under_way = None

    def _on_note(self, key, text):
        self.note(key, text)

    def _on_found(self, found):
        self._epoch, self.plan = found.epoch, found.plan
        if found.root or not found.same:
            self._found_root()
        self._rest.found(found.patient and self._under_way is None)
        self._lose()
        if not found.patient:
            self._news = {}
        self._placed, self._taking_up = {}, take_up(self, found)

    def _on_disturbed(self):
        self._rest.disturbed()

    def _on_done(self, batch, sequence, stopped):
        if batch is self._under_way:
            self._under_way = None
            for mirror in batch.mirrors():
                held = {name: mirror.there[name] for name in mirror.sending if name in mirror.there}
                is_new = mirror.asked
                mirror.done(sequence)
                if is_new and isinstance(mirror.owner, ObjectSubject) and mirror is mirror.owner.node:
                    mirror.owner.was, mirror.owner.hung_at = self.stamp, sequence
                if mirror.type == "Transform" and isinstance(mirror.owner, ObjectSubject):
                    mirror.owner.granted(self, held if mirror.number in stopped else {})
            for subject in batch.subjects:
                subject.alone = subject.unsent = False
                self.note(("refused", subject.kind, subject.known_as), "")
                self.refused.pop(subject, None)
            for subject in batch.hung:
                subject.hung_at = sequence
                self.note(("others'", subject.key), "")
            for mirror in batch.removed:
                self._removed_by_us(mirror)

    def _on_refused(self, batch, message):
        if batch is not self._under_way:
            return
        self._under_way = None
        for mirror in batch.mirrors():
            mirror.refused()
        for subject, before in batch.hung.items():
            subject.hung = before
        removed = [mirror.owner for mirror in batch.removed if mirror.owner is not None and mirror is mirror.owner.node
                   and mirror.owner.key in self.deleted_here]
        several = len(batch.subjects) + len(removed) > 1
        for subject in removed if several else ():
            subject.alone = True
            self.removals.append(subject)
        for subject in batch.subjects:
            if several:
                subject.alone = True
                self.dirty(subject)
            else:
                subject.alone = False
                self.refuse(subject, f"the wall refuses: {message}")
        if removed and not several:
            self.note(("refused", removed[0].key), f"{removed[0].name}: the wall refuses its removal: {message}")

    def refuse(self, subject, why):
        """Until something of it changes, or of what is above it."""
        self.refused[subject] = None
        self.note(("refused", subject.kind, subject.known_as), f"{subject.name}: {why}")
        if isinstance(subject, ObjectSubject):
            self.dirty_all("objects", subject.waiting)

    def told(self, mirror, fields):
        """As was found at the wall."""
        self._news.update(((mirror, name), (math.inf, fields[name])) for name in mirror.here if name in fields)

    def _take_news(self, end):
        self._news.update(self.courier.changed())
        for (mirror, name), (sequence, value) in list(self._news.items()):
            if name in mirror.sending:
                continue  # once that is granted, it is known which of both is the newer one
            del self._news[mirror, name]
            there = mirror.there.get(name)
            if sequence < mirror.granted or (there.number if isinstance(there, Mirror) else there) == value:
                continue
            self.counts["taken"] += 1
            self._rest.put_off()
            if isinstance(mirror.owner, Link):
                mirror.in_step({name: value}, {name: value})
            else:
                mirror.owner.take(self, mirror, name, value)
            if time.perf_counter() > end:
                break

    def _removed_by_us(self, mirror):
        mirror.gone()
        subject = mirror.owner
        if isinstance(subject, ObjectSubject) and mirror is subject.node and self.objects.get(subject.key) is subject:
            subject.forget()  # it came back here meanwhile, and is made anew
            self.dirty(subject)

    def _on_gone(self, gone):
        """At once; with the root all go: that is no word about each of them."""
        if any(mirror is self.root and mirror.number == number for mirror, number in gone):
            self._lost_root()
        for mirror, number in gone:
            if mirror.number == number:
                self._is_gone(mirror)

    def _is_gone(self, mirror):
        if self._under_way is not None and mirror in self._under_way.removed:
            return self._removed_by_us(mirror)
        mirror.gone()
        subject = mirror.owner
        if isinstance(subject, ObjectSubject) and mirror is subject.node:
            self.look_again_soon()
            self.note(("refused", subject.key), "")
            if subject.key in self.objects and not self.root_lost:
                self.removed(subject)

    def removed(self, subject):
        """By others, at the wall."""
        del self.objects[subject.key]
        self.removed_there[subject.key] = subject
        self.note(("others'", subject.key), "")
        self.clean(subject)
        thing = subject.get()
        if thing is not None:
            take_out(self, subject, thing)
        while len(self.removed_there) > MOST_GONE:
            self.removed_there.pop(next(iter(self.removed_there)))

    def _lost_root(self):
        self.root_lost = True
        self.note(("root",), "the collection was removed at the wall: unlink and link it to show it anew, or take the "
                             "removal back there")

    def _found_root(self):
        self.root_lost = False
        self.note(("root",), "")

    def _on_back(self, mirror, number):
        """By undo, under its old number."""
        if mirror.number == number:
            return
        if not mirror.exists:
            mirror.number = number
        if mirror is self.root:
            self._found_root()
        self.look_again_soon()
        subject = mirror.owner
        if not isinstance(subject, ObjectSubject) or mirror is not subject.node or mirror.number != number:
            return
        if self.removed_there.pop(subject.key, None) is not None:
            put_back(self, subject)
        elif self.deleted_here.pop(subject.key, None) is not None:
            make_again(self, subject)

    def _on_marked(self):
        """A node with the key of an object: another Blender with this file made it, or undo of what was done before we
        were here. What is not of this file is said."""
        self.look_again_soon()

    def look_again_soon(self):
        """Where both sides hung, removed and took back at once, what is there decides, and not what each heard of the
        other. At rest: each call puts it off."""
        self._rest.soon()

    def _on_placed(self, mirror, parent, sequence):
        """Hung elsewhere at the wall."""
        if isinstance(mirror.owner, ObjectSubject) and mirror is mirror.owner.node:
            self._placed[mirror.owner] = (parent, sequence)
            if sequence > mirror.owner.hung_at and self._under_way is None:
                self.look_again_soon()

    def _take_places(self):
        """Once it is known which is the newer one: where it was hung here, or there."""
        if self._under_way is not None:
            return
        placed, self._placed = self._placed, {}
        for subject, (parent, sequence) in placed.items():
            if subject.key in self.objects and sequence > subject.hung_at and not self.root_lost:
                self._hang_as_there(subject, parent)

    def hung_elsewhere(self, subject, parent):
        """At the wall, as was found there."""
        self._placed[subject] = (parent, subject.hung_at + 1)

    def hangs_below_others(self, subject, parent):
        """At the wall, below a node that is none of ours: here it stays where it is, and that is said."""
        others = self.at(parent) is None and parent != self.root.number
        said = f"{subject.name} hangs below another node at the wall than here"
        self.note(("others'", subject.key), said if others else "")
        return others

    def _hang_as_there(self, subject, parent):
        above = self.at(parent)
        others = self.hangs_below_others(subject, parent)
        self.note(("hung", subject.key), "")
        if others or above is subject.hung:
            return
        thing = subject.get()
        if thing is None:
            return
        wanted = above.get() if above is not None else None
        thing.parent = wanted
        subject.hung = above
        self.wants_step = "Objects that were hung elsewhere at the wall"
        if thing.parent != wanted:  # here it stands above that one
            self.note(("hung", subject.key),
                      f"{subject.name} cannot hang below {above.name}, which hangs below it here")
            return
        thing.matrix_parent_inverse.identity()
        subject.parent = above
        subject.put(self, subject.core.there)
