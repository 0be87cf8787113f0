"""Within Blender: what blender.py measures."""
import json
import pathlib
import sys
import time

import bpy

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1] / "python")]
import blender_side  # noqa: E402
from blender_side import add, box, only, update  # noqa: E402

PERIOD = 1 / 60


def ticks(condition):
    """As Blender's timer does; how long it took."""
    from tessera_link import pump

    begun = due = time.monotonic()
    while not condition():
        due += PERIOD
        update()
        pump.pump()
        time.sleep(max(0.0, due - time.monotonic()))
    return round(time.monotonic() - begun, 3)


def linked(stage, address):
    from tessera_link import pump

    link = pump.start(stage, address)
    seconds = ticks(lambda: link.idle)
    return link, {"s": seconds, "batches": link.counts["batches"],
                  "longest_pump_ms": round(link.counts["longest_ms"], 1)}


def objects(count, address, moves):
    from tessera_link import pump

    stage = only()
    mesh = box("box", 0.2)
    for at in range(count):
        add(stage, f"{at}", mesh, (at % 100, at // 100, 0))
    link, first = linked(stage, address)
    thing = bpy.data.objects[str(count - 1)]
    sent, changes, begun, held = [], link.counts["sent"], time.process_time(), 0.0
    link.counts["longest_ms"] = 0.0
    for at in range(1000, 1000 + moves):
        sent.append((at, time.monotonic()))
        thing.location.z = at
        update()
        time.sleep(PERIOD)
        now = time.perf_counter()
        pump.pump()
        held += time.perf_counter() - now
    ticks(lambda: link.idle)
    drag = {"changes_sent": link.counts["sent"] - changes, "pump_ms": round(held / moves * 1e3, 3),
            "longest_pump_ms": round(link.counts["longest_ms"], 2),
            "core_share": round((time.process_time() - begun) / (sent[-1][1] - sent[0][1]), 3)}
    pump.stop()
    link, again = linked(stage, address)
    import tessera

    with tessera.connect(address) as wall:
        node, took = wall[f"/Stage/{count - 1}"], []
        for at in range(100):
            node.translation = (-at, 0, 0)
            took.append(ticks(lambda: thing.location.x == -at) * 1e3)
    took.sort()
    return {"objects": count, "link": first, "link_again": again, "sent": sent, "of_drag": drag,
            "back": {"p50_ms": took[50], "p99_ms": took[98]}}


def large(address):
    stage = only()
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=707, y_subdivisions=707)
    thing = bpy.context.object
    for each in thing.users_collection:
        each.objects.unlink(thing)
    stage.objects.link(thing)
    link, first = linked(stage, address)
    link.counts["longest_ms"] = 0.0
    thing.data.vertices[0].co.z = 1
    thing.data.update()
    update()
    edit = {"s": ticks(lambda: link.idle), "longest_pump_ms": round(link.counts["longest_ms"], 1)}
    return {"triangles": 2 * len(thing.data.polygons), "link": first, "edit": edit}


def main():
    name, address, moves, report = sys.argv[sys.argv.index("--") + 1:]
    blender_side.install()
    found = large(address) if name == "large" else objects({"few": 100, "many": 10000}[name], address, int(moves))
    pathlib.Path(report).write_text(json.dumps(found))


main()
