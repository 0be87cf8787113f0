"""A model of physical light on a wall of real processes: its fields and requests in a person's program."""
import unittest

from live import ROOT, Live

import tessera

MODEL = ROOT / "tests/data/models/sunlit.glb"


class Exposure(unittest.TestCase):
    def test_is_metered_follows_fields_and_requests_and_is_saved(self):
        with Live(scene=MODEL, surface="osmesa", size="320x180") as live, live.connect() as wall:
            metered = wall.image()
            self.assertGreater(metered.mean(), 40)
            self.assertLess((metered == 255).mean(), 0.05)
            self.assertLess(wall.status().metered_stops, -12)
            environment = wall["/sunlit/exposure"]
            self.assertTrue(environment.metered)
            self.assertEqual(environment.toneMap, "neutral")

            environment.exposure = 1  # on top of what is metered
            brighter = wall.image()
            self.assertGreater(brighter.mean(), metered.mean() + 10)
            environment.exposure = 0

            environment.metered = False  # as it was before exposures: a white wall
            white = wall.image()
            self.assertGreater((white >= 250).mean(), 0.2)
            self.assertIsNone(wall.status().metered_stops)

            wall.ask("SetExposure", stops=-16.5, metered=False, tone_map="aces")
            graded = wall.image()
            self.assertLess((graded == 255).mean(), 0.05)
            self.assertEqual((wall.status().exposure.stops, wall.status().exposure.tone_map), (-16.5, "aces"))
            wall.ask("SetExposure", reset=True)
            self.assertTrue((wall.image() == white).all())
            with self.assertRaisesRegex(tessera.TesseraError, "stops"):
                wall.ask("SetExposure", stops=41)

            environment.metered, environment.toneMap = True, "agx"
            self.assertFalse((wall.image() == metered).all())
            saved = live.folder / "saved.tsct"
            self.assertEqual(live.run("tessera-ctl", "--server", live.address, "save", str(saved)).returncode, 0)
            self.assertIn("tone_map: TONE_MAP_AGX", saved.read_text())
            self.assertIn("metered: true", saved.read_text())


if __name__ == "__main__":
    unittest.main()
