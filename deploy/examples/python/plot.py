#!/usr/bin/python3
"""A live plot on the wall: how long each of its last 240 frames took, as a line that is coloured by value.

    plot.py [ADDR:PORT] [--frames N]

plot.ipynb does the same in a notebook."""
import argparse
import collections
import time

import numpy as np

import tessera

WIDTH, HEIGHT, MOST_MS = 1.6, 0.6, 50.0  # of the plot: world units, milliseconds at its top


def curve(milliseconds):
    """Places of the line's corners: the newest at the right."""
    x = np.linspace(-WIDTH / 2, WIDTH / 2, len(milliseconds))
    y = np.clip(milliseconds, 0, MOST_MS) / MOST_MS * HEIGHT
    return np.stack([x, y, np.zeros_like(x)], axis=1)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("address", nargs="?",
                         help="of the server, or a page's link; without: TESSERA_SERVER, or this machine's one wall")
    options.add_argument("--frames", type=int, help="end after so many; without: go on until Ctrl+C")
    said = options.parse_args()

    with tessera.connect(said.address, name="plot") as wall:
        took = collections.deque([0.0] * 240, maxlen=240)
        frame_of_plot = np.array([[-WIDTH / 2, HEIGHT, 0], [-WIDTH / 2, 0, 0], [WIDTH / 2, 0, 0]])
        wall.show(frame_of_plot, "/plot", line=True, line_width=2, color="#ffffff", unlit=True, at=(0, 1.2, -1))
        before = time.monotonic()
        for number, _ in enumerate(wall.frames()):
            now = time.monotonic()
            took.append((now - before) * 1000)
            before = now
            values = np.array(took)
            # The same path again replaces what is there.
            wall.show(curve(values), "/plot/line", line=True, line_width=3, scalars=values, clim=(0, MOST_MS),
                      unlit=True)
            if number + 1 == said.frames:
                break
        wall.remove("/plot")
    print(f"plotted {number + 1} frames; the middle one took {np.median(values[values > 0]):.1f} ms")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
