"""Two Blenders with one file, linked to one wall at once (blender_pair.py)."""
import contextlib
import json
import os
import pathlib
import tempfile
import time
import unittest

import tessera
from blender_process import InBlender, blender
from eventually import eventually
from live import PATIENCE, Live, run_folder


class BlenderPair(InBlender):
    def test_two_of_them_on_one_wall(self):
        """One file, open in both: what one moves the other has, nothing is there twice, and nothing goes to and fro."""
        path = os.path.join(self.folder, "pair.blend")
        self.finished(blender(self.folder, "blender_pair", "make", path))
        with run_folder(), Live(surface="none") as live:
            # Settings of their own
            folders = [self.enterContext(tempfile.TemporaryDirectory(prefix="tessera-blender-")) for _ in "ab"]
            both = [blender(folder, "blender_pair", "come", self.folder, path, live.address, name)
                    for folder, name in zip(folders, "ab")]
            try:
                self.say("begin")
                self.said("a.dragged"), self.said("b.dragged")
                with live.connect() as wall:
                    self.settled(wall)
                    self.say("look")
                    looked = [self.said(f"{name}.looked") for name in "ab"]
                    self.assertEqual([each["notes"] for each in looked], [[], []])
                    self.assertEqual(looked[0]["at"], looked[1]["at"])
                    for name, place in looked[0]["at"].items():
                        self.assertEqual(wall[f"/Stage/{name}"].translation, tuple(place))
                    self.assertIn(looked[0]["at"]["shared"][0], (159, 259))
                    self.assertLess(sum(each["sent"] for each in looked), 400)
                live.kill_server()
                live.start_server()
                self.said("a.again"), self.said("b.again")
                with live.connect() as wall:
                    self.settled(wall)
                    self.say("end")
                    ended = [self.said(f"{name}.ended") for name in "ab"]
                    self.assertEqual([(each["objects"], each["notes"], each["at"]) for each in ended],
                                     [(3, [], looked[0]["at"])] * 2)
                    self.assertEqual(len(wall.find("/*/blender-link:*")), 1)
                    self.assertEqual(len(wall.find("/**/blender:*")), 3)
            finally:
                for process in both:
                    process.kill()
                    process.communicate()

    def finished(self, process):
        said, _ = process.communicate(timeout=10 * PATIENCE)
        self.assertEqual(process.returncode, 0, said)

    def say(self, what):
        pathlib.Path(self.folder, what).touch()

    def said(self, what):
        path = pathlib.Path(self.folder, what)
        self.assertTrue(eventually(path.exists), what)
        return json.loads(path.read_text())

    def settled(self, wall):
        """Returns once nothing has been changed for a second."""
        deadline = time.monotonic() + PATIENCE
        with wall.follow("changes", timeout=1) as changes, contextlib.suppress(tessera.Timeout):
            for _ in changes:
                self.assertLess(time.monotonic(), deadline, "changes go to and fro")


if __name__ == "__main__":
    unittest.main()
