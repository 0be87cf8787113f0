#!/usr/bin/python3
"""What linking Blender to a wall costs: `blender.py [--json FILE] [--moves N] [--rows few,many,large]`.

Debian's Blender without a window, whose add-on is pumped 60 times a second as its timer would; a server of 60 frames a
second and a host that draws nothing; an application that is told of changes. Rows:
  few, many  100 and 10,000 objects: until all stand at the wall, again for one that has them; one is dragged: from its
  move in
             Blender until the application hears of it; the other way, from the answer to a move there until Blender has
             it
  large      a mesh of a million triangles: until it stands at the wall
Of each the longest time for which the add-on held Blender's thread. No verdict on time here: tests/bench/README.md says
why."""
import argparse
import json
import os
import pathlib
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("TESSERA_BUILD", ROOT / "build"))
sys.path[:0] = [str(BUILD / "python"), str(ROOT / "tests/python")]

from live import PATIENCE, Live, run_folder  # noqa: E402
from blender_process import blender  # noqa: E402


def over(values, part):
    return sorted(values)[min(len(values) - 1, int(part * len(values)))]


def told(seen, sent):
    took = [(seen[at] - when) * 1e3 for at, when in sent if at in seen]
    return {"moves": len(sent), "seen": len(took), "p50_ms": round(over(took, 0.5), 1),
            "p99_ms": round(over(took, 0.99), 1),
            "longest_ms": round(max(took), 1)}


def row_of(name, moves):
    with (Live(surface="none", options=["--rate", "60"]) as live, live.connect() as wall,
          tempfile.TemporaryDirectory() as folder):
        report = pathlib.Path(folder, "report.json")
        seen = {}

        def watch(changes):
            for change in changes:
                now = time.monotonic()
                for column in change.columns:
                    if column.field.name == "translation":
                        for value in column.values[:, 2]:
                            seen.setdefault(round(float(value)), now)

        changes = wall.follow("changes")
        threading.Thread(target=watch, args=(changes,), daemon=True).start()
        process = blender(folder, name, live.address, str(moves), str(report), script="../bench/blender_rows.py")
        try:
            said, _ = process.communicate(timeout=10 * PATIENCE)
        finally:
            process.kill()
        changes.close()
        if process.returncode:
            raise RuntimeError(said)
        found = json.loads(report.read_text())
        sent = found.pop("sent", None)
        return {"row": name, **found, **({"drag": told(seen, sent)} if sent else {})}


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--json")
    options.add_argument("--moves", type=int, default=300)
    options.add_argument("--rows", default="few,many,large")
    said = options.parse_args()
    rows = []
    with run_folder():
        for name in said.rows.split(","):
            if name not in ("few", "many", "large"):
                options.error(f"no row {name}")
            rows.append(row_of(name, said.moves))
            print(json.dumps(rows[-1]), flush=True)
    if said.json:
        pathlib.Path(said.json).write_text(json.dumps({"rows": rows, "load": os.getloadavg(), "cores": os.cpu_count()},
                                                      indent=1) + "\n")


if __name__ == "__main__":
    main()
