"""The add-on for Blender where the server or Blender is killed (blender_cases.py, blender_killed.py)."""
import os
import signal
import unittest

from blender_process import InBlender, blender
from eventually import eventually
from live import PATIENCE, Live, run_folder


class BlenderKilled(InBlender):
    def test_the_server_is_killed(self):
        self.within("blender_cases", "Server")

    def test_blender_is_killed(self):
        """It is opened again as it was saved; with the first file's keys, and with a file that was never saved with its
        link."""
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
                    self.assertTrue(eventually(lambda: wall.status().applications == 1), "Blender has gone")
                    wall["/Stage/box"].translation = (7, 8, 9)  # while nobody is there
                    second = blender(self.folder, "blender_killed", "second", path, live.address, saved)
                    said, _ = second.communicate(timeout=10 * PATIENCE)
                    self.assertEqual(second.returncode, 0, said)
                    self.assertIn("TAKEN UP", said)
                    self.assertEqual(sorted(node.id for node in wall.find("/Stage/**")), before)


if __name__ == "__main__":
    unittest.main()
