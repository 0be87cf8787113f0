"""A model without light stands in a studio on a wall of real processes, and no program finds anything of it."""
import pathlib
import shutil
import tempfile
import unittest

from live import ROOT, Live

MODEL = ROOT / "tests/data/models/wedge.stl"
BACKGROUND = (63, 69, 79)  # of an Environment's own colour, as a screen shows it


def facts_of(wall, live):
    """What programs are told of the scene, and the scene as a file."""
    status = wall.status()
    saved = live.folder / "saved.tsct"
    said = live.run("tessera-ctl", "--server", live.address, "save", str(saved))
    if said.returncode:
        raise RuntimeError(said.stderr)
    tree = live.run("tessera-ctl", "--server", live.address, "tree")
    return {"nodes": status.nodes, "objects": status.objects, "saved": saved.read_text(), "tree": tree.stdout}


class Studio(unittest.TestCase):
    def of(self, scene=MODEL, options=()):
        return Live(scene=scene, surface="osmesa", size="320x180", options=options)

    def test_is_seen_and_is_no_part_of_the_scene(self):
        with self.of() as live, live.connect() as wall, self.of(options=["--plain"]) as plain_live, \
                plain_live.connect() as plain_wall:
            image, plain = wall.image(), plain_wall.image()
            # The middle of the lowest row is ground, lit; without a studio nothing is there.
            self.assertGreater(int(image[-1, 160].min()), BACKGROUND[0] + 30)
            self.assertTrue((abs(plain[-1, 160].astype(int) - BACKGROUND) <= 1).all(), plain[-1, 160])
            self.assertEqual(facts_of(wall, live), facts_of(plain_wall, plain_live))
            # One picks what is there, and nothing on the ground.
            self.assertIn("wedge", wall[f"#{wall.pick(160, 90).node}"].path)
            self.assertFalse(wall.pick(160, 179).hit)

    def test_plain_is_the_picture_of_the_scene_as_it_is_written(self):
        with self.of(options=["--plain"]) as live, live.connect() as wall:
            plain = wall.image()
            saved = live.folder / "as-written.tsct"
            self.assertEqual(live.run("tessera-ctl", "--server", live.address, "save", str(saved)).returncode, 0)
            with self.of(scene=saved) as written, written.connect() as other:
                self.assertTrue((other.image() == plain).all())

    def test_goes_with_the_first_light_and_comes_back_with_a_journal(self):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        model = shutil.copy(MODEL, folder / "wedge.stl")
        with Live(scene=model, surface="osmesa", size="320x180", journal=True) as live:
            with live.connect() as wall:
                before = wall.image()
                wall.create("/lamp", "DirectionalLight")
                wall.image()
                self.assertLess(int(wall.image()[-1, 160].max()), 100)
                wall.remove("/lamp")
                self.assertTrue((wall.image() == before).all())
            live.kill_server()
            (folder / "wedge.stl").rename(folder / "wedge2.stl")  # the journal knows the scene
            live.start_server()
            live._wait_until_live(1)
            with live.connect() as wall:
                self.assertTrue((wall.image() == before).all())


if __name__ == "__main__":
    unittest.main()
