"""The console's page in a real browser, before a real wall: by keys alone, as a viewer, over a restart, at two sizes in
two themes."""
import re
import unittest

import page_browser
import page_wall

STRANGE = "<img src=x onerror=alert(1)>"


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class Page(page_wall.OnAPage):
    options = {"surface": "osmesa", "size": "64x48", "journal": True}

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with cls.wall.edit() as edit:
            edit.create("/lamp", "PointLight", intensity=2.0, range=5.0)
            edit.create("/" + STRANGE, "Switch")
            edit.create("/世界 مرحبا 👋", None)
            edit.create("/many")
            for i in range(450):
                edit.create(f"/many/{i}", None)

    def row(self, name):
        return self.browser.until(f"a row {name}",
                                  lambda: next((row for row in self.browser.all("[role=treeitem]") if name in row.text),
                                               None))

    def select(self, name):
        self.row(name).click()
        self.browser.until(f"the fields of {name}", lambda: name in self.browser.text(".object h2"))

    def field(self, label):
        return self.browser.until(f"a field {label}",
                                  lambda: next(iter(self.browser.all(f".object [aria-label='{label}']")), None))

    def test_the_token_lets_in_and_does_not_stay_in_the_address(self):
        self.come_in()
        self.assertNotIn("token", self.browser.driver.current_url)
        self.browser.until("its role, beside the test's own link",
                           lambda: self.browser.text("#identity") == "You: operator · 2 here")
        self.browser.until("a state", lambda: "running" in self.browser.text("#wall-state"))
        self.browser.logged()
        # Without it the server asks, and the page still has it
        self.browser.open(self.browser.driver.current_url.partition("#")[0])
        self.browser.until("the wall again", lambda: self.browser.text("#wall-name") == "1x1")
        self.assertTrue(all("401" in line for line in self.browser.logged()))

    def test_who_has_no_token_is_asked_for_one(self):
        self.come_in()
        self.browser.run("sessionStorage.clear()")
        link, _, token = self.live.link().partition("?token=")
        self.browser.open(f"{link}?token=wrong")
        self.browser.until("the form", lambda: self.browser.all("input[name=token]"))
        self.browser.all("input[name=token]")[0].send_keys(token, "\n")
        self.browser.until("the wall", lambda: self.browser.text("#wall-name") == "1x1")

    def test_the_wall_is_shown_with_a_row_for_each_tile(self):
        self.come_in()
        canvas = "document.querySelector('#panel-wall canvas')"
        pixels = (f"const c = {canvas}; return c && c.width > 40 && new Set(c.getContext('2d').getImageData(0, 0, "
                  f"c.width, c.height).data).size")
        self.browser.until("a picture with more than one colour", lambda: (self.browser.run(pixels) or 0) > 10)
        rows = self.browser.until("its tile", lambda: self.browser.all(".tile-list button"))
        rows[0].click()
        self.browser.until("its numbers", lambda: "Round trip" in self.browser.text("dialog[open]"))
        self.assertIn("live", self.browser.text("dialog[open]"))
        self.browser.press("\ue00c")  # Escape
        self.assertFalse(self.browser.all("dialog[open]"))
        self.assert_nothing_logged()

    def test_a_room_is_cut_open_and_folded_flat_with_one_eye(self):
        corners = {"front": ([-1, 0, 0], [1, 0, 0], [-1, 2, 0]), "left": ([-1, 0, 2], [-1, 0, 0], [-1, 2, 2]),
                   "right": ([1, 0, 0], [1, 0, 2], [1, 2, 0]), "floor": ([-1, 0, 2], [1, 0, 2], [-1, 0, 0]),
                   "far": ([9, 0, 0], [10, 0, 0], [9, 1, 0.5])}
        places = {name: dict(zip(("lower_left", "lower_right", "upper_left"), each)) for name, each in corners.items()}
        plan = {"screens": [{"name": name, **place} for name, place in places.items()],
                "tiles": [{"name": f"{name}-{eye}", "screen": name, "eye": eye, "x": 0, "y": 0, "width": 8, "height": 8,
                           **place}
                          for name, place in places.items() for eye in ("right", "left")]}
        self.come_in()
        room, far = self.browser.driver.execute_async_script("""
            const [plan, done] = arguments;
            import('/page/unfold.js').then(({ unfold }) => done(unfold(plan)), (error) =>
              done(String(error)));""", plan)
        at = {tile["name"]: (round(tile["x"], 9), round(tile["y"], 9)) for tile in room["tiles"]}
        self.assertEqual(at, {"front-left": (2, 0), "left-left": (0, 0), "right-left": (4, 0), "floor-left": (2, 2)})
        self.assertEqual((room["width"], room["height"], far["name"]), (6, 4, "far"))

    def test_keys_alone_lead_to_a_field_and_back_by_undo(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in()
        for _ in range(10):
            self.browser.press(Keys.TAB)
            if self.browser.focused() == "Wall":
                break
        for _ in range(10):
            if self.browser.focused() == "Scene":
                break
            self.browser.press(Keys.ARROW_RIGHT)
        self.row("floor")
        self.browser.press(Keys.TAB)
        self.assertEqual(self.browser.focused(), "Tree")
        self.browser.press(Keys.TAB)
        self.assertEqual(self.browser.focused(), "Search the scene")
        for _ in range(4):
            self.browser.press(Keys.TAB)
            if self.browser.run("return document.activeElement.role") == "treeitem":
                break
        for _ in range(40):
            if "floor" in self.browser.focused():
                break
            self.browser.press(Keys.ARROW_DOWN)
        self.browser.press(Keys.ENTER)
        self.browser.until("the floor's fields", lambda: self.browser.focused() == "floor")
        for _ in range(12):
            self.browser.press(Keys.TAB)
            if self.browser.focused() == "translation, x":
                break
        self.browser.press("a", control=True)
        self.browser.press("3", Keys.ENTER)
        self.browser.until("the floor has moved", lambda: self.wall["/floor"].translation[0] == 3.0)
        self.browser.until("a step to take back", lambda: "(" in self.browser.text(".tools button"))
        self.browser.run("document.querySelector('.object h2').focus()")
        self.browser.press("z", control=True)
        self.browser.until("the floor is back", lambda: self.wall["/floor"].translation[0] == 0.0)
        self.assert_nothing_logged()

    def test_a_refused_value_says_why_and_the_old_one_stays(self):
        self.come_in(tab="scene")
        self.select("lamp")
        field = self.field("intensity")
        self.browser.until("its value", lambda: field.get_property("value") == "2")
        for wrong in ("-1", "bright"):
            self.browser.run("arguments[0].focus(); arguments[0].select()", field)
            field.send_keys(wrong, "\n")
            self.browser.until(f"a word about {wrong}", lambda: self.browser.all(".field .said"))
            self.browser.until("the old value", lambda: field.get_property("value") == "2")
            self.assertIn("intensity" if wrong == "-1" else "number", self.browser.all(".field .said")[0].text)
        self.assertEqual(self.wall["/lamp"].intensity, 2.0)
        self.assert_nothing_logged()

    def test_words_switches_and_colours(self):
        self.come_in(tab="scene")
        self.select("lamp")
        self.field("on").click()
        self.browser.until("it is off", lambda: self.wall["/lamp"].on is False)
        self.browser.run("""const picker = arguments[0];
          picker.value = '#ff0000'; picker.dispatchEvent(new Event('change'))""", self.field("color, picker"))
        self.browser.until("it is red", lambda: tuple(self.wall["/lamp"].color) == (1.0, 0.0, 0.0))
        self.select(STRANGE)
        self.assertEqual(self.field("choice").get_property("value"), "all", "its default, in words")
        self.field("choice").send_keys("none")
        self.browser.until("none is chosen", lambda: self.wall["/" + STRANGE].choice == "none")
        self.assert_nothing_logged()

    def test_names_are_text_whatever_stands_in_them(self):
        self.come_in(tab="scene")
        self.select(STRANGE)
        self.row("世界 مرحبا 👋")
        self.assertEqual(self.browser.text(".object h2"), STRANGE)
        self.assertEqual(self.browser.run("return document.querySelectorAll('main img').length"), 0)
        self.assert_nothing_logged()

    def test_many_children_come_in_pages_and_are_found(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in(tab="scene")
        self.select("many")
        self.browser.run("arguments[0].focus()", self.row("many"))
        self.browser.press(Keys.ARROW_RIGHT)
        more = self.row("Show more of 250")
        self.assertLess(len(self.browser.driver.find_elements("css selector", "[role=treeitem]")), 250)
        self.browser.run("arguments[0].click()", more)
        self.row("Show more of 50")
        self.browser.all("input[type=search]")[0].send_keys("/many/44*")
        self.browser.until("what was looked for", lambda: self.browser.text("[role=status].muted") == "11 found")
        self.assert_nothing_logged()

    def test_who_is_here_is_told_as_they_come_and_go(self):
        self.come_in()
        self.browser.until("a number", lambda: "2 here" in self.browser.text("#identity"))
        with self.live.connect(name=STRANGE):
            self.browser.until("one more", lambda: "3 here" in self.browser.text("#identity"))
            self.browser.all("#identity")[0].click()
            self.browser.until("the name of all", lambda: STRANGE in self.browser.text("dialog[open] .people"))
            self.assertIn("(you)operator", self.browser.text("dialog[open] .people"))
        self.browser.until("one less", lambda: STRANGE not in self.browser.text("dialog[open] .people"))
        self.browser.press("\ue00c")  # Escape
        self.assert_nothing_logged()

    def test_what_undo_would_take_back_is_said_before(self):
        self.come_in(tab="scene")
        self.select("lamp")
        self.wall.ask("MoveNode", node=self.wall["/post"].id, translation=(0, 0, -3))
        self.browser.until("the next step",
                           lambda: self.browser.text("#next-steps") == "↶ sets Transform.translation of /post")
        self.browser.all(".tools button")[0].click()
        self.browser.until("the way back",
                           lambda: "↷ sets Transform.translation of /post" in self.browser.text("#next-steps"))
        self.assert_nothing_logged()

    def test_a_host_that_is_lost_is_named_on_the_page(self):
        self.come_in(tab="time")
        name = self.wall.status().hosts[0].name
        host = next(process for process in self.live._processes if name in process.args and process.poll() is None)
        self.browser.until("no fault yet", lambda: "running" in self.browser.text("#wall-state"))
        host.kill()
        host.wait()
        self.browser.until("its name", lambda: f"Host {name}: live, now" in self.browser.text(".faults"))
        self.live.start_host(name)
        self.browser.until("all is well", lambda: "running" in self.browser.text("#wall-state"))

    def test_who_only_looks_sees_nothing_to_change(self):
        self.come_in("viewer", "scene")
        self.browser.until("its role", lambda: self.browser.text("#identity").startswith("You: viewer"))
        self.select("lamp")
        self.browser.until("values", lambda: "intensityat least 02" in self.browser.text(".object"))
        self.assertEqual(self.browser.all(".object input, .object select, .tools button"), [])
        self.assert_nothing_logged()

    def test_a_restart_is_told_and_needs_no_new_page(self):
        self.come_in()
        self.browser.run("window.isSamePage = true")
        self.live.kill_server()
        self.browser.until("a banner",
                           lambda: "Connection lost" in self.browser.text("#banner") and self.browser.all("#banner"))
        self.live.start_server()
        self.browser.until("no banner", lambda: not self.browser.all("#banner"))
        self.browser.until("the wall runs", lambda: "running" in self.browser.text("#wall-state"))
        self.assertTrue(self.browser.run("return window.isSamePage"))
        self.assertIn("started again", self.browser.text(".faults"))
        self.assertTrue(all(re.search("WebSocket|ERR_|/api", line) for line in self.browser.logged()))

    def test_a_token_that_counts_no_more_is_asked_for_on_the_page(self):
        self.come_in()
        token = self.browser.run("const kept = sessionStorage.getItem('tessera-token'); "
                                 "sessionStorage.setItem('tessera-token', 'old'); return kept")
        self.live.kill_server()
        self.live.start_server()
        form = self.browser.until("the form", lambda: self.browser.all("#banner input"))
        self.assertEqual(self.browser.run("return document.activeElement.name"), "token")
        form[0].send_keys(token, "\n")
        self.browser.until("no banner", lambda: not self.browser.all("#banner"))
        self.browser.until("the wall runs", lambda: "running" in self.browser.text("#wall-state"))

    def test_nothing_is_cut_off_faint_or_too_small_for_a_finger(self):
        self.come_in()
        for width, theme in self.browser.sizes_and_themes():
            for tab in ("wall", "time", "scene"):
                self.browser.run(f"document.getElementById('tab-{tab}').click()")
                if tab == "scene":
                    self.select("lamp")
                    self.field("intensity")
                with self.subTest(width=width, theme=theme, tab=tab):
                    self.assertEqual(self.browser.faults(), [])
                self.browser.shoot(f"{tab}-{width}-{theme}")
        self.assert_nothing_logged()


if __name__ == "__main__":
    unittest.main()
