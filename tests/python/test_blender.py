"""The add-on for Blender (deploy/blender), within Debian's Blender without a window, before walls of real processes.
What is claimed stands in blender_cases.py; here Blender is started, and killed."""
import json
import os
import pathlib
import signal
import tempfile
import time
import unittest

from blender_process import InBlender, blender
from live import PATIENCE, Live, run_folder


class Blender(InBlender):
    def test_what_is_shown(self):
        self.within("blender_cases", "Shown")

    def test_both_ways(self):
        self.within("blender_cases", "BothWays")

    def test_undo_is_kept_apart(self):
        self.within("blender_cases", "Undo")

    def test_who_is_not_let_in(self):
        self.within("blender_cases", "NotLetIn")

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
                    deadline = time.monotonic() + PATIENCE
                    while wall.status().applications > 1 and time.monotonic() < deadline:
                        time.sleep(0.02)
                    wall["/Stage/box"].translation = (7, 8, 9)  # while nobody is there
                    second = blender(self.folder, "blender_killed", "second", path, live.address, saved)
                    said, _ = second.communicate(timeout=10 * PATIENCE)
                    self.assertEqual(second.returncode, 0, said)
                    self.assertIn("TAKEN UP", said)
                    self.assertEqual(sorted(node.id for node in wall.find("/Stage/**")), before)

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
        path, deadline = pathlib.Path(self.folder, what), time.monotonic() + PATIENCE
        while not path.exists():
            self.assertLess(time.monotonic(), deadline, what)
            time.sleep(0.02)
        return json.loads(path.read_text())

    def settled(self, wall):
        """Nothing has been changed for a while."""
        before, quiet, deadline = None, 0, time.monotonic() + PATIENCE
        while quiet < 20:
            self.assertLess(time.monotonic(), deadline, "changes go to and fro")
            now = wall.status().sequence
            quiet, before = (quiet + 1, before) if now == before else (0, now)
            time.sleep(0.05)


if __name__ == "__main__":
    unittest.main()
