"""The programs in deploy/examples/python, each on a wall of its own, ended by their --frames; and the six lines of the
README."""
import json
import os
import re
import subprocess
import sys
import time
import unittest

from live import BUILD, PATIENCE, ROOT, Live

EXAMPLES = ROOT / "deploy/examples/python"


class Examples(unittest.TestCase):
    def run_on_a_wall(self, name, *options, says, meanwhile=lambda wall: None):
        with Live(surface="none") as live, live.connect() as watcher:
            watcher["/drive"].pause()
            before = watcher.status().nodes
            program = subprocess.Popen([sys.executable, str(EXAMPLES / f"{name}.py"), live.address, *options],
                                       stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                       text=True, env={**os.environ, "PYTHONPATH": str(BUILD / "python"),
                                                       "PYTHONDONTWRITEBYTECODE": "1"})
            try:
                deadline = time.monotonic() + PATIENCE
                with watcher.frames(timeout=PATIENCE) as frames:
                    while program.poll() is None and time.monotonic() < deadline:
                        meanwhile(watcher)
                        next(frames)
                said, complaints = program.communicate(timeout=PATIENCE)
            finally:
                program.kill()
                program.wait()
            self.assertEqual((program.returncode, complaints), (0, ""))
            self.assertRegex(said, says)
            self.assertEqual(watcher.status().nodes, before)  # it leaves the wall as it was
            return said

    def test_parts_that_move(self):
        self.run_on_a_wall("parts", "--frames", "30", says="moved 3 parts in 30 frames")

    def test_a_live_plot(self):
        self.run_on_a_wall("plot", "--frames", "30", says=r"plotted 30 frames; the middle one took \d+\.\d ms")

    def test_a_collision_monitor(self):
        def push(wall):
            wall["/carriage"].translation = (-2, 0.5, 0)
            wall["/carriage"].move((4, 0.5, 0))
        said = self.run_on_a_wall("monitor", "--frames", "120", says=r"heard [1-9]\d* events in 120 frames",
                                  meanwhile=push)
        self.assertRegex(said, r"frame \d+: /\S+ begins to touch /\S+")

    def test_a_swarm(self):
        self.run_on_a_wall("swarm", "--frames", "10", says="moved 10000 in 10 frames")

    def test_a_node_that_moves_by_either_clock(self):
        self.run_on_a_wall("mover", "/carriage", "--paced", "--count", "20", says="moved /carriage 20 times, paced")
        self.run_on_a_wall("mover", "/carriage", "--queued", "--count", "20",
                           says=r"moved /carriage ([2-9]|1\d|20) times, queued")

    def cells(self):
        notebook = json.loads((EXAMPLES / "plot.ipynb").read_text())
        return ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]

    def test_the_cells_of_the_notebook_run_in_their_order(self):
        with Live(surface="none") as live:
            done = subprocess.run([sys.executable, "-c", "\n".join(self.cells())], capture_output=True, text=True,
                                  timeout=PATIENCE,
                                  env={**os.environ, "PYTHONPATH": str(BUILD / "python"),
                                       "TESSERA_SERVER": live.address, "FRAMES": "5"})
            self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_the_lines_of_the_readme_move_an_object(self):
        text = (ROOT / "client/python/README.md").read_text()
        program = re.search(r"```python\n(import tessera\n.*?)```", text, re.S).group(1)
        self.assertLessEqual(len(program.strip().splitlines()), 6)
        with Live(surface="none") as live, live.connect() as watcher:
            done = subprocess.run([sys.executable, "-c", program.replace("127.0.0.1:7000", live.address)],
                                  capture_output=True, text=True, timeout=PATIENCE,
                                  env={**os.environ, "PYTHONPATH": str(BUILD / "python")})
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertNotEqual(watcher["/hello"].translation, (0.0, 1.0, -1.0))


if __name__ == "__main__":
    unittest.main()
