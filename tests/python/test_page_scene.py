"""The console's page in a real browser, before a real wall: all of its tabs, as a viewer, over a restart, at two sizes
in two themes."""
import re
import unittest

import page_browser
import page_wall


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class Page(page_wall.BesideALamp):
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
        self.select(page_wall.STRANGE)
        self.assertEqual(self.field("choice").get_property("value"), "all", "its default, in words")
        self.field("choice").send_keys("none")
        self.browser.until("none is chosen", lambda: self.wall["/" + page_wall.STRANGE].choice == "none")
        self.assert_nothing_logged()

    def test_names_are_text_whatever_stands_in_them(self):
        self.come_in(tab="scene")
        self.select(page_wall.STRANGE)
        self.row("世界 مرحبا 👋")
        self.assertEqual(self.browser.text(".object h2"), page_wall.STRANGE)
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
        with self.live.connect(name=page_wall.STRANGE):
            self.browser.until("one more", lambda: "3 here" in self.browser.text("#identity"))
            self.browser.all("#identity")[0].click()
            self.browser.until("the name of all",
                               lambda: page_wall.STRANGE in self.browser.text("dialog[open] .people"))
            self.assertIn("(you)operator", self.browser.text("dialog[open] .people"))
        self.browser.until("one less", lambda: page_wall.STRANGE not in self.browser.text("dialog[open] .people"))
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
