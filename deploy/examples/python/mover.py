#!/usr/bin/python3
"""A node is moved 60 times a second, in one of two manners.

    mover.py [ADDR:PORT] NODE --paced | --queued [--count N]

Paced: a place for each frame that the wall shows. The movement is even, and on a slow wall it takes longer.
Queued: places come by a clock of their own, as a sensor's do, and wait for nobody. The newest one is sent. On a slow
wall the movement keeps its time, and some places are never seen."""
import argparse
import itertools
import math
import queue
import threading
import time

import tessera

RATE = 60  # places a second


def places(count):
    """Half a metre to and fro, once in four seconds."""
    for place in range(count) if count else itertools.count():
        yield 0.5 * math.sin(place / RATE * math.pi / 2)


def paced(wall, move, count):
    """One place for each frame: the wall is the clock."""
    sent = 0
    for x, _ in zip(places(count), wall.frames()):
        move(x)  # returns when the frame that does it has been made
        sent += 1
    return sent


def queued(move, count):
    """Places wait in a queue of one, where a newer one takes the older one's place: what is sent is never stale."""
    newest = queue.Queue(maxsize=1)

    def put(x):
        while True:
            try:
                return newest.put_nowait(x)
            except queue.Full:
                try:
                    newest.get_nowait()
                except queue.Empty:
                    pass

    def sensor():
        tick = time.monotonic()
        for x in places(count):
            tick += 1 / RATE
            time.sleep(max(0, tick - time.monotonic()))
            put(x)
        newest.put(None)  # behind the last one

    threading.Thread(target=sensor, daemon=True).start()
    sent = 0
    for x in iter(newest.get, None):
        move(x)
        sent += 1
    return sent


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("address", nargs="?",
                         help="of the server, or a page's link; without: TESSERA_SERVER, or this machine's one wall")
    options.add_argument("node", help="with a Transform")
    manner = options.add_mutually_exclusive_group(required=True)
    manner.add_argument("--paced", action="store_true", help="in step with the wall")
    manner.add_argument("--queued", action="store_true", help="by a clock of its own")
    options.add_argument("--count", type=int, default=0, help="so many places, then it ends; without: until Ctrl+C")
    said = options.parse_args()

    with tessera.connect(said.address, name="mover") as wall:
        node = wall[said.node]
        x, y, z = node.translation

        def move(offset):
            node.translation = (x + offset, y, z)

        try:
            sent = paced(wall, move, said.count) if said.paced else queued(move, said.count)
        finally:
            move(0)
    print(f"moved {said.node} {sent} times, {'paced' if said.paced else 'queued'}")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
