"""The notebook of deploy/examples/python, executed by Jupyter beside a wall."""
import importlib.util
import os
import subprocess
import sys
import unittest

from live import BUILD, PATIENCE, ROOT, Live

NOTEBOOK = ROOT / "deploy/examples/python/plot.ipynb"


@unittest.skipUnless(importlib.util.find_spec("nbconvert") and importlib.util.find_spec("ipykernel"),
                     "jupyter is not installed (./deploy/set-up --world installs it)")
class Notebook(unittest.TestCase):
    def test_it_is_executed_and_has_a_picture(self):
        with Live(surface="osmesa", size="96x54") as live:
            command = [sys.executable, "-m", "nbconvert", "--to", "notebook", "--execute", "--output-dir",
                       str(live.folder), str(NOTEBOOK)]
            done = subprocess.run(command, capture_output=True, text=True, timeout=3 * PATIENCE,
                                  env={**os.environ, "PYTHONPATH": str(BUILD / "python"),
                                       "TESSERA_SERVER": live.address, "FRAMES": "5"})
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("image/png", (live.folder / "plot.ipynb").read_text())


if __name__ == "__main__":
    unittest.main()
