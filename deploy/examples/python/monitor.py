#!/usr/bin/python3
"""A collision monitor: says which objects begin and cease to touch, and shows the places where they do as red balls.

    monitor.py [ADDR:PORT] [--frames N]

The scene says who is looked at: by its interests (deploy/scenes/README.md lists scenes with some)."""
import argparse

import tessera


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("address", nargs="?",
                         help="of the server, or a page's link; without: TESSERA_SERVER, or this machine's one wall")
    options.add_argument("--frames", type=int, help="end after so many; without: go on until Ctrl+C")
    said = options.parse_args()

    with tessera.connect(said.address, name="monitor") as wall:
        names = {}  # of objects, by number: asked for once

        def name_of(number):
            if number not in names:
                names[number] = wall[f"#{number}"].path
            return names[number]

        heard = 0
        marks = None
        with wall.follow("events") as events, wall.follow("contacts") as contacts:
            for turn, told in enumerate(events):
                for event in told.events:
                    heard += 1
                    does = ("begins to touch", "goes on to touch", "no longer touches")[event["phase"]]
                    print(f"frame {told.frame}: {name_of(event['object_a'])} {does} {name_of(event['object_b'])}")
                # All places of the frame in one array of numpy: no work for each.
                places = contacts.latest().contacts["point"]
                if len(places) or marks is not None:
                    marks = wall.show(places, "/touches", radius=0.05, color="#ff2020", unlit=True)
                if turn + 1 == said.frames:
                    break
        if marks is not None:
            marks.remove()
    print(f"heard {heard} events in {turn + 1} frames")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
