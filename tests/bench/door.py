#!/usr/bin/python3
"""What a program in Python costs and how fast it is: `door.py [--json FILE] [--seconds S]`, after `./deploy/build build programs tessera_python`.

One server and one host that draws nothing, on this machine. Three rows:
  swarm   10,000 Transforms are set 60 times a second, one packed column each time, for S seconds: how many frames came later than
          21 ms after the one before, and how much of a core Python took
  cloud   a million points with colours (16 MB) replaced: until it is granted
  single  one field of one node set: until it is granted, and how much of a core 60 of them a second take
No verdict on time here: tests/bench/README.md says why."""
import argparse
import json
import multiprocessing
import os
import pathlib
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("TESSERA_BUILD", ROOT / "build"))
sys.path[:0] = [str(BUILD / "python"), str(ROOT / "tests/python")]

import numpy as np  # noqa: E402

from live import Live  # noqa: E402

import tessera  # noqa: E402

LATE_S = 0.021


def empty(scene):
    scene.write('node { name: "top" }\n')
    scene.flush()
    return scene.name


def swarm_of(wall, count):
    with wall.edit() as edit:
        wall.create("/swarm")
        made = [edit.create(f"/swarm/b{at}") for at in range(count)]
    return wall.nodes(made)


def watch(address, pipe):
    """Says when each frame has come, from a process of its own: in the one that leads, a thread gets the interpreter up to 5 ms late
    (sys.getswitchinterval), and would take its own lateness for the wall's."""
    shown = []
    with tessera.connect(address) as wall, wall.follow("frames", timeout=10) as clock:
        pipe.send("ready")
        for _ in clock:
            shown.append(time.perf_counter())
            if pipe.poll():
                break
    pipe.send(shown)


def led(wall, address, nodes, places, seconds):
    """Set again whenever it is granted, for so long: the server grants once a frame, so that this goes at the wall's pace. Frames' times, times
    until granted, share of a core, edits a second."""
    granted = []
    mine, theirs = multiprocessing.Pipe()
    watcher = multiprocessing.get_context("spawn").Process(target=watch, args=(address, theirs), daemon=True)
    watcher.start()
    mine.recv()
    begin, busy = time.perf_counter(), time.process_time()
    turn = 0
    while time.perf_counter() < begin + seconds:
        before = time.perf_counter()
        places[:, 1] = np.sin(places[:, 0] + turn * 0.1)
        nodes.translations = places
        granted.append(time.perf_counter() - before)
        turn += 1
    busy = time.process_time() - busy
    lasted = time.perf_counter() - begin
    mine.send("enough")
    shown = mine.recv()
    watcher.join(10)
    return np.diff([at for at in shown if begin <= at <= begin + seconds]), np.array(granted), busy / lasted, turn / lasted


def row_of(name, gaps, granted, share, rate):
    return {"row": name, "edits_per_s": round(rate, 1), "frames": int(len(gaps) + 1), "late_frames": int((gaps > LATE_S).sum()),
            "frame_ms": {"p50": round(float(np.median(gaps)) * 1e3, 2), "p99": round(float(np.percentile(gaps, 99)) * 1e3, 2), "most": round(float(gaps.max()) * 1e3, 2)},
            "granted_ms": {"p50": round(float(np.median(granted)) * 1e3, 2), "most": round(float(granted.max()) * 1e3, 2)},
            "python_core_share": round(share, 3)}


def cloud(wall, count, times):
    points = np.random.default_rng(1).random((count, 3), np.float32)
    colours = np.random.default_rng(2).integers(0, 255, (count, 4), np.uint8)
    node = wall.show(points, "/cloud", colors=colours, radius=0.002)
    took = []
    for turn in range(times):
        points = points + np.float32(0.001)
        colours = colours ^ np.uint8(turn + 1)
        begin = time.perf_counter()
        wall.show(points, "/cloud", colors=colours, radius=0.002)
        took.append(time.perf_counter() - begin)
    node.remove()
    took = np.array(took) * 1e3
    return {"row": "cloud", "points": count, "bytes": points.nbytes + colours.nbytes,
            "granted_ms": {"p50": round(float(np.median(took)), 1), "least": round(float(took.min()), 1), "most": round(float(took.max()), 1)}}


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--json")
    options.add_argument("--seconds", type=float, default=60)
    options.add_argument("--rows", default="swarm,cloud,single")
    said = options.parse_args()
    rows = []
    with tempfile.NamedTemporaryFile("w", suffix=".tsct") as scene, Live(surface="none", scene=empty(scene)) as live, live.connect() as wall:
        for name in said.rows.split(","):
            if name == "swarm":
                nodes = swarm_of(wall, 10_000)
                places = np.random.default_rng(3).random((10_000, 3))
                rows.append(row_of("swarm", *led(wall, live.address, nodes, places, said.seconds)))
                wall["/swarm"].remove()
            elif name == "cloud":
                rows.append(cloud(wall, 1_000_000, 20))
            elif name == "single":
                nodes = swarm_of(wall, 1)
                rows.append(row_of("single", *led(wall, live.address, nodes, np.zeros((1, 3)), min(said.seconds, 10))))
                wall["/swarm"].remove()
            print(json.dumps(rows[-1]))
    if said.json:
        pathlib.Path(said.json).write_text(json.dumps({"rows": rows, "load": os.getloadavg(), "cores": os.cpu_count()}, indent=1) + "\n")


if __name__ == "__main__":
    main()
