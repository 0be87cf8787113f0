#!/usr/bin/python3
"""A swarm of 10,000: each a node of its own, all moved in each frame by one array.

    swarm.py [ADDR:PORT] [--frames N] [--count N]

They share one shape; what travels in a frame is one packed column, without work for each of them in Python."""
import argparse

import numpy as np

import tessera

# A tetrahedron, a few centimetres large.
CORNERS = 0.02 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
FACES = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]], np.uint32)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("address", nargs="?",
                         help="of the server, or a page's link; without: TESSERA_SERVER, or this machine's one wall")
    options.add_argument("--frames", type=int, help="end after so many; without: go on until Ctrl+C")
    options.add_argument("--count", type=int, default=10_000)
    said = options.parse_args()

    with tessera.connect(said.address, name="swarm") as wall:
        with wall.edit() as edit:
            yellow = edit.object("Material", baseColor=(0.9, 0.6, 0.1, 1))
            shape = edit.object("Geometry", positions=CORNERS, indices=FACES, material=yellow)
            wall.create("/swarm", translation=(0, 1.5, -2))
            birds = []
            for number in range(said.count):
                bird = edit.create(f"/swarm/{number}")
                edit.create(f"/swarm/{number}/shape", None).core = shape  # several nodes may share one core
                birds.append(bird)
        swarm = wall.nodes(birds)

        # They turn about the middle, each on a ring of its own.
        dice = np.random.default_rng(1)
        radius, angle, height = dice.uniform(0.3, 2,
                                             said.count), dice.uniform(0, 2 * np.pi, said.count), dice.normal(
                                                 0, 0.3, said.count)
        places = np.empty((said.count, 3))
        for turn, frame in enumerate(wall.frames()):
            angle += 0.02 / radius
            places[:, 0] = radius * np.cos(angle)
            places[:, 1] = height + 0.1 * np.sin(3 * angle)
            places[:, 2] = radius * np.sin(angle)
            swarm.translations = places
            if turn + 1 == said.frames:
                break
        wall.remove("/swarm")
    print(f"moved {said.count} in {turn + 1} frames, the last one frame {frame.frame}")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
