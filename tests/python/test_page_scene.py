"""The tab Scene in a real browser, before a real wall: fields of all types, materials, and whole nodes."""
import json
import pathlib
import unittest
import urllib.request

import numpy
import page_browser
import page_wall
from live import Live, run_folder

MANY = 620  # children of one node

# Of each field of what is selected: its object's type, its name as the wall says it, what it is edited with, what is
# said of it.
FIELDS = """
return [...document.querySelectorAll('.object section')].map((section) => [section.querySelector('h3').textContent,
  [...section.querySelectorAll('.field')].map((field) => [field.querySelector('.field-name').firstChild.textContent,
    field.querySelectorAll('input, select, textarea').length,
      field.querySelector('.field-name .muted')?.textContent ?? '',
    field.querySelector('.value').textContent,
    field.querySelector('.field-name').scrollWidth <= field.querySelector('.field-name').clientWidth])]);
"""
# Of the ball of a material: the mean of red, green, blue where it is, and how much its brightest parts are brighter
# than that.
BALL = """
const canvas = document.querySelector('.preview canvas'), data = canvas.getContext('2d').getImageData(0, 0,
  canvas.width, canvas.height).data;
const sum = [0, 0, 0], lights = [];
for (let at = 0; at < data.length; at += 4) {
  if (data[at + 3] < 255) continue;
  for (let i = 0; i < 3; ++i) sum[i] += data[at + i];
  lights.push(data[at] + data[at + 1] + data[at + 2]);
}
lights.sort((a, b) => a - b);
const many = lights.length, mean = sum.map((part) => part / many);
return { mean, many, corner: data[3], spot: lights[Math.floor(0.998 * many)] / (mean[0] + mean[1] + mean[2]) };
"""


def spaced(name):
    return "".join(f" {letter.lower()}" if letter.isupper() and before.islower() or before.isdigit()
                   and letter.isupper() else letter
                   for before, letter in zip(" " + name, name))


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class PageScene(page_wall.OnAScene):
    @classmethod
    def setUpClass(cls):
        cls.enterClassContext(run_folder())
        cls.live = cls.enterClassContext(Live(surface="osmesa", size="64x48",
                                              options=["--assets", str(pathlib.Path(__file__).parent)]))
        cls.browser = cls.enterClassContext(page_browser.Browser())
        cls.wall = cls.enterClassContext(cls.live.connect())
        link = cls.live.link()
        request = urllib.request.Request(link.partition("/?")[0] + "/api",
                                         headers={"Authorization": f"Bearer {cls.live.token()}"})
        with urllib.request.urlopen(request) as answer:
            cls.types = {one["name"]: one for one in json.load(answer)["types"]}
        with cls.wall.edit() as edit:
            edit.create("/lamp", "PointLight", intensity=2.0)
            red = edit.object("Material", baseColor=(1, 0.02, 0.02, 1))
            cls.ball = edit.create("/ball", "Geometry", material=red)
            edit.create("/turned", "Transform", rotation=(1, 0, 0, 0))
            track = edit.object("KeyFrames", target=edit.create("/led", "Transform").core, field="translation",
                                times=numpy.array([0.0, 8.0]), values=numpy.array([[0.0, 0, 0], [1, 0, 0]]))
            edit.create("/led/swing", "Animation", channels=[track], playing=False, time=1.0)
            edit.create("/goner", None)
            for i in range(8):
                edit.create(f"/goner/part {i}", None)

    # ---- fields

    def test_all_fields_of_all_types_are_shown_with_something_to_edit_them_or_say_why_not(self):
        lonely = [name for name, one in self.types.items() if not one["core"] and name != "Node"]  # at no node
        with self.wall.edit() as edit:
            edit.create("/types", None)
            edit.create("/shower", "Animation",
                        channels=[edit.object("KeyFrames", target=edit.object(name)) for name in lonely])
            for name, one in self.types.items():
                if one["core"]:
                    edit.create(f"/types/{name} here", name)
        self.come_in(tab="scene")
        seen = set()

        def look(expected):
            shown = self.browser.until(f"the fields of {expected}",
                                       lambda: next(
                                           (one for one in self.browser.run(FIELDS)
                                            if one[0].startswith(expected + " #")), None))
            fields = self.types[expected]["fields"]
            self.assertEqual([name for name, *_ in shown[1]], [spaced(field["name"]) for field in fields], expected)
            for field, (name, editors, note, value, fits) in zip(fields, shown[1]):
                with self.subTest(type=expected, field=name):
                    self.assertTrue(fits, "it lies over its editor")
                    if field.get("written_by"):
                        self.assertEqual((editors, "the wall says it" in note), (0, True))
                        self.assertIn(field.get("instead", ""), note)
                        self.assertTrue(value or field["default"] == "")
                    elif field["kind"] == "blob":
                        self.assertEqual((editors, "programs write it" in note), (0, True))
                        self.assertTrue(value)
                    else:
                        self.assertGreaterEqual(editors, max(1, field["width"] if "words" not in field else 1))
                        self.assertIn(field["unit"], note)
                        if "least" in field and "words" not in field:
                            self.assertRegex(note, r"at least [-\d]|[-\d] to [-\d]")
            seen.add(expected)

        self.select("types")
        look("Node")
        self.browser.run("arguments[0].querySelector('.toggle').click()", self.row("types"))
        for name, one in self.types.items():
            if one["core"]:
                self.select(f"{name} here")
                look(name)
        for at, name in enumerate(lonely):
            self.select("shower")
            self.browser.until("its tracks",
                               lambda: len(self.texts(".object section:last-child .visit")) == len(lonely))
            self.browser.run("document.querySelectorAll('.object section:last-child .visit')[arguments[0]].click()", at)
            look("KeyFrames")
            self.press(".object .visit", "Show")
            look(name)
        self.assertEqual(seen, set(self.types))
        self.wall.remove("/types")
        self.wall.remove("/shower")
        self.assert_nothing_logged()

    def test_a_rotation_is_typed_in_degrees_and_what_nobody_types_stays_exact(self):
        exact = (0.1825741858350554, 0.3651483716701107, 0.5477225575051661, 0.7302967433402214)
        self.wall["/turned"].rotation = exact
        self.come_in(tab="scene")
        self.select("turned")
        self.browser.until("its angles",
                           lambda: self.field("rotation, degrees about y").get_property("value") not in ("", "0"))
        self.type(self.field("translation, x"), "3")
        self.browser.until("it has moved", lambda: tuple(self.wall["/turned"].translation) == (3, 0, 0))
        self.assertEqual(tuple(self.wall["/turned"].rotation), exact)
        for axis, angle in (("x", "0"), ("z", "0"), ("y", "90")):
            self.type(self.field(f"rotation, degrees about {axis}"), angle)
        self.browser.until("a quarter of a turn",
                           lambda: numpy.allclose(self.wall["/turned"].rotation, (0.5**0.5, 0, 0.5**0.5, 0)))
        self.type(self.field("translation, x"), "1e999")
        self.browser.until("a refusal", lambda: "✕ a number was expected, not a text" in self.texts(".field .said"))
        self.type(self.field("translation, x"), "4")
        self.browser.until("no refusal", lambda: not any(self.texts(".field .said")))
        self.type(self.field("rotation, degrees about x"), "steep")
        self.browser.until("a refusal", lambda: any("number" in one for one in self.texts(".field .said")))
        self.assertTrue(numpy.allclose(self.wall["/turned"].rotation, (0.5**0.5, 0, 0.5**0.5, 0)))
        self.browser.until("the old angle",
                           lambda: self.field("rotation, degrees about x").get_property("value") == "0")
        self.assert_nothing_logged()

    def test_a_text_of_several_lines_stays_one(self):
        from selenium.webdriver.common.keys import Keys

        self.wall.create("/sign", "Text", text="first\nsecond")
        self.come_in(tab="scene")
        self.select("sign")
        field = self.field("text")
        self.assertEqual((field.get_property("value"), field.get_property("rows")), ("first\nsecond", 2))
        field.send_keys(Keys.CONTROL, Keys.END, Keys.NULL, Keys.ENTER, "third", Keys.CONTROL, Keys.ENTER, Keys.NULL)
        self.browser.until("three lines", lambda: self.wall["/sign"].text == "first\nsecond\nthird")
        self.type(self.field("name"), "board")  # Enter ends a single line
        self.browser.until("another name", lambda: "/board" in self.wall)
        self.wall.remove("/board")
        self.assert_nothing_logged()

    def test_what_a_field_means_is_chosen_from_a_list(self):
        self.come_in(tab="scene")
        self.select("lamp")
        self.field("beacon, Choose…").click()
        self.browser.until("nodes", lambda: len(self.texts(".choices button")) > 4)
        self.browser.all("dialog input[type=search]")[0].send_keys("turned")
        self.browser.until("one alone", lambda: self.texts(".choices .name") == ["/turned"])
        self.press(".choices button", "/turned")
        self.browser.until("it is the beacon", lambda: self.wall["/lamp"].beacon == self.wall["/turned"])
        self.type(self.field("beacon"), "/nowhere")
        self.browser.until("a refusal", lambda: any("/nowhere" in one for one in self.texts(".field .said")))
        self.browser.until("the old one",
                           lambda: self.field("beacon").get_property("value") == f"#{self.wall['/turned'].id}")
        self.press(".field .visit", f"#{self.wall['/turned'].id}")
        self.browser.until("a link to it", lambda: self.browser.text(".object h2") == "turned")
        self.select("ball")
        self.field("material, Choose…").click()
        found = self.browser.until("materials with a picture",
                                   lambda: len(self.texts(".choices canvas")) >= 4
                                   and self.browser.all(".choices button"))
        other = next(one for one in found if f"#{self.wall['/ball'].material.id}" not in one.text)
        number = other.text.partition("#")[2].strip()
        other.click()
        self.browser.until("another material", lambda: str(self.wall["/ball"].material.id) == number)
        self.field("material, Choose…").click()
        self.press("dialog[open] button", "Cancel")
        self.assertEqual(str(self.wall["/ball"].material.id), number)
        self.wall.undo()
        self.assert_nothing_logged()

    # ---- materials

    def test_a_ball_shows_a_material_and_follows_its_fields(self):
        material = self.wall["/ball"].material
        self.come_in(tab="scene")
        self.part("materials")
        self.press(".materials button", f"#{material.id}")

        def ball(what, is_so):
            return self.browser.until(what,
                                      lambda: (lambda told: told if told and is_so(told)
                                               else None)(
                                                   self.browser.run(
                                                       f"if (!document.querySelector('.preview')) return null; "
                                                       f"{BALL}")))

        red = ball("a red ball", lambda told: told["mean"][0] > 2 * told["mean"][1]
                   and told["mean"][0] > 2 * told["mean"][2])
        self.assertEqual(red["corner"], 0, "around it is nothing")
        self.assertGreater(red["many"], 20000)
        self.type(self.field("base color, green"), "1")
        self.type(self.field("base color, red"), "0.02")
        ball("a green one", lambda told: told["mean"][1] > 2 * told["mean"][0]
             and told["mean"][1] > 2 * told["mean"][2])
        self.type(self.field("roughness"), "0.15")
        glossy = ball("a small bright spot", lambda told: told["spot"] > 1.5)
        self.type(self.field("roughness"), "1")
        ball("no spot any more", lambda told: told["spot"] < 0.9 * glossy["spot"])
        self.type(self.field("metallic"), "1")
        dark = ball("metal", lambda told: told["mean"][1] > 1.5 * told["mean"][0])
        material.emissive = (0, 0, 3)  # by somebody else
        ball("it shines", lambda told: told["mean"][2] > dark["mean"][2] + 80)
        material.set(emissive=(0, 0, 0), metallic=0, baseColor=(0, 0, 0, 0), alphaMode="blend")
        ball("the pattern behind it", lambda told: 150 < min(told["mean"]) and max(told["mean"]) < 205)
        self.wall["/ball"].material.set(baseColor=(1, 0.02, 0.02, 1), roughness=0.6, alphaMode="auto",
                                        program=self.wall.object("SurfaceProgram"))
        self.browser.until("what is not drawn", lambda: "without program" in self.browser.text(".preview"))
        self.assert_nothing_logged()

    # ---- whole nodes

    def test_removing_asks_once_and_says_what_goes(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in(tab="scene")
        self.select("goner")
        self.press(".node-tools button", "Remove")
        asked = self.shown("dialog[open]")
        self.assertIn("8 nodes below go with it: part 0, part 1", asked.text)
        self.assertEqual(self.browser.focused(), "Cancel")
        self.browser.press(Keys.ESCAPE)
        self.browser.until("it is closed", lambda: not self.browser.all("dialog[open]"))
        self.assertIn("/goner/part 7", self.wall)
        self.press(".node-tools button", "Remove")
        self.press("dialog[open] button.danger", "Remove")
        self.browser.until("it is gone", lambda: "/goner" not in self.wall)
        self.browser.until("and not in the tree",
                           lambda: not any("goner" in one for one in self.texts("[role=treeitem]")))
        self.browser.until("what was above it", lambda: self.browser.text(".object h2") == "Node #1")
        self.browser.until("of which there is no other", lambda: self.texts(".node-tools button") == ["+ New child…"])
        self.wall.undo()
        self.row("goner")
        self.assert_nothing_logged()

    def test_a_copy_moves_by_itself_and_a_child_is_made(self):
        self.come_in(tab="scene")
        self.select("turned")
        self.press(".node-tools button", "Clone")
        self.browser.until("the copy is shown", lambda: self.browser.text(".object h2") == "turned 2")
        self.assertNotEqual(self.wall["/turned 2"].core, self.wall["/turned"].core)
        self.press(".node-tools button", "New child")
        self.shown("dialog[open] input[name=name]")
        self.browser.press("torch")
        self.browser.run("document.querySelector('dialog[open] select').value = 'SpotLight'")
        self.press("dialog[open] button", "Create")
        self.browser.until("the child is shown", lambda: self.browser.text(".object h2") == "torch")
        self.assertEqual(self.wall["/turned 2/torch"].core.type, "SpotLight")
        self.wall.remove("/turned 2")
        self.browser.until("what another removed", lambda: "is gone" in self.browser.text(".object h2"))
        self.assertEqual(self.browser.all(".node-tools button"), [])
        self.assert_nothing_logged()

    def test_what_others_do_is_seen_in_large_branches_too(self):
        with self.wall.edit() as edit:
            edit.create("/many", None)
            for i in range(MANY):
                edit.create(f"/many/child {i:04}", None)
        self.come_in(tab="scene")
        self.browser.run("arguments[0].querySelector('.toggle').click()", self.row("many"))
        self.row("child 0001")
        self.select("child 0000")
        self.wall["/many/child 0000"].name = "renamed"
        self.browser.until("another name", lambda: self.browser.text(".object h2") == "renamed")
        self.row("renamed")
        self.wall.remove("/many/child 0001")
        self.browser.until("one less", lambda: not any("child 0001" in one for one in self.texts("[role=treeitem]")))
        self.wall.remove("/many")
        self.assert_nothing_logged()

    # ---- for everybody

    def test_who_only_looks_sees_nothing_to_change(self):
        self.come_in("viewer", "scene")
        self.part("animations")
        self.browser.until("an animation", lambda: any("/led/swing" in one for one in self.texts(".animation")))
        self.part("budget")
        self.browser.until("the budget", lambda: "Budget for a frame" in self.browser.text("#panel-scene-budget"))
        self.part("materials")
        self.browser.until("materials", lambda: len(self.texts(".materials canvas")) > 2)
        self.press(".materials button", "Material")
        self.browser.until("its ball", lambda: self.browser.all(".preview canvas"))
        self.part("tree")
        self.select("ball")
        self.browser.until("a link", lambda: self.browser.all(".object .visit"))
        for name in ("tree", "materials", "animations", "inlines", "budget"):
            self.part(name)
            panel = f"#panel-scene-{name}"
            self.assertEqual(self.browser.all(
                f"{panel} .object input, {panel} .listed input, {panel} select, {panel} textarea, {panel} .choose, "
                f"{panel} .node-tools, {panel} form.budget"), [])
        self.assert_nothing_logged()

    def test_nothing_is_cut_off_faint_or_too_small_for_a_finger(self):
        self.come_in(tab="scene")
        self.wall.create("/broken", "ProxyGroup", file="asset://no-such-file-of-a-rather-long-name.glb", load="at-once")
        for width, theme in self.browser.sizes_and_themes():
            for name in ("tree", "materials", "animations", "inlines", "budget", "question", "choice"):
                self.browser.run("scrollTo(0, 0)")
                self.part("tree" if name in ("question", "choice") else name)
                if name == "tree":
                    self.select("turned")
                    self.field("rotation, degrees about x")
                elif name == "question":
                    self.select("goner")
                    self.press(".node-tools button", "Remove")
                    self.shown("dialog[open]")
                elif name == "choice":
                    self.select("ball")
                    self.browser.run("arguments[0].click()", self.field("material, Choose…"))
                awaited = {"materials": ".materials canvas", "animations": ".animation", "inlines": ".inline .said",
                           "choice": ".choices canvas"}.get(name)
                if awaited:
                    self.shown(awaited)
                with self.subTest(width=width, theme=theme, part=name):
                    self.assertEqual(self.browser.faults(), [])
                self.browser.shoot(f"scene-{name}-{width}-{theme}")
                self.browser.run("for (const one of document.querySelectorAll('dialog[open]')) one.close()")
        self.wall.remove("/broken")
        self.assert_nothing_logged()


if __name__ == "__main__":
    unittest.main()
