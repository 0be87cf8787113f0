"""Objects that were removed at the wall, or deleted here: undo on either side brings them back."""
import bpy

from .subjects import PROPERTY, known_as


def take_out(link, subject, thing):
    """Of its collections; the file keeps it."""
    subject.away = [each.name for each in thing.users_collection] or subject.away
    for each in thing.users_collection:
        if each.library is None:
            each.objects.unlink(thing)
    if thing.users_collection:
        said = (f"{subject.name} was removed at the wall; here it stays in {thing.users_collection[0].name}, which is "
                f"of a library")
        link.staying[subject.known_as] = subject.key
        return link.note(("removed", subject.key), said)
    thing.use_fake_user = True
    link.by_name.pop(subject.known_as, None)
    link.note(("removed", subject.key),
              f"{subject.name} was removed at the wall: it is in no collection now, and the file keeps it")
    return None


def put_back(link, subject):
    thing = subject.get()
    if thing is None:
        return make_again(link, subject)
    for name in subject.away:
        collection = bpy.data.collections.get(name) or link.collection
        if collection.library is None and thing not in collection.objects.values():
            collection.objects.link(thing)
    thing.use_fake_user = False
    link.staying.pop(subject.known_as, None)
    link.note(("removed", subject.key), "")
    return _linked_again(link, subject, thing)


def make_again(link, subject):
    """It was deleted here, or put into no collection of ours, and its removal has been taken back at the wall."""
    thing = subject.get()
    if thing is None:
        data = link.contents.remains_of(subject)
        if data is None and subject.remains[1]:
            link.note(("lost", subject.key),
                      f"{subject.name} came back at the wall; its data are gone here, and only its place is")
        thing = bpy.data.objects.new(subject.name, data)
        link.wants_step = "Objects that came back at the wall"
    thing[PROPERTY] = {"key": subject.key}
    if not {link.collection, *link.collection.children_recursive}.intersection(thing.users_collection):
        link.collection.objects.link(thing)
    subject.known_as = known_as(thing)
    parent = subject.parent.get() if subject.parent and subject.parent.key in link.objects else None
    if parent is not None:
        thing.parent = parent
    _linked_again(link, subject, thing)
    subject.put(link, subject.core.there)


def step_of_undo(said):
    """For objects that were made or hung elsewhere behind Blender's last step. Its undo keeps as it stands what is the
    same in both steps: with a pointer to an object that the earlier step does not know, Blender 3.4 crashes."""
    bpy.ops.ed.undo_push(message=said)


def _linked_again(link, subject, thing):
    link.objects[subject.key] = link.by_name[subject.known_as] = subject
    if subject.parent is not None and subject.parent.key not in link.objects:
        subject.parent = None
    link.contents.shown_again(subject, thing)
