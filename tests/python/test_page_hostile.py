"""The console's page among others: names that nobody sees or that never end, a flood of changes, two who drag one
thing, tabs, other versions."""
import unittest

import page_browser
import page_wall

UNSEEN = "\u200b\u200b"
BLANK = "   "
LONG = "long name " * 400
TURNED = "\u202eevil\u202c مرحبا <b>bold</b>"

# Whether the last letter of what is said of a person by that name stands to the right of all others.
ENDS = """
const text = [...document.querySelectorAll('.people .muted')].find((one) =>
  one.textContent.includes(arguments[0])).firstChild;
const lefts = [...text.data].map((_, at) => { const range = document.createRange(); range.setStart(text, at);
  range.setEnd(text, at + 1); return range.getBoundingClientRect().left; });
return lefts.at(-1) === Math.max(...lefts);
"""
# Controls that nobody reads out: without a text, a label, or a title. As a browser's tree for screen readers has it.
UNNAMED_ROLES = {"button", "link", "textbox", "searchbox", "checkbox", "switch", "slider", "combobox", "radio", "tab",
                 "treeitem", "spinbutton", "ColorWell"}


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class PageHostile(page_wall.OnAScene):
    options = {"surface": "osmesa", "size": "64x48", "journal": True}

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with cls.wall.edit() as edit:
            cls.names = edit.create("/names", None)
            for name in (UNSEEN, BLANK, LONG, TURNED):
                edit.add(cls.names, name)
            edit.create("/lamp", "PointLight", intensity=2.0, range=5.0)
            edit.create("/plate", "Transform")
            edit.create("/swing", "Animation", playing=False)

    def show_names(self):
        self.come_in(tab="scene")
        self.browser.run("arguments[0].querySelector('.toggle').click()", self.row("names"))

    # ---- names

    def test_names_that_nobody_would_see_are_told_in_code_points(self):
        self.show_names()
        self.select("U+200B U+200B")
        self.assertEqual(self.browser.text(".object .path"), "/names/U+200B U+200B")
        self.select("U+0020 U+0020 U+0020")
        self.browser.run("const input = document.querySelector('input[type=search]'); input.value = '/names/*'; "
                         "input.dispatchEvent(new Event('input'))")
        self.browser.until("all of them", lambda: self.browser.text(".browse [role=status]") == "4 found")
        self.assertEqual(self.browser.text(".results .name"), "/names/U+200B U+200B")
        self.assert_nothing_logged()

    def test_names_without_end_leave_the_fields_in_sight(self):
        for width, height in page_browser.SIZES:
            self.browser.size(width, height)
            self.show_names()
            for name in (LONG, TURNED):
                self.select(name)
                with self.subTest(width=width, name=name[:9]):
                    self.assertEqual(self.browser.faults(), [])
                    title, field = (self.browser.run(
                        f"return document.querySelector('{one}').getBoundingClientRect().top") for one in (
                            ".object h2", ".object .field"))
                    self.assertLess(field - title, height)
            self.browser.run("[...document.querySelectorAll('.node-tools button')].find((one) => "
                             "one.textContent.includes('Remove')).click()")
            self.browser.until("a question", lambda: self.browser.all("dialog[open]"))
            self.assertEqual(self.browser.faults(), [])
        self.assertEqual(self.browser.run("return document.querySelectorAll('main b, main img').length"), 0)
        self.assert_nothing_logged()

    def test_a_name_that_turns_letters_turns_none_beside_it(self):
        turns = "\u202eopen"
        with self.wall.edit() as edit:
            edit.create(f"/{turns}", None)
            edit.create("/beside", None)
        with self.live.connect(name=turns):
            self.come_in(tab="scene")
            self.browser.run("document.getElementById('identity').click()")
            self.browser.until("its name", lambda: turns in self.browser.text(".people"))
            self.assertTrue(self.browser.run(ENDS, turns))
            self.browser.press("\ue00c")  # Escape
        self.browser.until("what undo would do", lambda: "beside" in self.browser.text("#next-steps"))
        self.assertNotIn("\u202e", self.browser.text("#next-steps"))
        self.assert_nothing_logged()

    # ---- fields that others change, too

    def test_what_one_types_stays_and_the_rest_of_the_field_follows(self):
        self.come_in(tab="scene")
        self.select("plate")
        x, y = self.field("translation, x"), self.field("translation, y")
        self.browser.run("arguments[0].focus(); arguments[0].select()", y)
        y.send_keys("7.")
        for i in range(1, 40):
            self.wall["/plate"].translation = (i, i, i)
        self.browser.until("the newest x", lambda: x.get_property("value") == "39")
        y.send_keys("25\n")
        self.browser.until("both have what they have set",
                           lambda: tuple(self.wall["/plate"].translation) == (39, 7.25, 39))
        # Who only looks in sees the newest as soon as they leave.
        self.browser.run("arguments[0].focus()", x)
        self.wall["/plate"].translation = (5, 5, 5)
        self.browser.until("the newest y", lambda: y.get_property("value") == "5")
        self.assertEqual(x.get_property("value"), "39")
        self.browser.run("arguments[0].blur()", x)
        self.browser.until("the newest x", lambda: x.get_property("value") == "5")
        self.assert_nothing_logged()

    def test_the_next_step_names_the_node_of_a_core(self):
        self.come_in(tab="scene")
        self.wall["/lamp"].intensity = 3.0
        self.browser.until("its path",
                           lambda: self.browser.text("#next-steps").startswith("↶ sets PointLight.intensity of /lamp"))
        self.assert_nothing_logged()

    # ---- tabs and addresses

    def test_a_bookmark_of_another_tab_opens_it_and_a_skip_leaves_it(self):
        self.come_in(tab="time")
        self.browser.run("location.hash = '#plan'")
        self.browser.until("the plan", lambda: self.browser.all("#panel-plan"))
        self.browser.run("document.querySelector('.skip').click()")
        self.browser.until("its own address", lambda: self.browser.run("return location.hash") == "#plan")
        self.assertTrue(self.browser.all("#panel-plan"))
        self.browser.driver.refresh()
        self.browser.until("the plan again", lambda: self.browser.all("#panel-plan"))
        self.browser.driver.back()
        self.browser.driver.forward()
        self.browser.until("the plan once more",
                           lambda: "running" in self.browser.text("#wall-state") and self.browser.all("#panel-plan"))

    def test_another_version_loads_the_page_anew_but_not_from_under_a_hand(self):
        changed = """
            const real = fetch;
            window.isSamePage = true;
            window.fetch = async (...said) => {
              const answer = await real(...said);
              return said[0] === '/api' ? Response.json({ ...await answer.json(), version: '9.9.9' }) : answer;
            };"""
        self.come_in(tab="scene")
        self.browser.run(changed)
        self.browser.run("document.querySelector('input[type=search]').focus()")
        self.live.kill_server()
        self.browser.until("a banner", lambda: "lost" in self.browser.text("#banner"))
        self.live.start_server()
        self.browser.until("an offer",
                           lambda: "another version" in self.browser.text("#banner")
                           and self.browser.all("#banner button"))
        self.assertTrue(self.browser.run("return window.isSamePage"))
        self.browser.all("#banner button")[0].click()
        self.browser.until("another page", lambda: not self.browser.run("return window.isSamePage"))
        self.browser.until("the wall",
                           lambda: "running" in self.browser.text("#wall-state") and not self.browser.all("#banner"))
        self.browser.run(changed)
        self.browser.run("document.activeElement.blur()")
        self.live.kill_server()
        self.live.start_server()
        self.browser.until("another page by itself", lambda: not self.browser.run("return window.isSamePage"))
        self.browser.until("the wall", lambda: "running" in self.browser.text("#wall-state"))

    def test_what_is_refused_for_a_moment_is_asked_for_again(self):
        self.come_in(tab="scene")
        self.browser.run("""
            const real = fetch, send = WebSocket.prototype.send;
            let refused = 0;
            window.fetch = (...said) => said[0] === '/api' && ++refused < 3 ? Promise.resolve(new Response('',
              { status: 503 })) : real(...said);
            window.looks = 0;
            WebSocket.prototype.send = function (text) {  // which no wall knows
              return send.call(this, text.includes('"GetStatus"') && ++looks < 3 ? text.replace('GetStatus',
                'GetNothing') : text);
            };""")
        self.live.kill_server()
        self.browser.until("a banner", lambda: "lost" in self.browser.text("#banner"))
        self.live.start_server()
        self.browser.until("the wall", lambda: "running" in self.browser.text("#wall-state"))
        self.select("lamp")
        self.field("intensity")

    def test_while_nobody_looks_no_picture_is_asked_for(self):
        added = self.browser.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": """
            window.asked = {};
            const send = WebSocket.prototype.send;
            WebSocket.prototype.send = function (text) {
              const { request } = JSON.parse(text);
              asked[request] = (asked[request] ?? 0) + 1;
              return send.call(this, text);
            };"""})
        self.addCleanup(self.browser.driver.execute_cdp_cmd, "Page.removeScriptToEvaluateOnNewDocument", added)

        def asked(request):
            return self.browser.run("return asked[arguments[0]] ?? 0", request)
        self.come_in()
        self.browser.until("pictures", lambda: asked("GetPreview") > 1)
        self.addCleanup(self.browser.driver.set_window_rect, 0, 0, 1280, 800)
        self.browser.driver.minimize_window()
        self.browser.until("it is hidden", lambda: self.browser.run("return document.visibilityState") == "hidden")
        pictures, looks = asked("GetPreview"), asked("GetStatus")
        self.wall["/carriage"].translation = (-2, 1.5, 0)
        self.browser.until("some seconds", lambda: asked("GetStatus") > looks + 2)
        self.assertEqual(asked("GetPreview"), pictures)
        self.browser.driver.set_window_rect(0, 0, 1280, 800)
        self.browser.until("pictures again", lambda: asked("GetPreview") > pictures + 1)
        self.assert_nothing_logged()

    def test_a_page_that_sleeps_does_not_take_its_own_sleep_for_the_walls(self):
        self.come_in(tab="time")
        self.browser.until("frames", lambda: "–" not in self.browser.text(".plot strong"))
        with self.browser.asleep():
            frame = self.wall.status().frame
            page_browser.until("five seconds of frames", lambda: self.wall.status().frame > frame + 300)
        seen = self.wall.status().frame
        self.browser.until("a second of frames", lambda: self.wall.status().frame > seen + 60)
        self.assertLess(float(self.browser.text(".plot .scale").split()[0]), 3000)
        self.browser.logged()

    # ---- for everybody

    def test_paper_is_white(self):
        self.come_in()
        if self.browser.run("return document.documentElement.dataset.theme") != "dark":
            self.browser.run("document.getElementById('theme').click()")
        self.browser.run("window.printed = []; for (const kind of ['beforeprint', 'afterprint']) "
                         "addEventListener(kind, () => printed.push(document.documentElement.dataset.theme))")
        self.browser.driver.execute_cdp_cmd("Page.printToPDF", {})
        self.assertEqual(self.browser.run("return printed"), ["light", "dark"])
        self.assert_nothing_logged()

    def test_all_controls_have_names_and_pages_as_large_as_twice_are_whole(self):
        self.come_in(tab="wall")
        for width in (320, 640):  # WCAG 1.4.10; and 1,280 at twice the size
            self.browser.size(width, 700)
            for tab in ("wall", "plan", "time", "scene", "files"):
                self.browser.run(f"document.getElementById('tab-{tab}').click()")
                if tab == "scene":
                    self.select("lamp")
                with self.subTest(width=width, tab=tab):
                    self.assertEqual(self.browser.faults(), [])
                    self.assertEqual(self.unnamed(), [])
                self.browser.shoot(f"hostile-{tab}-{width}")
        self.assert_nothing_logged()

    def unnamed(self):
        tree = self.browser.driver.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
        return [node["role"]["value"] for node in tree if not node["ignored"] and node["role"]["value"] in UNNAMED_ROLES
                and not node.get("name", {}).get("value", "").strip()]


if __name__ == "__main__":
    unittest.main()
