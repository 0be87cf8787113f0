"""Files on their way into a wall of real processes: what is told of them, and how people end it."""
import json
import os
import pathlib
import pty
import select
import signal
import subprocess
import tempfile
import threading
import time
import unittest

import tessera
from eventually import eventually
from live import BIN, PATIENCE, Live, run_folder


def write_grid(path, side):
    """A file that takes an importer about a second for each 60 MB."""
    with open(path, "w") as file:
        for y in range(side):
            file.write("".join(f"v {x} {y} {x * y % 7}\n" for x in range(side)))
        for y in range(side - 1):
            row = y * side
            file.write("".join(f"f {row + x + 1} {row + x + 2} {row + side + x + 2}\n" for x in range(side - 1)))


class Importer:
    """The child that reads a file, stopped where it is."""

    def __init__(self, file):
        self.pid = self._found(str(file))
        os.kill(self.pid, signal.SIGSTOP)

    @staticmethod
    def _found(file):
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            for entry in pathlib.Path("/proc").iterdir():
                if not entry.name.isdecimal():
                    continue
                try:
                    words = (entry / "cmdline").read_bytes().split(b"\0")
                except OSError:
                    continue
                if words[0].endswith(b"tessera-import") and file.encode() in words:
                    return int(entry.name)
        raise AssertionError(f"nobody reads {file}")

    def is_there(self):
        return os.path.exists(f"/proc/{self.pid}")


class Loads(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.enterClassContext(run_folder())

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="tessera-loads-")))
        self.file = self.folder / "grid.obj"
        write_grid(self.file, 500)
        self.live = self.enterContext(Live(surface="none", options=["--allow", str(self.folder)]))
        self.wall = self.enterContext(self.live.connect())

    def ctl(self, *words):
        return self.live.run("tessera-ctl", "--server", self.live.address, *words)

    def begin(self):
        """A load by another program; what has come of it, and its importer."""
        outcome = []

        def load():
            with self.live.connect() as other:
                try:
                    outcome.append(other.load(str(self.file)).path)
                except tessera.TesseraError as error:
                    outcome.append(str(error))

        thread = threading.Thread(target=load, daemon=True)
        thread.start()
        importer = Importer(self.file)
        return thread, outcome, importer

    def test_are_told_and_cancelled_by_others(self):
        self.assertEqual(self.wall.ask("GetLoads").loads, [])
        thread, outcome, importer = self.begin()
        told = self.wall.ask("GetLoads").loads
        self.assertEqual([(one.path, one.stage in ("reading", "converting"), one.yours) for one in told],
                         [(str(self.file), True, False)])
        said = self.ctl("loads")
        self.assertEqual(said.returncode, 0, said.stderr)
        self.assertIn("grid.obj", said.stdout)
        said = self.ctl("--json", "cancel")
        self.assertEqual(json.loads(said.stdout)["path"], str(self.file), said.stderr)
        thread.join(PATIENCE)
        self.assertFalse(thread.is_alive())
        self.assertIn("cancelled by", outcome[0])
        self.assertTrue(eventually(lambda: not importer.is_there()), "even one that does not move is ended")
        self.assertIn("no file is on its way", self.ctl("loads").stdout)
        said = self.ctl("cancel", str(told[0].load))
        self.assertEqual(said.returncode, 3)
        self.assertIn("is on its way", said.stderr)
        self.assertEqual(self.wall.load(str(self.file)).path, "/grid", "the next one is read as ever")

    def test_say_how_far_they_are_on_a_terminal_where_ctrl_c_cancels(self):
        pid, terminal = pty.fork()
        if pid == 0:
            os.execv(BIN / "tessera-ctl", ["tessera-ctl", "--server", self.live.address, "load", str(self.file)])
        importer = Importer(self.file)
        said = b""
        deadline = time.monotonic() + PATIENCE
        while b"Ctrl-C cancels" not in said and time.monotonic() < deadline:
            if select.select([terminal], [], [], 0.1)[0]:
                said += os.read(terminal, 4096)
        self.assertIn(b"grid.obj: ", said)
        os.write(terminal, b"\x03")
        while True:
            try:
                more = os.read(terminal, 4096)
            except OSError:
                break
            if not more:
                break
            said += more
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), 1, said)
        os.close(terminal)
        self.assertIn(b"cancelled by", said)
        self.assertEqual(self.wall.ask("GetLoads").loads, [])
        self.assertTrue(eventually(lambda: not importer.is_there()))

    def test_of_the_first_scene_end_with_the_server(self):
        server = subprocess.Popen([BIN / "tessera-server", "--wall", "1x1", "--scene", str(self.file), "--listen",
                                   "127.0.0.1:0"], cwd=self.folder, stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL)
        importer = Importer(self.file)
        server.send_signal(signal.SIGINT)
        begun = time.monotonic()
        server.wait(PATIENCE)
        self.assertLess(time.monotonic() - begun, 30, "an import has four minutes")
        self.assertFalse(importer.is_there())


if __name__ == "__main__":
    unittest.main()
