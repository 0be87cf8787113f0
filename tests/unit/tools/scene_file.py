"""Writes and reads scene files with nothing but scene.proto: scene_file.py write FILE, scene_file.py read FILE."""
import struct
import sys

import scene_pb2


def write(path):
    scene = scene_pb2.SceneFile(version=1)
    scene.blob.append(struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0))
    scene.blob.append(struct.pack("<3I", 0, 1, 2))
    saved = scene.saved
    saved.root = 1
    root = saved.object.add(number=1, child=[2])
    root.node.SetInParent()
    node = saved.object.add(number=2, child=[4])
    node.node.name = "Größe"
    node.node.core = 3
    place = saved.object.add(number=3).transform
    place.translation[:] = [0.1, -2, 1e-300]
    place.rotation[:] = [0, 1, 0, 0]
    saved.object.add(number=4).node.core = 5
    shape = saved.object.add(number=5).geometry
    shape.positions, shape.indices = 1, 2
    motion = saved.object.add(number=6).motion
    motion.target = 3
    motion.mode = scene_pb2.Saved.Motion.MODE_PING_PONG
    holder = saved.object.add(number=7)
    holder.node.core = 6
    node.child.append(7)
    with open(path, "wb") as out:
        out.write(scene.SerializeToString())


def read(path):
    with open(path, "rb") as file:
        scene = scene_pb2.SceneFile.FromString(file.read())
    objects = {held.number: held for held in scene.saved.object}

    def show(number, depth):
        held = objects[number]
        core = objects.get(held.node.core)
        kind = core.WhichOneof("value") if core else "-"
        line = "  " * depth + (held.node.name or "(unnamed)") + " " + kind
        if kind == "transform":
            line += " " + " ".join(repr(x) for x in core.transform.translation)
        if kind == "geometry":
            line += " %d bytes" % len(scene.blob[core.geometry.positions - 1])
        if kind == "motion":
            line += " " + scene_pb2.Saved.Motion.Mode.Name(core.motion.mode)
        print(line)
        for child in held.child:
            show(child, depth + 1)

    show(scene.saved.root, 0)


{"write": write, "read": read}[sys.argv[1]](sys.argv[2])
