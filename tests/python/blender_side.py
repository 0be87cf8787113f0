"""Within Blender: the add-on as a person installs it, a wall of real processes, and a pump that is called as Blender's
timer would. `blender --background --factory-startup --python blender_side.py -- MODULE [WORD…]` runs the tests of a
module, or of one class in it."""
import os
import pathlib
import sys
import time
import unittest

import bpy

HERE = pathlib.Path(__file__).resolve().parent
BUILD = pathlib.Path(os.environ.get("TESSERA_BUILD", HERE.parents[1] / "build"))
sys.dont_write_bytecode = True
sys.path[:0] = [str(HERE)]
PUMPS = 12000
PERIOD = 0.005  # s, between two pumps


def install():
    """From its zip, with the package that is in it."""
    done = bpy.ops.preferences.addon_install(filepath=str(BUILD / "blender/tessera_link.zip"))
    assert done == {"FINISHED"}, done
    assert bpy.ops.preferences.addon_enable(module="tessera_link") == {"FINISHED"}
    import tessera_link.package

    return tessera_link.package.find()


def update():
    """What Blender's window would do before the next frame: handlers are told what has changed."""
    bpy.context.view_layer.update()


def pause(seconds=PERIOD):
    """Waits as Blender's timer does between two pumps, and a hand between two steps of a drag."""
    time.sleep(seconds)  # the pace itself is wanted: no event ends it


def until(what, condition, most=PUMPS):
    """How many pumps it took."""
    from tessera_link import pump

    for pumps in range(1, most + 1):
        update()
        link = pump.pump()
        if condition():
            return pumps
        pause()
    said = ("" if link is None
            else f": {link.courier.state} {link.courier.message}; {link.counts}; {list(link.notes.values())[:5]}")
    raise AssertionError(f"not within {most} pumps: {what}{said}")


def settle():
    """All that is to be sent has been granted."""
    from tessera_link import pump

    return until("all is granted", lambda: pump.link is not None and pump.link.idle)


def start(collection, address, **words):
    from tessera_link import pump

    link = pump.start(collection, address, **words)
    until("linked", lambda: link.courier.state == "linked")
    settle()
    return link


def only():
    """An empty file with one collection."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    install_again()
    collection = bpy.data.collections.new("Stage")
    bpy.context.scene.collection.children.link(collection)
    return collection


def install_again():
    """Factory settings know no add-ons."""
    if "tessera_link" not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module="tessera_link")


def add(collection, name, data=None, at=(0, 0, 0), parent=None):
    thing = bpy.data.objects.new(name, data)
    collection.objects.link(thing)
    thing.location = at
    thing.parent = parent
    return thing


def box(name, size=1.0, materials=()):
    """Two materials: above the second one."""
    mesh = bpy.data.meshes.new(name)
    corners = [(x * size, y * size, z * size) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    mesh.from_pydata(corners, [], [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])
    for material in materials:
        mesh.materials.append(material)
    if len(materials) > 1:
        mesh.polygons[1].material_index = 1
    return mesh


def main():
    words = sys.argv[sys.argv.index("--") + 1:]
    install()
    module = __import__(words[0])
    names = words[1:]
    suite = unittest.TestSuite(unittest.defaultTestLoader.loadTestsFromName(name, module)
                               for name in names) if names else \
        unittest.defaultTestLoader.loadTestsFromModule(module)
    result = unittest.TextTestRunner(stream=sys.stderr, verbosity=1).run(suite)
    sys.exit(0 if result.wasSuccessful() and result.testsRun else 1)


if __name__ == "__main__":
    sys.modules["blender_side"] = sys.modules["__main__"]
    main()
