"""Keys alone on the console's page: what has the focus is still there, or its neighbour has it, whatever comes and
goes; and much at once."""
import pathlib
import tempfile
import unittest

import page_browser
import page_wall

MANY = 450  # children of one node, and files of a folder
LONG = "host-" + "x" * 58

WALL = f"""screens {{ name: "front" lower_left {{ x: -1 }} lower_right {{ x: 1 }} upper_left {{ x: -1 y: 1 }}
  grid {{ columns: 2 rows: 1 tile_width_px: 64 tile_height_px: 64 }} }}
users {{ name: "{LONG}" position {{ x: 0 y: 0.5 z: 2 }} }}
hosts {{ name: "{LONG}" tiles {{ screen: "front" column: 0 row: 0 eye: CENTER user: "{LONG}" }} }}
hosts {{ name: "right" tiles {{ screen: "front" column: 1 row: 0 eye: CENTER user: "{LONG}" }} }}
"""
FOCUSED = """const at = document.activeElement;
return at === document.body ? 'nothing' : at.querySelector('.name')?.textContent || at.getAttribute('aria-label') ||
  at.textContent || at.id"""


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class PageKeys(page_wall.OnAPage):
    @classmethod
    def setUpClass(cls):
        folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        (folder / "long.wall").write_text(WALL)
        (folder / "models").mkdir()
        for i in range(MANY):
            (folder / "models" / f"{i:04}.obj").write_text("v 0 0 0\n")
        cls.wall_name, cls.options = str(folder / "long.wall"), {
            "surface": "none", "options": ["--allow", str(folder / "models")]}
        super().setUpClass()
        with cls.wall.edit() as edit:
            edit.create("/many")
            for i in range(MANY):
                edit.create(f"/many/child {i:04}", None)
            for i in range(60):
                edit.create(f"/plays {i:02}", "Animation", playing=False)

    def focused(self, what):
        self.browser.until(f"the focus on {what}", lambda: what in self.browser.run(FOCUSED))

    def press_on(self, selector, text, *keys):
        """As who has come there by keys."""
        self.browser.until(f"{selector} with {text}", lambda: self.browser.run(
            "const found = [...document.querySelectorAll(arguments[0])].find((one) => one.checkVisibility() && "
            "one.textContent.includes(arguments[1]));"
            "found?.focus(); return Boolean(found)", selector, text))
        self.browser.press(*keys)

    def is_there(self, text):
        return self.browser.run("return [...document.querySelectorAll('[role=treeitem]')].some((row) => "
                                "row.textContent.includes(arguments[0]))", text)

    def test_the_focus_stays_on_its_row_or_goes_to_the_next(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in(tab="scene")
        self.press_on("[role=treeitem]", "many", Keys.ARROW_RIGHT)
        self.press_on("[role=treeitem]", "child 0009", Keys.ARROW_DOWN)
        self.focused("child 0010")
        self.wall.remove("/many/child 0003")
        self.browser.until("it is gone", lambda: not self.is_there("child 0003"))
        self.focused("child 0010")
        self.wall.remove("/many/child 0010")
        self.browser.until("that is gone, too", lambda: not self.is_there("child 0010"))
        self.focused("child 0011")
        self.browser.press(Keys.ARROW_DOWN)
        self.focused("child 0012")
        self.assert_nothing_logged()

    def test_undo_to_the_end_does_nothing_again(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in(tab="scene")
        steps = self.wall.status().undo_depth
        self.wall.ask("MoveNode", node=self.wall["/many"].id, translation=(0, 0, 3))
        self.browser.until("a step", lambda: f"({steps + 1})" in self.browser.text(".tools button"))
        for left in range(steps, -1, -1):
            self.press_on(".tools button", "Undo", Keys.ENTER)
            self.browser.until(f"{left} left",
                               lambda: self.browser.text(".tools button") == (f"↶ Undo ({left})" if left else "↶ Undo"))
        self.focused("Undo")
        self.browser.press(Keys.ENTER, Keys.ENTER)
        self.assertNotIn("/many", self.wall)
        for left in range(steps, -1, -1):
            self.press_on(".tools button", "Redo", Keys.ENTER)
            self.browser.until(f"{left} to do again",
                               lambda: self.browser.text(".tools button:nth-child(2)") == (
                                   f"↷ Redo ({left})" if left else "↷ Redo"))
        self.focused("Redo")
        self.assertIn("/many", self.wall)
        self.assert_nothing_logged()

    def test_more_of_a_list_begins_where_it_ended(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in(tab="scene")
        self.press_on("input[type=search]", "", "child 0")
        self.press_on(".results button", "Search on", Keys.ENTER)
        self.browser.until("two pages",
                           lambda: self.browser.run("return document.querySelectorAll('.results li').length") > 150)
        self.focused(self.browser.run("return document.querySelectorAll('.results .name')[100].textContent"))
        self.browser.run("document.getElementById('tab-scene-animations').click()")
        self.press_on(".tools button", "On ›", Keys.ENTER)
        self.focused("51 to ")
        self.browser.run("document.getElementById('tab-files').click()")
        self.press_on(".folder button", "models", Keys.ENTER)
        self.press_on(".folder button", "Show more", Keys.ENTER)
        self.focused("0200.obj")
        self.assert_nothing_logged()

    def test_what_the_banner_had_the_page_has(self):
        self.come_in()
        self.live.kill_server()
        self.browser.until("a button", lambda: self.browser.all("#banner button"))
        self.browser.run("document.querySelector('#banner button').focus()")
        self.live.start_server()
        self.browser.until("no banner", lambda: not self.browser.all("#banner"))
        self.assertEqual(self.browser.run("return document.activeElement.id"), "content")

    def test_a_budget_is_set_and_may_be_set_again(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in(tab="scene")
        self.browser.run("document.getElementById('tab-scene-budget').click()")
        for budget in (40, 50):
            self.browser.run("document.querySelector('[aria-label=\"Budget in ms\"]').select()")
            self.press_on("[aria-label='Budget in ms']", "", str(budget), Keys.ENTER)
            self.browser.until("it is set", lambda: self.wall.status().budget_ms == budget)
            self.focused("Budget in ms")
        self.wall.ask("SetBudget", milliseconds=0)
        self.assert_nothing_logged()

    def test_a_dialog_keeps_the_keys_and_gives_the_focus_back(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in(tab="scene")
        self.press_on("[role=treeitem]", "plays 00", Keys.ENTER)
        self.browser.until("its fields", lambda: self.browser.text(".object h2") == "plays 00")
        openers = [("scene", "#identity", "You"), ("scene", ".node-tools button", "New child"),
                   ("scene", ".node-tools button", "Remove"),
                   ("scene", ".object .choose", "Choose"), ("wall", ".tile-list button", "front"),
                   ("files", ".folder .results button", "0001.obj")]
        for tab, selector, text in openers:
            self.browser.run(f"document.getElementById('tab-{tab}').click()")
            if tab == "files" and not self.browser.run(
                "return document.querySelector('.folder h3').textContent.includes('models')"):
                self.press_on(".folder button", "models", Keys.ENTER)
            with self.subTest(text):
                self.press_on(selector, text, Keys.ENTER)
                self.browser.until("a dialog", lambda: self.browser.all("dialog[open]"))
                controls = self.browser.run("return [...document.querySelectorAll('dialog[open] :is(button, input, "
                                            "select, textarea)')].filter((one) => one.checkVisibility()).length")
                seen = set()
                for keys in [(Keys.TAB,)] * (controls + 2) + [(Keys.SHIFT, Keys.TAB, Keys.NULL)] * 3:
                    self.browser.press(*keys)
                    where, label, around = self.browser.run(
                        "const at = document.activeElement; return [at === document.body || "
                        "at.closest('dialog[open]') !== null, at.getAttribute('aria-label') || at.textContent || "
                        "at.id, getComputedStyle(at.parentElement ?? at).overflow]")
                    self.assertTrue(where, f"outside: {label}")
                    self.assertIn(around, ("visible", "auto"), f"what shows the focus is clipped: {label}")
                    seen.add(label)
                self.assertGreaterEqual(len(seen), min(controls, 5))
                self.browser.press(Keys.ESCAPE)
                self.browser.until("it is closed", lambda: not self.browser.all("dialog[open]"))
                self.assertTrue(self.browser.run(
                    "return document.activeElement.matches(arguments[0]) && "
                    "document.activeElement.textContent.includes(arguments[1])", selector, text))
        self.assert_nothing_logged()

    def test_all_that_has_the_focus_by_keys_is_seen_to_have_it(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in()
        for tab in ("wall", "plan", "time", "scene", "files"):
            self.browser.run(f"document.getElementById('tab-{tab}').click(); "
                             f"document.getElementById('tab-{tab}').focus()")
            self.browser.until("its panel", lambda: self.browser.all(f"#panel-{tab}"))
            for _ in range(14):
                self.browser.press(Keys.TAB)
                at, width, is_whole = self.browser.run("""
                    const at = document.activeElement, style = getComputedStyle(at), box = at.getBoundingClientRect();
                    const under = document.querySelector('.tabs').getBoundingClientRect();
                    return [at.outerHTML.slice(0, 90),
                      style.outlineStyle === 'none' ? 0 : parseFloat(style.outlineWidth),
                            box.bottom > (at.closest('main') ? under.bottom : 0) && box.top < innerHeight];""")
                if at.startswith("<body"):
                    break
                with self.subTest(tab=tab, at=at):
                    self.assertGreaterEqual(width, 2)
                    self.assertTrue(is_whole, "below the tabs, or out of sight")
        self.assert_nothing_logged()

    def test_long_names_of_hosts_and_users_cut_nothing_off(self):
        self.come_in()
        for width, theme in self.browser.sizes_and_themes():
            for tab in ("wall", "plan", "time"):
                self.browser.run(f"document.getElementById('tab-{tab}').click()")
                with self.subTest(width=width, theme=theme, tab=tab):
                    if tab == "plan":
                        self.browser.until("heads",
                                           lambda: self.browser.run(
                                               "return document.querySelector('.plan .head') !== null"))
                        self.assertEqual(self.browser.run("""
                          return [...document.querySelectorAll('.plan text')].filter((label) => {
                          const box = label.getBoundingClientRect(),
                            whole = label.ownerSVGElement.getBoundingClientRect();
                          return box.left < whole.left || box.right > whole.right;
                            }).map((label) => label.textContent)"""), [])
                    self.assertEqual(self.browser.faults(), [])
        self.assert_nothing_logged()

    def test_hundreds_of_materials_leave_room_for_hands(self):
        self.come_in()
        drawn = self.browser.driver.execute_async_script("""
            const done = arguments[0], make = () => Object.assign(document.createElement('canvas'), { width: 96,
              height: 96 });
            Promise.all([import('/page/material-preview.js'),
              import('/page/token.js')]).then(async ([{ drawMaterialSoon }, { authorization }]) => {
              const { types } = await (await fetch('/api', { headers: authorization() })).json();
              const fields = Object.fromEntries(types.find(({ name }) => name === 'Material').fields.map((field) =>
                [field.name, field.default]));
              const canvases = [...Array(200)].map(make), gone = make();
              document.body.append(...canvases);
              for (const canvas of [...canvases, gone]) drawMaterialSoon(canvas, fields);
              const isDrawn = (canvas) => canvas.getContext('2d').getImageData(canvas.width / 2, canvas.height / 2, 1,
                1).data[3] > 0;
              const many = () => canvases.filter(isDrawn).length;
              await new Promise((next) => setTimeout(next, 1));
              const first = many();
              while (many() < canvases.length) await new Promise((next) => setTimeout(next, 10));
              done([first, many(), isDrawn(gone)]);
            }).catch((error) => done(String(error)));""")
        self.assertLess(drawn[0], 100)
        self.assertEqual(drawn[1:], [200, False])

    def test_a_minute_of_thousands_of_frames_a_second_is_plotted(self):
        self.come_in()
        self.assertEqual(self.browser.driver.execute_async_script("""
            const done = arguments[0];
            import('/page/plot.js').then(({ Plot, Samples }) => {
              const samples = new Samples(), now = performance.now();
              for (let i = 0; i < 240_000; ++i) samples.add(now - 60_000 + i / 4, i % 7);
              const plot = new Plot('frames', 'ms', [{ name: 'all', samples }]);
              document.body.append(plot.node);
              plot.draw(now);
              done(plot.node.querySelector('.scale').textContent);
            }).catch((error) => done(String(error)));"""), "10 ms")


# Frames that the page is told of, and how often it has been told how the wall is since the last one.
COUNTED = """
window.told = window.statuses = 0;
window.WebSocket = class extends WebSocket {
  constructor(...said) {
    super(...said);
    this.addEventListener('message', ({ data }) => {
      if (typeof data !== 'string') return;
      if (data.includes('"answer":"Status"')) ++window.statuses;
      if (!data.includes('"notice":"Frame"')) return;
      ++window.told;
      window.statuses = 0;
    });
  }
};
"""


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class FastWall(page_wall.OnAPage):
    options = {"surface": "none", "options": ["--rate", "0"]}

    def test_a_wall_faster_than_any_screen_does_not_tell_of_each_frame(self):
        self.browser.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": COUNTED})
        self.come_in(tab="time")
        self.browser.until("many frames",
                           lambda: self.browser.run(
                               "return Number(document.getElementById('frame-rate').textContent) > 150"))
        self.assertGreater(self.browser.run("return window.told"), 0)
        # It asks once a second how the wall is
        self.browser.until("no more of them", lambda: self.browser.run("return window.statuses") >= 2)
        self.browser.until("how long one takes",
                           lambda: float(self.browser.text(".plot strong").replace("–", "99")) < 7)
        self.assert_nothing_logged()


if __name__ == "__main__":
    unittest.main()
