"""The thread that speaks with the wall: Blender's own never waits for the network. Nothing here touches Blender's
data."""
import collections
import contextlib
import queue
import threading

import numpy as np

from . import lights, materials, meshes
from .mirror import Mirror

MARK = "blender:"  # names of the nodes by which objects are found again, before their keys
ROOT_MARK = "blender-link:"
_PAUSES = (0.1, 0.2, 0.5, 1.0, 2.0)  # s, between one dial that failed and the next
_MOST_LOOKS = 1024  # materials and lights that are read one by one
_UNREAD = 4096  # lists of changes: with more of them we begin anew
_CONTENT = ("Geometry", *lights.TYPES.values())
_FOLLOWED = {"Node": {"name"}, "Transform": {"translation", "rotation", "scale"}}  # of other types all that is mirrored


class FoundObject:
    """An object that stands at the wall already."""

    __slots__ = ("node", "core", "mark", "parent", "name", "stand", "parts")


class Found:
    """What a wall has of a collection: taken up instead of made again."""

    def __init__(self, role, plan, patient):
        self.role, self.plan = role, plan
        self.patient = patient  # whoever changes something meanwhile goes first
        self.root = self.root_core = self.marks = 0
        self.root_stand = None
        self.same = False  # numbers mean what they meant
        self.stamp = ""  # of the root: another one was made anew, and what is not below it was not removed
        self.objects = {}  # by key
        self.looks = {}  # of materials and lights: their fields, by number
        self.epoch = 0
        self.twins = {}  # paths of other roots with this key, by their numbers and stamps
        self.twice = set()  # nodes of keys that others have already
        self.others = 0  # nodes below the root that are not of Blender


class _Disturbed(Exception):
    """While both sides were compared."""


class Courier:
    """Dials, finds what is there, sends batches one after the other, and notes what others change. All that it has to
    tell is taken by `events` and `changed`, which never wait."""

    def __init__(self, tessera, way, link_key):
        self._tessera, self._way, self._key = tessera, way, link_key
        self.state, self.message = "connecting", "connecting"
        self.watched = {}  # numbers of the wall's objects to their Mirrors
        self._sorted = np.zeros(0, "<u8")  # the same numbers, for long lists
        self._events = collections.deque()
        self._news = {}  # (Mirror, field) to (sequence, value): of each field the newest alone
        self._lock = threading.Lock()  # of _news
        self._gate = threading.Lock()  # lists are not looked at while numbers are being given
        self._jobs = queue.SimpleQueue()
        self._view = collections.deque(maxlen=1)
        self._closing = threading.Event()
        self._follow = threading.Event()
        self._broken, self._anew = None, None
        self._disturbed = threading.Event()  # something is sent, or changed at the wall, while both are compared
        self._server = 0  # its epoch
        self._epoch = 0  # of sessions: what was made for another one has numbers that mean something else
        self._thread = threading.Thread(target=self._run, name="tessera link", daemon=True)
        self._thread.start()

    # ---- what Blender's thread calls: nothing here waits

    def send(self, batch):
        self._disturbed.set()
        self._jobs.put(batch)

    def look(self, view):
        """Of those that wait, the newest is sent."""
        self._view.append(view)
        self._jobs.put(None)

    def begin(self):
        """What was found has been taken up: changes are told from the list on at which it was found."""
        self._follow.set()

    def watch(self, mirror):
        if mirror.number:
            self.watched[mirror.number] = mirror

    def events(self):
        found = []
        while self._events:
            found.append(self._events.popleft())
        return found

    def event(self):
        return self._events.popleft() if self._events else None

    def changed(self):
        with self._lock:
            found, self._news = self._news, {}
        return found

    def look_again(self, patient):
        """At what is there, as after dialling. `patient`: that is given up for whatever is sent meanwhile."""
        self._disturbed.clear()
        self._anew = patient
        self._jobs.put(None)

    @property
    def is_disturbed(self):
        return self._disturbed.is_set()

    def close(self):
        self._closing.set()
        self._jobs.put(None)

    # ---- its thread

    def _run(self):
        failed, before = 0, False
        while not self._closing.is_set():
            try:
                self._session()
            except self._tessera.TesseraError as error:
                last = error
            except OSError as error:
                last = self._tessera.NetworkError(str(error))
            except Exception as error:  # a fault of ours: it is said, and the link dialled again
                last = self._tessera.NetworkError(f"{type(error).__name__}: {error}")
            else:
                continue
            welcomed, before = self.state == "linked", before or self.state == "linked"
            if not before and not isinstance(last, self._tessera.NetworkError):
                self._say("failed", str(last))
                return
            failed = 0 if welcomed else failed + 1
            self._say("reconnecting", str(last))
            self._closing.wait(_PAUSES[min(failed, len(_PAUSES) - 1)])
        self._say("closed", "")

    def _say(self, state, message):
        self.state, self.message = state, message
        self._events.append(("state", state, message))

    def _session(self):
        """Until it is closed, or breaks."""
        self.watched, self._sorted, self._broken, self._anew = {}, np.zeros(0, "<u8"), None, None
        with self._tessera.connect(**self._way, name="blender", redial=0) as wall:
            role = wall.whoami().role
            if role == "viewer":
                raise self._tessera.Refused(f"the token for the wall at {wall.address} is a viewer's: it may look, "
                                            f"and not edit; ask for an editor's")
            changes, over = wall.follow("changes", most=_UNREAD), threading.Event()
            follower = threading.Thread(target=self._listen, args=(changes, over), name="tessera changes", daemon=True)
            try:
                self._look(wall, role)
                self._say("linked", f"linked with the wall at {wall.address}")
                follower.start()
                self._serve(wall, role)
            finally:
                over.set()
                changes.close()
                self._follow.set()
                if follower.ident is not None:
                    follower.join()  # what it still hears is of a session that is over

    def _look(self, wall, role, patient=False):
        """At what is there; what others change from then on waits until that has been taken up."""
        with self._gate:
            self._follow.clear()
            self._anew = None
            try:
                found = self._take_up(wall, role, patient)
            except _Disturbed:
                self._follow.set()
                self._events.append(("disturbed",))
                return
            self._epoch += 1
            found.epoch = self._epoch
            if not patient:
                with self._lock:
                    self._news = {}
            self._events.append(("found", found))

    def _serve(self, wall, role):
        while not self._closing.is_set():
            try:
                batch = self._jobs.get(timeout=0.2)
            except queue.Empty:
                batch = None
            if self._broken is not None:
                raise self._broken
            if not wall.connected:
                wall.status()  # says why
            if self._view:
                try:
                    wall.view(**self._view.popleft())
                except (self._tessera.Refused, self._tessera.BadInput) as error:
                    self._events.append(("note", "view", str(error)))
            if self._anew is not None:
                self._look(wall, role, self._anew)
            if batch is not None and batch.epoch == self._epoch:
                self._do(wall, batch)

    def _do(self, wall, batch):
        try:
            with self._gate if batch.creates else contextlib.nullcontext():
                told = self._commit(wall, batch) if batch.steps else None
            if batch.begins is not None:
                self._yield_to_the_first(wall, batch)
            for node in self._one_of_many(wall, batch):
                node.remove()
        except self._tessera.NetworkError:
            raise
        except Exception as error:  # whatever is wrong with it: the link goes on
            kind = "" if isinstance(error, self._tessera.TesseraError) else f"{type(error).__name__}: "
            self._events.append(("refused", batch, f"{kind}{error}"))
        else:
            sequence = told.sequence if told is not None else 0  # others may have changed the same before the removals
            self._events.append(("done", batch, sequence, set(told.stopped.tolist()) if told is not None else ()))

    def _one_of_many(self, wall, batch):
        """What is to be removed: a node, or one below which all have been hung, as a removal takes a frame."""
        nodes = [wall.handle(each.number, "Node") for each in batch.removed]
        if len(nodes) < 2:
            return nodes
        with wall.edit(undo=batch.gesture or None) as edit:
            bin_of_all = edit.add(wall.handle(batch.root.number, "Node"), "removed in Blender")
            for node in nodes:
                edit.place(node, bin_of_all)
        return [bin_of_all]

    def _yield_to_the_first(self, wall, batch):
        """Two Blenders with one file may both have found nothing."""
        if min(mark.id for mark in wall.find(f"/**/{ROOT_MARK}{self._key}")) != batch.begins.number:
            wall.handle(batch.root.number, "Node").remove()
            raise self._tessera.NetworkError("another Blender shows this collection: what it shows is taken up")

    # ---- a batch as an edit

    def _commit(self, wall, batch):
        edit = wall.edit(undo=batch.gesture or None)
        made = {}

        def handle(mirror):
            found = made.get(mirror)
            if found is None:
                core = mirror.core
                found = wall.handle(mirror.number, mirror.type,
                                    *((core.number, core.type) if core is not None and core.number else ()))
            return found

        def fields_of(fields):
            return {name: handle(value) if isinstance(value, Mirror) else value for name, value in fields.items()}

        for step in batch.steps:
            kind, mirror = step[:2]
            if kind == "object":
                made[mirror] = edit.object(mirror.type, **fields_of(step[2]))
            elif kind == "node":
                made[mirror] = edit.add(handle(step[2]), step[3], handle(step[4]) if step[4] is not None else None)
            elif kind == "set":
                edit.set(handle(mirror), **fields_of(step[2]))
            elif kind == "place":
                edit.place(handle(mirror), handle(step[2]))
            elif kind == "shape":
                for slot, core in mirror.cores.items():
                    edit.set(handle(core), **meshes.shape_of(step[2], slot))
            elif kind == "pixels":
                fields = dict(step[2])
                edit.set(handle(mirror), **{**fields, "pixels": materials.bytes_of(fields["pixels"], step[3])})
        told = edit.commit()
        for mirror, given in made.items():
            mirror.number = given.id
            self.watched[given.id] = mirror
        return told

    # ---- what is there

    def _undisturbed(self, rows, patient):
        for row in rows:
            if patient and self._disturbed.is_set():
                raise _Disturbed
            yield row

    def _take_up(self, wall, role, patient=False):
        found, status = Found(role, wall.ask("GetWall"), patient), wall.status()
        found.same, self._server = status.epoch == self._server or bool(status.journal), status.epoch
        marks = wall.find(f"/**/{ROOT_MARK}{self._key}")
        marks.sort(key=lambda mark: mark.id)
        if not marks:
            return found
        root = marks[0].parent
        found.twins = {(mark.parent.id, getattr(mark.core, "key", "")): mark.parent.path for mark in marks[1:]}
        names, cores, parents, values, types, stamps = {}, {}, {}, {}, {}, {}
        for rows, content in self._undisturbed(wall.tree(root), patient):
            parents.update(zip(rows["node"].tolist(), rows["parent"].tolist()))
            types.update(zip(content.created["id"].tolist(), content.created["type"].tolist()))
            for column in content.columns:
                if (column.type.name, column.field.name) == ("Node", "name"):
                    names.update(zip(column.ids.tolist(), column.values))
                elif (column.type.name, column.field.name) == ("Node", "core"):
                    cores.update(zip(column.ids.tolist(), column.values.tolist()))
                elif (column.type.name, column.field.name) == ("ApplicationData", "key"):
                    stamps.update(zip(column.ids.tolist(), column.values))
                elif column.type.name == "Transform" or column.field.name == "material":
                    for number, value in zip(column.ids.tolist(), column.values.tolist()):
                        values.setdefault(number,
                                          {})[column.field.name] = (tuple(value) if isinstance(value, list) else value)
        kinds = wall.schema.types_by_number

        def stand_of(core):
            return {"translation": (0.0, 0.0, 0.0), "rotation": (1.0, 0.0, 0.0, 0.0), "scale": (1.0, 1.0, 1.0),
                    **values.get(core, {})}

        def is_type(number, name):
            return number in types and kinds[types[number]].name == name

        found.root, found.root_core = root.id, cores.get(root.id, 0)
        found.root_stand = stand_of(found.root_core)
        ours = {root.id}
        # The first one keeps the key: copies that people made at the wall are theirs
        for number in self._undisturbed(sorted(names), patient):
            name, parent = names[number], parents.get(number, 0)
            key = name[len(MARK):]
            if number == root.id or not is_type(cores.get(number, 0), "ApplicationData"):
                continue
            if parent == root.id and name.startswith(ROOT_MARK):
                found.marks, found.stamp = cores[number], stamps.get(cores[number], "")
                ours.add(number)
            elif name.startswith(MARK) and key in found.objects:
                found.twice.add(parent)
            elif name.startswith(MARK) and is_type(cores.get(parent, 0), "Transform"):
                each = FoundObject()
                each.node, each.core, each.mark, each.parent = parent, cores[parent], number, parents.get(parent, 0)
                each.name, each.stand, each.parts = names.get(parent, ""), stand_of(each.core), []
                found.objects[key] = each
                ours.update((number, parent))
        by_node = {each.node: each for each in found.objects.values()}
        for number, parent in self._undisturbed(sorted(parents.items()), patient):
            core = cores.get(number, 0)
            if number not in ours and parent in by_node and core in types and kinds[types[core]].name in _CONTENT:
                by_node[parent].parts.append((number, core, kinds[types[core]].name,
                                              values.get(core, {}).get("material", 0)))
                ours.add(number)
        found.others = len(parents) - len(ours & set(parents))
        found.looks = {} if patient else self._looks_of(wall, found)
        return found

    def _looks_of(self, wall, found):
        """Fields of materials and lights, by their numbers: nobody told of them while the link was away."""
        parts = [part for each in found.objects.values() for part in each.parts]
        kinds = {core: kind for _, core, kind, _ in parts if kind in lights.TYPES.values()}
        kinds.update((material, "Material") for *_, material in parts if material)
        looks = {}
        for number, kind in list(kinds.items())[:_MOST_LOOKS]:
            with contextlib.suppress(self._tessera.NotFound):  # it has gone meanwhile, which will be told
                looks[number] = wall.handle(number, kind).fields()
        return looks

    # ---- what others change

    def _listen(self, changes, over):
        try:
            for change in changes:
                if over.is_set():
                    return
                if changes.missed or changes.gaps:
                    raise self._tessera.NetworkError("changes of the wall were missed")
                while not self._hear(change):
                    pass
        except self._tessera.TesseraError as error:
            self._broken = error
        except Exception as error:  # a fault of ours
            self._broken = self._tessera.NetworkError(f"{type(error).__name__}: {error}")
        else:
            self._broken = self._tessera.NetworkError("the wall is over")
        self._jobs.put(None)

    def _hear(self, change):
        """False: what was found has not been taken up yet."""
        if not self._follow.is_set() and self._concerns_us(change):
            self._disturbed.set()
        self._follow.wait()
        with self._gate:
            known = self._follow.is_set()
            if known:
                self._look_at(change)
        return known

    def _ours(self, numbers):
        """Which of these are watched, by place."""
        if not len(numbers) or not self.watched:
            return ()
        if len(numbers) < 64:
            return [at for at, number in enumerate(numbers.tolist()) if number in self.watched]
        if len(self._sorted) != len(self.watched):  # it only grows
            self._sorted = np.sort(np.array(list(self.watched), "<u8"))
        at = np.minimum(np.searchsorted(self._sorted, numbers), len(self._sorted) - 1)
        return np.flatnonzero(self._sorted[at] == numbers).tolist()

    def _concerns_us(self, change):
        rows = (change.created["id"], change.placed["node"], change.destroyed, *(each.ids for each in change.columns))
        return any(len(self._ours(numbers)) for numbers in rows)

    def _look_at(self, change):
        for at in self._ours(change.created["id"]):
            number = int(change.created["id"][at])
            self._events.append(("back", self.watched[number], number))
        for at in self._ours(change.placed["node"]):
            node, parent = int(change.placed["node"][at]), int(change.placed["parent"][at])
            if parent:
                self._events.append(("placed", self.watched[node], parent, change.sequence))
        for column in change.columns:
            if (column.type.name, column.field.name) == ("Node", "name"):
                for number, name in zip(column.ids.tolist(), column.values):
                    if name.startswith(MARK) and number not in self.watched:
                        self._events.append(("marked",))
            kept = _FOLLOWED.get(column.type.name)
            if kept is not None and column.field.name not in kept:
                continue
            for at in self._ours(column.ids):
                mirror = self.watched[int(column.ids[at])]
                if mirror.type != column.type.name or column.field.name not in mirror.here:
                    continue
                value = column.values[at]
                value = (tuple(value.tolist()) if isinstance(value, np.ndarray) else value.item()
                         if isinstance(value, np.generic) else value)
                word = next((word for word, number in column.field.words.items() if number == value), value)
                word = bool(word) if isinstance(mirror.here[column.field.name], bool) else word
                with self._lock:
                    self._news[mirror, column.field.name] = (change.sequence, word)
        gone = [(self.watched[number], number)
                for number in (int(change.destroyed[at]) for at in self._ours(change.destroyed))]
        if gone:
            self._events.append(("gone", gone))
