"""The lists of the tab Scene in a real browser: what plays, the budget, files that nodes hold."""
import json
import pathlib
import unittest

import numpy
import page_browser
import page_wall

MANY = 620  # animations


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class PageLists(page_wall.OnAScene):
    options = {"surface": "osmesa", "size": "64x48", "options": ["--assets", str(pathlib.Path(__file__).parent)]}

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with cls.wall.edit() as edit:
            edit.create("/lamp", "PointLight", intensity=2.0)
            track = edit.object("KeyFrames", target=edit.create("/led", "Transform").core, field="translation",
                                times=numpy.array([0.0, 8.0]), values=numpy.array([[0.0, 0, 0], [1, 0, 0]]))
            edit.create("/led/swing", "Animation", channels=[track], playing=False, time=1.0)

    def ctl(self, *arguments):
        said = self.live.run("tessera-ctl", "--server", self.live.address, "--json", *arguments)
        self.assertEqual(said.returncode, 0, said.stderr)
        return json.loads(said.stdout)

    def animation(self, node="/led/swing"):
        return next(one for one in self.ctl("animations")["animations"] if one["node"] == node)

    # ---- what plays

    def test_animations_play_stop_and_are_sought(self):
        self.come_in(tab="scene")
        self.part("animations")
        row = self.shown(".animation", "/led/swing")
        self.browser.until("where it stands", lambda: "1.00 of 8.00 s" in row.text)
        self.assertIn("stands", row.text)
        self.press("[aria-label='Play /led/swing']", "Play")
        self.browser.until("the wall plays it", lambda: self.animation()["playing"])
        told = self.browser.run("return new Promise((done) => { const seen = new Set(), at = "
                                "document.querySelector(\"[aria-label='/led/swing, time']\");"
                                "const look = () => { seen.add(at.value); seen.size > 8 ? done(seen.size) : "
                                "requestAnimationFrame(look); }; look(); })")
        self.assertGreater(told, 8, "it moves by itself")
        self.press("[aria-label='Pause /led/swing']", "Pause")
        self.browser.until("the wall stops it", lambda: not self.animation()["playing"])
        shown = self.browser.until("both say the same",
                                   lambda: (lambda time: time if f"{time:.2f} of" in row.text else None)(
                                       self.animation()["time"]))
        self.assertGreater(shown, 1.0)
        slider = self.browser.all("[aria-label='/led/swing, time']")[0]
        self.browser.run("arguments[0].value = '4'; for (const kind of ['input', 'change']) "
                         "arguments[0].dispatchEvent(new Event(kind))", slider)
        self.browser.until("it is in the middle", lambda: self.animation()["time"] == 4)
        self.type(self.browser.all("[aria-label='/led/swing, time in s']")[0], "2.5")
        self.browser.until("it is sought", lambda: self.animation()["time"] == 2.5)
        self.type(self.shown("[aria-label='/led/swing, time in s']"), "11")  # beyond its end, as tessera-ctl seeks
        self.browser.until("it goes round", lambda: self.animation()["time"] == 3)
        speed = self.browser.all("[aria-label='/led/swing, speed']")[0]
        self.type(speed, "-2")
        self.browser.until("it is fast", lambda: self.animation()["speed"] == -2)
        self.type(speed, "1e9")
        self.browser.until("a refusal", lambda: "1000000" in row.text.replace(",", "").replace("1e+06", "1000000"))
        self.assertEqual(self.animation()["speed"], -2)
        self.ctl("speed", "/led/swing", "3")  # by somebody else
        self.browser.run("document.activeElement.blur()")
        self.browser.until("what another has set", lambda: speed.get_property("value") == "3")
        self.assert_nothing_logged()

    def test_what_a_collision_has_stopped_is_not_told_to_go_on(self):
        self.come_in(tab="scene")
        stopped = self.animation("/drive")["time"]
        self.assertLess(stopped, 0.9)
        self.part("animations")
        row = self.shown(".animation", "/drive")
        frame = self.wall.status().frame
        self.browser.until("a second and a half", lambda: self.wall.status().frame > frame + 90)
        self.browser.until("where it was stopped", lambda: f"{stopped:.2f} of 1.00 s" in row.text)
        self.assert_nothing_logged()

    def test_what_goes_while_another_part_is_shown_is_gone(self):
        with self.wall.edit() as edit:
            for name in ("/passing", "/staying"):
                edit.create(name, "Geometry", material=edit.object("Material"))
        self.come_in(tab="scene")
        self.select("passing")
        self.part("materials")
        count = self.browser.until("materials", lambda: len(self.texts(".materials button")))
        self.browser.until("all",
                           lambda: self.browser.text("#panel-scene-materials [role=status]") == f"{count} materials")
        self.wall.remove("/passing")
        self.browser.until("one less",
                           lambda: self.browser.text(
                               "#panel-scene-materials [role=status]") == f"{count - 1} materials")
        self.assertEqual(len(self.texts(".materials button")), count - 1)
        self.part("tree")
        self.browser.until("no row", lambda: not any("passing" in one for one in self.texts("[role=treeitem]")))
        self.browser.until("no fields", lambda: "is gone" in self.browser.text(".object h2"))
        self.browser.until("what undo would do", lambda: self.browser.text("#next-steps").startswith("↶ brings"))
        self.wall.remove("/staying")
        self.assert_nothing_logged()

    def test_many_animations_come_in_pages(self):
        with self.wall.edit() as edit:
            edit.create("/crowd", None)
            for i in range(MANY):
                edit.create(f"/crowd/{i:04}", "Animation", playing=False)
        self.come_in(tab="scene")
        self.part("animations")
        self.browser.until("a page", lambda: len(self.texts(".animation")) == 50)
        first = self.texts(".animation .name")[0]
        self.press("button", "On ›")
        self.browser.until("the next one",
                           lambda: "51 to 100" in self.browser.text("#panel-scene-animations [role=status]")
                           and self.texts(".animation .name")[0] != first)
        self.press("button", "‹ Back")
        self.browser.until("the first again", lambda: self.texts(".animation .name")[0] == first)
        self.wall.remove("/crowd")
        self.browser.until("few are left", lambda: len(self.texts(".animation")) < 10)
        self.assert_nothing_logged()

    # ---- budget and files

    def test_who_operates_sets_the_budget(self):
        self.come_in(tab="scene")
        self.part("budget")
        self.browser.until("none", lambda: "no limit" in self.browser.text("#panel-scene-budget"))
        field = self.browser.all("[aria-label='Budget in ms']")[0]
        self.type(field, "40")
        self.browser.until("it is set", lambda: self.wall.status().budget_ms == 40)
        self.browser.until("it stands there", lambda: "40 ms" in self.browser.text("#panel-scene-budget dd"))
        self.assertRegex(self.browser.text("#panel-scene-budget"), r"Frames take\d+\.\d ms at most")
        self.type(field, "70000")
        self.browser.until("a refusal", lambda: "60000" in self.browser.text("#panel-scene-budget .said"))
        self.assertEqual(self.wall.status().budget_ms, 40)
        self.press("#panel-scene-budget button", "No limit")
        self.browser.until("there is none", lambda: self.wall.status().budget_ms == 0)
        self.assert_nothing_logged()

    def test_a_file_that_cannot_be_loaded_says_why(self):
        self.come_in(tab="scene")
        self.part("inlines")
        self.browser.until("none yet", lambda: "holds another file" in self.browser.text("#panel-scene-inlines"))
        self.wall.create("/broken", "Inline", file="asset://no-such.glb", load="by-hand")
        row = self.shown(".inline", "waiting")
        self.browser.run("arguments[0].querySelector('input').click()", row)
        self.browser.until("it has failed", lambda: "failed" in self.texts(".inline")[0])
        told = self.ctl("inlines")["inlines"][0]
        self.assertTrue(told["wanted"] and told["problem"])
        self.browser.until("and why", lambda: told["problem"] in self.texts(".inline")[0])
        self.press(".inline .link", "/broken")
        self.browser.until("its node",
                           lambda: self.browser.text(".object h2") == "broken"
                           and self.browser.all("#panel-scene-tree"))
        self.wall.remove("/broken")
        self.assert_nothing_logged()

    def test_who_edits_does_not_set_the_budget(self):
        self.come_in("editor", "scene")
        self.select("lamp")
        self.browser.until("tools", lambda: self.browser.all(".node-tools button"))
        self.part("budget")
        self.browser.until("the budget", lambda: "Budget for a frame" in self.browser.text("#panel-scene-budget"))
        self.assertEqual(self.browser.all("#panel-scene-budget input, #panel-scene-budget button"), [])
        self.assert_nothing_logged()


if __name__ == "__main__":
    unittest.main()
