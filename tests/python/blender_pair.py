"""Within Blender: one of two that have the same file open, and are linked to the same wall. What they wait for are
files in a folder."""
import json
import os
import sys

import blender_side
import bpy
from blender_side import add, box, only, settle, start, until, update
from eventually import PATIENCE, eventually


def make(path):
    stage = only()
    for at, name in enumerate(("box", "other", "shared")):
        add(stage, name, bpy.data.meshes.get("box") or box("box"), (10 * at, 0, 0))
    bpy.ops.wm.save_as_mainfile(filepath=path)


def come(folder, path, address, name):
    """`name`: "a" or "b"."""
    from tessera_link import pump
    from tessera_link.courier import Courier

    def there(what):
        return os.path.exists(os.path.join(folder, what))

    def say(what, **told):
        with open(os.path.join(folder, f"{name}.{what}.part"), "w") as file:
            json.dump(told, file)
        os.rename(file.name, file.name[:-len(".part")])

    def drag(thing, values):
        for at in values:
            thing.location.x = at
            update()
            pump.pump()

    def told():
        return {"objects": len(stage.objects), "notes": list(pump.link.notes.values()),
                "sent": pump.link.counts["sent"],
                "at": {each.name: tuple(each.location) for each in stage.objects}}

    bpy.ops.wm.open_mainfile(filepath=path)
    blender_side.install_again()
    stage = bpy.data.collections["Stage"]
    until("both begin", lambda: there("begin"))
    first = Courier._take_up

    def both_find_nothing(courier, wall, role, patient=False):
        """The worst of moments: each takes itself for the first one."""
        found = first(courier, wall, role)
        Courier._take_up = first
        say("found", root=found.root)
        # It waits in the courier's thread: Blender's pumps go on meanwhile
        eventually(lambda: there("a.found") and there("b.found"), 10 * PATIENCE)
        return found

    Courier._take_up = both_find_nothing
    start(stage, address)
    say("linked")
    until("both are linked", lambda: there("a.linked") and there("b.linked"))
    settle()
    if name == "a":
        drag(bpy.data.objects["box"], range(1, 31))
    until("the other's drag is seen", lambda: bpy.data.objects["box"].location.x == 30)
    say("seen")
    until("both have seen it", lambda: there("a.seen") and there("b.seen"))
    drag(bpy.data.objects["shared"], range(100, 160) if name == "a" else range(200, 260))  # both at once
    settle()
    say("dragged")
    until("both have let go", lambda: there("a.dragged") and there("b.dragged"))
    until("it is looked at", lambda: there("look"))
    say("looked", **told())
    until("the server goes", lambda: pump.link.courier.state == "reconnecting")
    until("linked again", lambda: pump.link.courier.state == "linked")
    settle()
    say("again")
    until("it is looked at again", lambda: there("end"))
    say("ended", **told())


words = sys.argv[sys.argv.index("--") + 2:]
{"make": make, "come": come}[words[0]](*words[1:])
sys.exit(0)
