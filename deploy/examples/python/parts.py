#!/usr/bin/python3
"""Parts that move: an arm of three parts is built on a running wall, and its joints turn.

    parts.py [ADDR:PORT] [--frames N]

Each part hangs below the one before, so that it goes along when that one turns."""
import argparse
import math

import numpy as np

import tessera

# A box of 8 corners and 6 sides of four corners each, from its joint (the origin) upwards.
CORNERS = np.array([[x, y, z] for x in (-0.05, 0.05) for y in (0, 0.5) for z in (-0.05, 0.05)])
SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
COLOURS = ("#d04030", "#e0a020", "#3070c0")


def turned(angle):
    """A rotation about z, as fields want it: w, x, y, z."""
    return (math.cos(angle / 2), 0, 0, math.sin(angle / 2))


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("address", nargs="?",
                         help="of the server, or a page's link; without: TESSERA_SERVER, or this machine's one wall")
    options.add_argument("--frames", type=int, help="end after so many; without: go on until Ctrl+C")
    said = options.parse_args()

    with tessera.connect(said.address, name="parts") as wall:
        parts, path = [], ""
        for number, colour in enumerate(COLOURS):
            path += f"/part-{number + 1}" if path else "/arm"
            height = 0.5 if number else 1.0  # the first stands in the room, each other on the end of the one before
            parts.append(wall.show((CORNERS, SIDES), path, color=colour, at=(0, height, 0 if number else -1)))

        for turn, frame in enumerate(wall.frames()):
            # All joints at once: nobody sees a frame in which only some have turned.
            with wall.edit(undo="the arm turns"):
                for number, part in enumerate(parts):
                    part.rotation = turned(0.6 * math.sin(turn / 40 + number))
            if turn + 1 == said.frames:
                break
        parts[0].remove()  # with everything below it
    print(f"moved {len(parts)} parts in {turn + 1} frames, the last one frame {frame.frame}")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
