#!/usr/bin/python3
"""What a program in Python costs and how fast it is: `door.py [--json FILE] [--seconds S]`, after `./deploy/build build
programs tessera_python`.

One server and one host that draws nothing, on this machine. Rows:
  swarm   10,000 Transforms are set 60 times a second, one packed column each time, for S seconds: how many frames came
  later than
          21 ms after the one before, and how much of a core Python took
  cloud   a million points with colours (16 MB) replaced: until it is granted
  single  one field of one node set: until it is granted, and how much of a core 60 of them a second take
  readers 8 and 40 sockets that each ask for pieces of 256 KiB without a pause: the wall's frames, a new socket's first
  answer, what the
          server keeps in memory; before it the same with a process that burns its core instead, and with neither
  keys    what sealed links cost beside plain ones, in turns: bytes a second, round trips, handshakes (bench_sealed),
  and the barrier of
          four hosts that draw nothing, at 60 frames a second for S seconds in all
No verdict on time here: tests/bench/README.md says why."""
import argparse
import json
import multiprocessing
import os
import pathlib
import selectors
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("TESSERA_BUILD", ROOT / "build"))
sys.path[:0] = [str(BUILD / "python"), str(ROOT / "tests/python")]

import numpy as np  # noqa: E402

from live import Live  # noqa: E402
from console_socket import WebSocket, array_name  # noqa: E402

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
    """Says when each frame has come, from a process of its own: in the one that leads, a thread gets the interpreter up
    to 5 ms late (sys.getswitchinterval), and would take its own lateness for the wall's."""
    shown = []
    with tessera.connect(address) as wall, wall.follow("frames", timeout=10) as clock:
        pipe.send("ready")
        for _ in clock:
            shown.append(time.perf_counter())
            if len(shown) > 1 and pipe.poll():  # two at least: between them there is a time
                break
    pipe.send(shown)


def led(wall, address, nodes, places, seconds):
    """Set again whenever it is granted, for so long: the server grants once a frame, so that this goes at the wall's
    pace. Frames' times, times until granted, share of a core, edits a second."""
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
    return np.diff([at for at in shown if begin <= at <= begin + seconds]), np.array(
        granted), busy / lasted, turn / lasted


def row_of(name, gaps, granted, share, rate):
    return {"row": name, "edits_per_s": round(rate, 1), "frames": int(len(gaps) + 1),
            "late_frames": int((gaps > LATE_S).sum()),
            "frame_ms": {"p50": round(float(np.median(gaps)) * 1e3, 2),
                         "p99": round(float(np.percentile(gaps, 99)) * 1e3, 2),
                         "most": round(float(gaps.max()) * 1e3, 2)},
            "granted_ms": {"p50": round(float(np.median(granted)) * 1e3, 2),
                           "most": round(float(granted.max()) * 1e3, 2)},
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
            "granted_ms": {"p50": round(float(np.median(took)), 1), "least": round(float(took.min()), 1),
                           "most": round(float(took.max()), 1)}}


PIECE = 256 << 10  # bytes


def hammer(door, token, count, questions, pipe):
    """Asks on so many sockets as fast as they take it, and reads all answers: bytes read, sockets that were closed,
    those not let in."""
    ready = selectors.DefaultSelector()
    left, sockets, refused = {}, [], 0
    for _ in range(count):
        try:
            sockets.append(WebSocket(door, token))
        except ConnectionError:
            refused += 1
    for one in (each.socket for each in sockets):
        one.setblocking(False)
        ready.register(one, selectors.EVENT_READ | selectors.EVENT_WRITE)
        left[one] = questions
    pipe.send("ready")
    read, closed, room = 0, 0, bytearray(1 << 20)
    while left and not pipe.poll():
        for key, what in ready.select(0.1):
            one = key.fileobj
            try:
                if what & selectors.EVENT_READ:
                    got = one.recv_into(room)
                    read += got
                    if not got:
                        raise ConnectionError
                if what & selectors.EVENT_WRITE:
                    left[one] = left[one][one.send(left[one]):] or questions
            except BlockingIOError:
                pass
            except OSError:
                ready.unregister(one)
                del left[one]
                closed += 1
    pipe.send((read, closed, refused))


def burn(pipe):
    pipe.send("ready")
    while not pipe.poll():
        sum(range(10_000))
    pipe.send((0, 0, 0))


def beside(live, door, token, seconds, target, *arguments):
    """Frames, and how long a new socket waits for its first answer, while a process does `target`."""
    context = multiprocessing.get_context("spawn")
    begin = time.perf_counter()
    other = None
    if target:
        mine, theirs = multiprocessing.Pipe()
        other = context.Process(target=target, args=(*arguments, theirs), daemon=True)
        other.start()
        mine.recv()
    clock, clocks = multiprocessing.Pipe()
    watcher = context.Process(target=watch, args=(live.address, clocks), daemon=True)
    watcher.start()
    clock.recv()
    waited = []
    begin, memory = time.perf_counter(), 0
    while time.perf_counter() < begin + seconds:
        asked = time.perf_counter()
        with WebSocket(door, token) as one:
            one.ask(1, "GetStatus")
            one.read()
            waited.append(time.perf_counter() - asked)
        memory = max(memory, resident(live.server))
        time.sleep(0.1)
    clock.send("enough")
    shown = clock.recv()
    watcher.join(10)
    read, closed, refused = 0, 0, 0
    if other:
        mine.send("enough")
        read, closed, refused = mine.recv()
        other.join(10)
    gaps = np.diff([at for at in shown if begin <= at])
    return {"frames": int(len(gaps) + 1),
            "frame_ms": {"p50": round(float(np.median(gaps)) * 1e3, 2),
                         "p99": round(float(np.percentile(gaps, 99)) * 1e3, 2),
                         "most": round(float(gaps.max()) * 1e3, 2)},
            "first_answer_ms": {"p50": round(float(np.median(waited)) * 1e3, 1),
                                "most": round(float(max(waited)) * 1e3, 1)},
            "resident_MiB": memory, "read_MiB": read >> 20, "closed": closed, "refused": refused}


def resident(process):
    for line in pathlib.Path(f"/proc/{process.pid}/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) >> 10
    return 0


def readers(live, wall, seconds):
    points = np.random.default_rng(4).random((2_000_000, 3), np.float32)
    node = wall.show(points, "/points", radius=0.002)
    door, _, token = live.link().removeprefix("http://").partition("/?token=")
    array = array_name(points.reshape(-1).view(np.uint8))
    questions = b"".join(WebSocket.question(at, "GetArray", blob=array, offset=at * PIECE % points.nbytes, length=PIECE)
                         for at in range(200))
    rows = [{"row": "readers", "beside": "nothing", **beside(live, door, token, seconds, None)},
            {"row": "readers", "beside": "one that burns its core", **beside(live, door, token, seconds, burn)}]
    for count in (8, 40):
        rows.append({"row": "readers", "beside": f"{count} sockets",
                     **beside(live, door, token, seconds, hammer, door, token, count, questions)})
    node.remove()
    return rows


HOSTS = ("lower-left", "lower-right", "upper-left", "upper-right")


def barrier_of(keys, frames):
    """Of a wall of four hosts that draw nothing: milliseconds. `keys`: a folder of them, or None."""
    sealed = ["--keys", keys] if keys else []
    with tempfile.TemporaryDirectory() as place, tempfile.NamedTemporaryFile("w", suffix=".tsct") as scene:
        report = pathlib.Path(place) / "report.json"
        server = subprocess.Popen([BUILD / "bin/tessera-server", "--wall", "2x2", "--scene", empty(scene), "--frames",
                                   str(frames), "--rate", "60",
                                   "--no-console", "--report", report,
                                   *sealed], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        address = server.stdout.readline().split()[-1]
        hosts = [subprocess.Popen([BUILD / "bin/tessera-client", "--server", address, "--host", host, "--surface",
                                   "none", *sealed],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for host in HOSTS]
        server.communicate()
        for host in hosts:
            host.wait()
        return json.loads(report.read_text())["sync"]["barrier_ms"]


def keys(seconds):
    rows = [json.loads(line) for line in subprocess.run([BUILD / "bin/bench_sealed"], check=True, capture_output=True,
                                                        text=True).stdout.splitlines()]
    with tempfile.TemporaryDirectory() as place:
        folder = place + "/keys"
        for verb in (["init", "--wall", "2x2"], *(["host", host] for host in HOSTS)):
            subprocess.run([BUILD / "bin/tessera-keys", "--keys", folder, *verb], check=True, capture_output=True)
        turns = 5
        frames = max(60, int(60 * seconds / (2 * turns)))
        found = [(barrier_of(None, frames), barrier_of(folder, frames)) for _ in range(turns)]
    for what in ("p50", "p99"):
        plain, sealed = (float(np.median([pair[at][what] for pair in found])) for at in (0, 1))
        rows.append({"row": "barrier", "what": what, "plain_ms": plain, "sealed_ms": sealed,
                     "ratio": float(np.median([pair[1][what] / pair[0][what] for pair in found])),
                     **({"at_most": 1.3} if what == "p50" else {})})
    return rows


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--json")
    options.add_argument("--seconds", type=float, default=60)
    options.add_argument("--rows", default="keys,swarm,cloud,single,readers")
    said = options.parse_args()
    names = said.rows.split(",")
    rows = keys(said.seconds) if "keys" in names else []
    shown = 0
    with (tempfile.NamedTemporaryFile("w", suffix=".tsct") as scene, Live(surface="none", scene=empty(scene)) as live,
          live.connect() as wall):
        for name in names:
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
            elif name == "readers":
                rows += readers(live, wall, min(said.seconds, 10))
            print(*map(json.dumps, rows[shown:]), sep="\n")
            shown = len(rows)
    if said.json:
        pathlib.Path(said.json).write_text(json.dumps({"rows": rows, "load": os.getloadavg(), "cores": os.cpu_count()},
                                                      indent=1) + "\n")


if __name__ == "__main__":
    main()
