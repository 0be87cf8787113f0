"""Within Blender: a file that is linked, and, once Blender has been killed, opened and linked again."""
import signal
import sys

import blender_side
import bpy
from blender_side import add, box, only, start, update


def first(path, address, saved):
    collection = only()
    add(collection, "box", box("box"), (1, 2, 3))
    add(collection, "other", bpy.data.meshes["box"], (4, 5, 6))
    add(collection, "lamp", bpy.data.lights.new("lamp", "POINT"))
    bpy.ops.wm.save_as_mainfile(filepath=path)
    start(collection, address)
    if saved == "saved":
        bpy.ops.wm.save_mainfile()
    print("READY", flush=True)
    while True:
        signal.pause()


def second(path, address, saved):
    bpy.ops.wm.open_mainfile(filepath=path)
    blender_side.install_again()
    link = start(bpy.data.collections["Stage"], address)
    update()
    assert len(link.objects) == 3 and not link.notes, (link.objects, link.notes)
    assert tuple(bpy.data.objects["box"].location) == (7, 8, 9), bpy.data.objects["box"].location
    bpy.data.objects["other"].location.x = 40
    blender_side.settle()
    print("TAKEN UP", flush=True)


words = sys.argv[sys.argv.index("--") + 2:]
{"first": first, "second": second}[words[0]](*words[1:])
sys.exit(0)
