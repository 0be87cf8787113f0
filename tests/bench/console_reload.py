"""The row `reload` of console.py: a large file is replaced again and again while somebody edits and somebody
listens."""
import json
import os
import pathlib
import select
import tempfile
import time

from console import Beside, door_of, frames, over
from console_socket import WebSocket
from live import Live

PAIRS = 50_000  # of a node and the one below it, which shows the mesh
CHANGED = 500  # of the file, each time
EDITED = 100  # by a person, in turn; the file leaves them alone


def scene(shift):
    """Behind whoever looks: what is measured is the change, not the drawing."""
    yield 'mesh { name: "tile" position: [0, 0, 0, 1, 0, 0, 0, 1, 0] index: [0, 1, 2] }\n'
    for i in range(PAIRS):
        x = i % 250 + (shift if EDITED <= i < EDITED + CHANGED else 0)
        yield (f'node {{ name: "n{i}" transform {{ translation {{ x: {x} y: {i // 250} z: 100 }} }} '
               f'node {{ name: "tile" geometry {{ mesh: "tile" }} }} }}\n')


def edit(door, token, pipe):
    """A node in each frame, as a person's hand on a slider."""
    hand = WebSocket(door, token)
    pipe.send("ready")
    count = 0
    while not pipe.poll():
        count += 1
        hand.ask(count, "MoveNode", node=f"/n{count % EDITED}", translation=[0.001 * count, 1, 100])
        hand.read()
        time.sleep(1 / 60)
    hand.close()
    pipe.send(count)


def hear(door, token, pipe):
    """When lists came that changed more than a hand does."""
    ear = WebSocket(door, token, path="/socket?changes=1")
    heard = []
    pipe.send("ready")
    while not pipe.poll():
        if not select.select([ear.socket], [], [], 0.05)[0]:
            continue
        said = ear.read()
        if "changes" in said and not said["changes"].get("whole") and len(json.dumps(said)) > 20 * CHANGED:
            heard.append(time.time())
    ear.close()
    pipe.send(heard)


def rows(seconds):
    with tempfile.TemporaryDirectory(prefix="tessera-reload-") as folder:
        folder = pathlib.Path(folder)
        file = folder / "many.tsct"
        turns = [folder / f"turn{shift}" for shift in range(2)]
        for shift, turn in enumerate(turns):
            turn.write_text("".join(scene(shift)))
        os.link(turns[0], file)
        with Live(wall="2x2", surface="none", size="960x540", scene=file, options=["--rate", "60", "--reload"]) as live:
            replaced = []

            def replace():
                if live.log("server").count("taken in again") < len(replaced):
                    return
                os.link(turns[(len(replaced) + 1) % 2], folder / "new")
                replaced.append(time.time())
                os.replace(folder / "new", file)

            door, token = door_of(live)
            with Beside(edit, door, token):
                without = frames(live, seconds)
                with Beside(hear, door, token) as ear:
                    meanwhile = frames(live, seconds, replace)
                    deadline = time.monotonic() + 60
                    while live.log("server").count("taken in again") < len(replaced) and time.monotonic() < deadline:
                        time.sleep(0.05)
    took = [next((when - at for when in ear.result if when > at), None) for at in replaced]
    heard = [one for one in took if one is not None]
    return [{"row": "reload", "nodes": 2 * PAIRS, "changed": CHANGED, "without": without, "with": meanwhile,
             "replaced": len(replaced), "heard": len(heard),
             "heard_p50_ms": round(over(heard, 0.5) * 1e3) if heard else None,
             "heard_longest_ms": round(max(heard) * 1e3) if heard else None}]
