"""Objects that were removed at the wall, or deleted here: undo on either side brings them back."""
import bpy

from .subjects import PROPERTY, MeshSubject


def take_out(link, subject, thing):
    """Of its collections; the file keeps it."""
    subject.away = [each.name for each in thing.users_collection] or subject.away
    for each in thing.users_collection:
        each.objects.unlink(thing)
    thing.use_fake_user = True
    link.by_name.pop(subject.name, None)
    link.note(("removed", subject.key), f"{subject.name} was removed at the wall: it is in no collection now, and the file keeps it")


def put_back(link, subject):
    thing = subject.get()
    if thing is None:
        return make_again(link, subject)
    for name in subject.away:
        collection = bpy.data.collections.get(name) or link.collection
        if thing.name not in collection.objects:
            collection.objects.link(thing)
    thing.use_fake_user = False
    link.note(("removed", subject.key), "")
    return _linked_again(link, subject, thing)


def make_again(link, subject):
    """It was deleted here, and its removal has been taken back at the wall."""
    kind, name = subject.remains
    kept = {"MESH": bpy.data.meshes, "LIGHT": bpy.data.lights, "CAMERA": bpy.data.cameras, "CURVE": bpy.data.curves,
            "SURFACE": bpy.data.curves, "FONT": bpy.data.curves, "META": bpy.data.metaballs}.get(kind)
    data = kept.get(name) if kept is not None else None
    if data is None and name:
        link.note(("lost", subject.key), f"{subject.name} came back at the wall; its data are gone here, and only its place is")
    thing = bpy.data.objects.new(subject.name, data)
    thing[PROPERTY] = {"key": subject.key}
    link.collection.objects.link(thing)
    subject.name = thing.name
    parent = subject.parent.get() if subject.parent and subject.parent.key in link.objects else None
    if parent is not None:
        thing.parent = parent
    _linked_again(link, subject, thing)
    subject.put(link, subject.core.there)


def _linked_again(link, subject, thing):
    link.objects[subject.key] = link.by_name[subject.name] = subject
    if subject.parent is not None and subject.parent.key not in link.objects:
        subject.parent = None
    if isinstance(subject.content, MeshSubject):
        known = link.contents["meshes"]
        subject.content.users[subject] = None
        if subject.content not in known.values():
            known.setdefault(("mesh", thing.data.name, ()) if thing.type == "MESH" and thing.data else ("object", subject.key), subject.content)
