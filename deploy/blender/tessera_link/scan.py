"""Who is linked: objects come, go, hang elsewhere, have other names."""
from .removals import take_out
from .subjects import PROPERTY, ObjectSubject, key_by_name, key_of, known_as, new_key

MOST_GONE = 20000  # objects that undo may bring back
SLICE = 64  # objects, between two looks at the clock


class Scan:
    """The part of a Link that looks through all of its collection, slice by slice."""

    def _scan(self):
        """Objects come, go, hang elsewhere, have other names."""
        self.rescan = False
        self._whole.stands_alone()
        groups, keyless = {}, []
        for at, thing in enumerate(self._whole.objects()):
            if at % SLICE == 0:
                yield
            key = key_of(thing)
            # Blender's undo went back to before it was linked
            known = self.by_name.get(known_as(thing)) if not key else None
            key = key or (known.key if known is not None else self.staying.get(known_as(thing)))
            if key:
                groups.setdefault(key, []).append(thing)
            else:
                keyless.append(thing)
        for at, thing in enumerate(keyless):
            if at % SLICE == 0:
                yield
            groups[self._key_for(thing, groups)] = [thing]
        present = {}
        for at, (key, things) in enumerate(groups.items()):
            if at % SLICE == 0:
                yield
            subject = self.objects.get(key)
            # A copy in Blender has the key, too: the one with the name that is known keeps it.
            first = next((thing for thing in things if subject is not None and known_as(thing) == subject.known_as),
                         things[0])
            for thing in things:
                known = self.by_name.get(known_as(thing)) if thing is not first else None
                own = known is not None and known.key not in groups
                present[key if thing is first else known.key if own else self._key_for(thing, groups)] = thing
        for at, key in enumerate([key for key in self.objects if key not in present]):
            if at % SLICE == 0:
                yield
            subject = self.objects.pop(key, None)
            if subject is not None:
                self._deleted(subject)
        for at, (key, thing) in enumerate(present.items()):
            if at % SLICE == 0:
                yield
            subject = self.objects.get(key)
            if subject is None:
                subject = self._came(key, thing)
                if subject is None:
                    continue
                self._fresh[subject] = None
            elif subject.known_as != known_as(thing):
                subject.known_as = known_as(thing)
                self.dirty(subject)
            subject.thing = thing
        self.by_name = {subject.known_as: subject for subject in self.objects.values()}
        for at, subject in enumerate(list(self.objects.values())):
            self._hang(subject, subject.known())
            if at % SLICE == 0:
                yield
        for at, subject in enumerate(list(self._fresh)):
            if subject.key in self.objects:
                self.contents.choose(subject, subject.known())
                self.dirty(subject)
            del self._fresh[subject]
            if at % SLICE == 0:
                yield
        self._looked = True
        for at, known in enumerate(list(self._unknown)):
            if at % SLICE == 0:
                yield
            if self.rescan:
                return  # they are looked for again
            geometry = self._unknown.pop(known)
            if known in self.by_name:
                self._mark_object(known, geometry)

    def _key_for(self, thing, taken):
        """Of what the collection had when it was linked: the same in each Blender that has the same file open."""
        key = "" if self._looked else key_by_name(self.key, thing)
        return key if key and key not in taken and key not in self.objects else new_key()

    def _hang(self, subject, thing):
        """Below the nearest object above it that is linked."""
        above = thing.parent
        while above is not None and known_as(above) not in self.by_name:
            above = above.parent
        parent = self.by_name[known_as(above)] if above is not None else None
        if parent is not subject.parent:
            subject.parent = parent
            self.dirty(subject)

    def _came(self, key, thing):
        if key in self.removed_there and (self.undone or known_as(thing) in self.staying):
            take_out(self, self.removed_there[key], thing)  # Blender's undo brought it back: at the wall it is removed
            return None
        if self.removed_there.pop(key, None) is not None:  # somebody put it into a collection again
            self.note(("removed", key), "")
            thing.use_fake_user = False
            key = new_key()
        subject = self.deleted_here.pop(key, None)
        if subject is not None:
            self.removals = [each for each in self.removals if each is not subject]
            subject.known_as, subject.alone = known_as(thing), False
            if not subject.node.exists:
                subject.forget()
        else:
            subject = ObjectSubject(known_as(thing), key)
            subject.read_kept(thing, self.key)
            self.grown += 1
        if thing.library is None and key_of(thing) != key:
            thing[PROPERTY] = {"key": key}
        self.objects[key] = subject
        return subject

    def _deleted(self, subject):
        """Here; what it showed may be needed again."""
        self.contents.without(subject.content, subject)
        self.deleted_here[subject.key] = subject
        self.note(("others'", subject.key), "")
        self.clean(subject)
        if subject.node.exists:
            self.removals.append(subject)
        while len(self.deleted_here) > MOST_GONE:
            self.deleted_here.pop(next(iter(self.deleted_here)))
