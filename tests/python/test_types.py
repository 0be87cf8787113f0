"""The package's annotations hold, and a checker follows them in a program that uses it."""
import importlib.util
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

from live import BUILD, PATIENCE

PROGRAM = """
import numpy as np
import tessera

def moved(wall: tessera.Wall) -> tuple[float, float, float]:
    node = wall["/hall/crane"]
    node.translation = (1, 2, 3)
    node.translations_of_nobody = 1  # fields are not known to a checker; the wall names unknown ones
    picture: "np.ndarray[object, np.dtype[np.uint8]]" = wall.image()
    with wall.edit(undo="drag") as edit:
        edit.set(wall.nodes("/swarm/*"), "translation", np.zeros((3, 3)))
    for frame in wall.frames():
        print(frame.shown, picture.shape)
    path: int = node.path  # wrong
    return node.translation
"""


@unittest.skipUnless(importlib.util.find_spec("mypy"), "mypy is not installed (apt-get install mypy)")
class Types(unittest.TestCase):
    def check(self, *words):
        with tempfile.TemporaryDirectory() as cache:
            return subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", cache, *map(str, words)],
                                  capture_output=True, text=True,
                                  timeout=4 * PATIENCE, env={**os.environ, "MYPYPATH": str(BUILD / "python")})

    def test_the_package_and_a_program(self):
        with tempfile.TemporaryDirectory() as folder:
            program = pathlib.Path(folder) / "program.py"
            program.write_text(PROGRAM)
            done = self.check(program, BUILD / "python/tessera")
        told = [line for line in done.stdout.splitlines() if "error:" in line]
        self.assertEqual(len(told), 1, done.stdout)
        self.assertIn('expression has type "str", variable has type "int"', told[0])


if __name__ == "__main__":
    unittest.main()
