"""What objects show: materials, pictures, lights and meshes, each once, whoever shows it."""
import bpy

from . import meshes
from .lights import TYPES as LIGHTS
from .subjects import ImageSubject, LightSubject, MaterialSubject, MeshSubject, known_as

_PLACE_ONLY = {"EMPTY", "CAMERA"}
_KINDS = {"MESH": "meshes", "LIGHT": "lights", "CAMERA": "cameras", "CURVE": "curves", "SURFACE": "curves",
          "FONT": "curves",
          "META": "metaballs"}


class Contents:
    """Found by what they are known as in Blender."""

    def __init__(self, link):
        self._link = link
        self.materials, self.images, self.lights, self.meshes = {}, {}, {}, {}

    def of(self, kind):
        return getattr(self, kind)

    # ---- what Blender says

    def mark(self, kind, known):
        """Something of it has changed."""
        for subject in self.of(kind).values():
            if subject.known_as == known:
                self._link.dirty(subject)

    def mark_material(self, known):
        materials = self.materials
        if known not in materials:
            lost = [each for each in materials if bpy.data.materials.get(each) is None]
            if len(lost) == 1:  # it has another name
                materials[known] = materials.pop(lost[0])
                materials[known].known_as = known
        if known in materials:
            self._link.dirty(materials[known])

    # ---- which one an object shows

    def choose(self, subject, thing):
        """Shared with whoever shows the same."""
        link, before, content = self._link, subject.content, None
        subject.remains = (thing.type, known_as(thing.data) if thing.data else None)
        said = ""
        if thing.type in meshes.KINDS:
            content = self._mesh_of(subject, thing)
        elif thing.type == "LIGHT" and thing.data.type in LIGHTS:
            content = self._light_of(thing.data)
        elif thing.type not in _PLACE_ONLY or thing.instance_type != "NONE":
            kind = f"{thing.data.type.lower()} light" if thing.type == "LIGHT" else thing.type.lower()
            kind += "" if thing.instance_type == "NONE" else " with instances"
            said = f"{thing.name} ({kind}): only its place is shown"
        link.note(("kind", subject.key), said)
        if content is not before:
            if before is not None:
                self.without(before, subject)
            subject.content = content
            link.dirty(subject)
        if isinstance(content, MeshSubject) and subject not in content.users:
            content.users[subject] = None

    def without(self, content, user):
        """It shows this no more."""
        if isinstance(content, MeshSubject):
            content.users.pop(user, None)
            if not content.users:
                self._link.clean(content)
                self._forget_mesh(content)

    def shown_again(self, subject, thing):
        """By one that came back."""
        content = subject.content
        if isinstance(content, MeshSubject):
            content.users[subject] = None
            own = thing.type != "MESH" or not thing.data
            key = ("object", subject.key) if own else ("mesh", known_as(thing.data), ())
            if self.meshes.get(content.found_by) is not content and key not in self.meshes:
                self._find_mesh_by(key, content)

    @staticmethod
    def remains_of(subject):
        """What it showed before it was deleted here, if that is still there."""
        kind, known = subject.remains
        kept = getattr(bpy.data, _KINDS[kind]) if kind in _KINDS and known else None
        return kept.get(known) if kept is not None else None

    def _find_mesh_by(self, key, content):
        self.meshes[key], content.found_by = content, key

    def _forget_mesh(self, content):
        if self.meshes.get(content.found_by) is content:
            del self.meshes[content.found_by]

    def _light_of(self, light):
        key = (known_as(light), light.type)
        content = self.lights.get(key)
        if content is None:
            content = self.lights[key] = LightSubject(known_as(light), light.type)
            self._link.dirty(content)
        return content

    def _mesh_of(self, subject, thing):
        own = thing.type != "MESH" or any(each.show_viewport for each in thing.modifiers) or thing.data.shape_keys
        looks = tuple(slot.material and known_as(slot.material) for slot in thing.material_slots) if any(
            slot.link == "OBJECT" for slot in thing.material_slots) else ()
        key = ("object", subject.key) if own else ("mesh", known_as(thing.data), looks)
        content = self.meshes.get(key)
        if content is None:
            before = subject.content
            if isinstance(before, MeshSubject) and list(before.users) == [subject]:
                self._forget_mesh(before)
                content = before  # nobody else shows it: the same Geometry gets other arrays
            else:
                content = MeshSubject(known_as(thing.data))
            self._find_mesh_by(key, content)
            self._link.dirty(content)
        return content

    def material_of(self, material):
        known = known_as(material)
        if known not in self.materials:
            self.materials[known] = MaterialSubject(known)
        return self.materials[known]

    def image_of(self, image):
        known = known_as(image)
        if known not in self.images:
            self.images[known] = ImageSubject(known)
        return self.images[known]
