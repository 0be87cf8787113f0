"""What the wall had when we came: each object that is there already is taken up, and nothing is made twice."""
import itertools

from .mirror import Mirror
from .removals import make_again, put_back
from .subjects import PROPERTY, MaterialSubject


def take_up(link, found):
    """A step for each object; between them Blender may go on."""
    if link.collection is None:
        return
    _contents(link, found)
    yield
    link.stamp = found.stamp
    link.root.number, link.root_core.number, link.marks.number = found.root, found.root_core, found.marks
    for mirror in (link.root, link.root_core, link.marks, link.root_mark):
        mirror.refused()
        if not found.root:
            mirror.forget()
        link.courier.watch(mirror)
    if found.root:
        link.root.core = link.root_core
        link.root_core.in_step(found.root_stand, found.root_stand)
    _by_names(link, found)
    yield
    link.superfluous = [node for node in link.superfluous if found.same and node.number in found.twice]
    _twins(link, found)
    numbers = sorted(link.objects.items(),
                     key=lambda each: found.objects[each[0]].node if each[0] in found.objects else 0)
    for key, subject in numbers:
        if key in found.objects:
            if found.same and subject.node.number in found.twice:
                link.superfluous.append(_node(subject.node.number))
            subject.node.number = found.objects[key].node
            link.courier.watch(subject.node)
    yield
    skipped = itertools.count(1)
    for key, subject in numbers:
        if link.objects.get(key) is not subject or subject.get() is None:
            continue
        each = found.objects.pop(key, None)
        if each is not None and subject.is_as(link, each):
            subject.watch(link)
            if next(skipped) % 64 == 0:
                yield
            continue
        if each is not None:
            subject.adopt(link, each)
        elif found.root and found.stamp == (subject.was or (subject.kept or {}).get("root")):
            subject.node.gone()
            link.removed(subject)
            continue
        else:
            subject.forget()
        link.dirty(subject)
        yield
    for key, each in found.objects.items():
        if key in link.deleted_here and link.deleted_here[key].node.number:
            subject = link.deleted_here[key]
            subject.node.number = each.node
            link.removals.append(subject)
        elif key in link.deleted_here:  # its removal was granted, and has been taken back there
            subject = link.deleted_here.pop(key)
            make_again(link, subject)
            subject.adopt(link, each)
        elif key in link.removed_there:
            subject = link.removed_there.pop(key)
            put_back(link, subject)
            subject.adopt(link, each)
    for subject in (*link.deleted_here.values(), *link.removed_there.values()):
        if subject.key not in found.objects:
            subject.forget()
    others = found.others + sum(key not in link.deleted_here and key not in link.objects for key in found.objects)
    link.note(("others",), others and f"{others} nodes below the collection at the wall are not of this file")
    link.courier.begin()


def _twins(link, found):
    """Roots that were under way when a link broke, and were granted after nothing had been found."""
    others = []
    for (number, stamp), path in found.twins.items():
        if stamp in link.stamps and stamp != found.stamp:
            link.superfluous.append(_node(number))
        else:
            others.append(path)
    link.note(("twins",), others and f"the wall shows this collection once more at {', '.join(others[:3])}: another "
                                     f"link made that, or it is a copy; remove it there if it is not wanted")


def _node(number):
    found = Mirror("Node")
    found.number = number
    return found


def _by_names(link, found):
    """A file that was never saved since it was linked has no keys: names stand for them."""
    if not found.root:
        return
    nameless = {subject.name: key for key, subject in link.objects.items() if key not in found.objects
                and not subject.was and not subject.kept}
    for key in list(found.objects):
        each = found.objects[key]
        own = nameless.pop(each.name, None) if key not in link.objects else None
        if own is None:
            continue
        subject = link.objects.pop(own)
        subject.key = key
        link.objects[key] = subject
        if subject.get().library is None:
            subject.get()[PROPERTY] = {"key": key}


def _contents(link, found):
    """Of what is kept beside the tree, that which the wall still has."""
    parts = [part for each in found.objects.values() for part in each.parts]
    geometries = {core: material for _, core, kind, material in parts if kind == "Geometry"}
    materials_there, cores_there = set(geometries.values()), {core for _, core, _, _ in parts}
    for subject in itertools.chain(link.contents.materials.values(), link.contents.lights.values()):
        if not found.same or subject.mirror.number not in (
            materials_there if isinstance(subject, MaterialSubject) else cores_there):
            subject.mirror.forget()
        subject.mirror.refused()
        link.courier.watch(subject.mirror)
        link.told(subject.mirror, found.looks.get(subject.mirror.number, {}))
        link.dirty(subject)
    materials = [subject.mirror for subject in link.contents.materials.values() if subject.mirror.number]
    images_there = {mirror.here.get("baseColorImage") for mirror in materials}
    for subject in link.contents.images.values():
        if subject.mirror not in images_there:
            subject.mirror.forget()
        subject.mirror.refused()
        link.courier.watch(subject.mirror)
    for subject in link.contents.meshes.values():
        whole = found.same and subject.cores and all(core.number in geometries for core in subject.cores.values())
        if not whole or subject.unsent:
            link.dirty(subject)
        if not whole:
            subject.cores, subject.found = {}, {}
        for core in subject.cores.values():
            core.refused()
            link.courier.watch(core)
