"""The collection that is linked: known by its key, whatever it is called, and whatever else is called so."""
import itertools

import bpy

from .subjects import PROPERTY, key_of, known_as


class Whole:
    """One collection with all in it; a scene's own has all of the scene."""

    def __init__(self, collection, key):
        self._key, self._thing, self.name = key, collection, collection.name
        self._scene = next((scene for scene in bpy.data.scenes if scene.collection == collection), None)
        self._of_scene = self._scene is not None
        self._known_as = self._known_first = known_as(self._scene or collection)
        self._sought, self._undone = True, False
        self.put_key()

    def put_key(self):
        """By which it is found again, here and in the file. A library's is known by the library and its name."""
        if self._thing.library is None and key_of(self._thing) != self._key:
            self._thing[PROPERTY] = {"key": self._key}

    def seek(self, undone=False):
        """Blender has others now; after undo none is the same in memory."""
        self._sought = False
        if undone:
            self._thing, self._undone = None, True

    def find(self, is_known):
        """None: it was removed here. `is_known`: whether an object is one that is linked."""
        try:
            if self._thing is not None:
                self.name = self._thing.name
                self._known_as = known_as(self._scene if self._of_scene else self._thing)
                return self._thing
        except ReferenceError:
            self._thing = None
        if not self._sought:
            self._sought = True
            self._search(is_known)
            self._undone = False
        return self._thing

    def objects(self):
        """Each once. Blender's own list of them is made anew after each change, which takes 0.1 s for 10,000."""
        return list(dict.fromkeys(_each_in(self._thing)))

    def stands_alone(self):
        """A copy in Blender has the key, too, and is another one."""
        for each in self._candidates():
            if each != self._thing and each.library is None and key_of(each) == self._key:
                del each[PROPERTY]

    def _candidates(self):
        return [scene.collection for scene in bpy.data.scenes] if self._of_scene else bpy.data.collections.values()

    def _named(self, known):
        found = (bpy.data.scenes if self._of_scene else bpy.data.collections).get(known)
        return found.collection if found is not None and self._of_scene else found

    def _search(self, is_known):
        keyed = [each for each in self._candidates() if key_of(each) == self._key]
        named = [each for each in map(self._named, (self._known_as, self._known_first)) if each is not None]
        found = next((each for each in named if each in keyed), keyed[0] if keyed else None)
        if found is None and self._known_as[1] is not None:
            found = next(iter(named), None)
        elif found is None and self._undone:  # it may go back to before it was linked, when it had no key
            found = next((each for each in named if not key_of(each) and any(map(is_known, _each_in(each)))), None)
        if found is not None:
            self._thing = found
            self._scene = next((scene for scene in bpy.data.scenes if scene.collection == found), None)
            self.put_key()


def _each_in(whole):
    return itertools.chain.from_iterable(each.objects for each in (whole, *whole.children_recursive))
