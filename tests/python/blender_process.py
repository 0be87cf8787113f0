"""Debian's Blender without a window, for tests of the add-on (deploy/blender): blender_side.py and what it runs."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

from live import PATIENCE

HERE = pathlib.Path(__file__).resolve().parent
WHY_NOT = "" if shutil.which("blender") else "blender is not installed (./deploy/set-up --world installs it)"


def blender(folder, *words, script="blender_side.py"):
    """Debian's, with settings of its own; its output goes to a file that is shown when it fails."""
    # It takes its libraries of Python from beside the first python3 in PATH: the system's has numpy.
    environment = {**os.environ, "PATH": "/usr/bin:/bin", "BLENDER_USER_CONFIG": folder, "BLENDER_USER_SCRIPTS": folder,
                   "HOME": folder}
    environment.pop("DISPLAY", None)
    command = ["blender", "--background", "--factory-startup", "-noaudio", "--python-exit-code", "1", "--python",
               str(HERE / script), "--", *words]
    return subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                            stderr=subprocess.STDOUT, text=True)


@unittest.skipIf(WHY_NOT, WHY_NOT)
class InBlender(unittest.TestCase):
    """`within` runs tests of a module there."""

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
