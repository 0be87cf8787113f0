"""The add-on for Blender (deploy/blender), within Debian's Blender without a window, before walls of real processes. What is claimed
stands in blender_cases.py; here Blender is started, and killed."""
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

from live import PATIENCE, Live, run_folder

HERE = pathlib.Path(__file__).resolve().parent
WHY_NOT = "" if shutil.which("blender") else "blender is not installed (./deploy/set-up --blender installs it)"


def blender(folder, *words, script="blender_side.py"):
    """Debian's, with settings of its own; its output goes to a file that is shown when it fails."""
    # It takes its libraries of Python from beside the first python3 in PATH: the system's has numpy.
    environment = {**os.environ, "PATH": "/usr/bin:/bin", "BLENDER_USER_CONFIG": folder, "BLENDER_USER_SCRIPTS": folder, "HOME": folder}
    environment.pop("DISPLAY", None)
    command = ["blender", "--background", "--factory-startup", "-noaudio", "--python-exit-code", "1", "--python", str(HERE / script), "--", *words]
    return subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


@unittest.skipIf(WHY_NOT, WHY_NOT)
class Blender(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="tessera-blender-"))

    def within(self, *words):
        process = blender(self.folder, *words)
        try:
            said, _ = process.communicate(timeout=10 * PATIENCE)
        finally:
            process.kill()
        self.assertEqual(process.returncode, 0, said)
        self.assertRegex(said, r"Ran [1-9]\d* test")

    def test_what_is_shown(self):
        self.within("blender_cases", "Shown")

    def test_both_ways(self):
        self.within("blender_cases", "BothWays")

    def test_undo_is_kept_apart(self):
        self.within("blender_cases", "Undo")

    def test_many_objects(self):
        self.within("blender_cases", "Many")

    def test_a_large_mesh(self):
        self.within("blender_cases", "Large")

    def test_who_is_not_let_in(self):
        self.within("blender_cases", "NotLetIn")

    def test_the_server_is_killed(self):
        self.within("blender_cases", "Server")

    def test_blender_is_killed(self):
        """It is opened again as it was saved; with the first file's keys, and with a file that was never saved with its link."""
        for saved in ("saved", "unsaved"):
            with self.subTest(saved), run_folder(), Live(surface="none") as live:
                path = os.path.join(self.folder, f"{saved}.blend")
                first = blender(self.folder, "blender_killed", "first", path, live.address, saved)
                try:
                    line = ""
                    while "READY" not in line:
                        line = first.stdout.readline()
                        self.assertTrue(line, "Blender ended")
                finally:
                    os.kill(first.pid, signal.SIGKILL)
                    first.communicate()
                with live.connect() as wall:
                    before = sorted(node.id for node in wall.find("/Stage/**"))
                    self.assertEqual(len(before), 1 + 3 * 3)
                    deadline = time.monotonic() + PATIENCE
                    while wall.status().applications > 1 and time.monotonic() < deadline:
                        time.sleep(0.02)
                    wall["/Stage/box"].translation = (7, 8, 9)  # while nobody is there
                    second = blender(self.folder, "blender_killed", "second", path, live.address, saved)
                    said, _ = second.communicate(timeout=10 * PATIENCE)
                    self.assertEqual(second.returncode, 0, said)
                    self.assertIn("TAKEN UP", said)
                    self.assertEqual(sorted(node.id for node in wall.find("/Stage/**")), before)


if __name__ == "__main__":
    unittest.main()
