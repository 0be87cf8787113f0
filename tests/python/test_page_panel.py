"""A panel's page in a real browser: what its controls change, what it shows that others change, what is not there, and
a phone that sleeps."""
import unittest

import page_browser
from live import Live, run_folder

STRANGE = "<img src=x onerror=alert(1)>"
TURNED = "\u202eevil\u202c"  # from right to left, by force
WORDS = ("Wer hier drückt, " * 14).strip()  # as long as a label may be, nearly
PANEL = f"""title: "The engine hall مرحبا {STRANGE}"
controls {{ label: "Sun" node: "/sun/light" field: "intensity" slider {{ greatest: 5 }} }}
controls {{ label: "Sun is up" node: "/sun/light" field: "on" toggle {{}} }}
controls {{ label: "Colour of the sun" node: "/sun/light" field: "color" colour {{}} }}
controls {{ label: "Carriage" node: "/carriage" field: "translation"
  choice {{ options {{ label: "Near" value: "0 1 1" }} options {{ label: "{TURNED}" value: "0 2 1" }} options {{
    label: "No place" value: "0" }} }} }}
controls {{ label: "{STRANGE}" node: "/sign" field: "text" text {{ bytes: 20 }} }}
controls {{ label: "Scene" node: "/stage" field: "choice"
  choice {{ {' '.join(f'options {{ label: "Scene {i}" value: "{i}" }}' for i in range(12))}
    options {{ value: "all" }} }} }}
controls {{ label: "Engine" node: "/take" field: "time" slider {{ greatest: 8 step: 0.5 }} }}
controls {{ label: "Runs" node: "/take" field: "playing" toggle {{}} }}
controls {{ label: "Still" press {{ sets {{ node: "/take" field: "playing" value: "false" }} sets {{ node: "/take"
  field: "time" value: "2" }} }} }}
controls {{ label: "Evening" press {{ sets {{ node: "/sun/light" field: "intensity" value: "0.25" }}
  sets {{ node: "/sun/light" field: "color" value: "1 0.5 0.25" }} }} }}
controls {{ press {{ home: true }} }}
controls {{ label: "Boiler 世界" press {{ bookmark: 1 }} }}
controls {{ label: "Nobody was there" press {{ bookmark: 9 }} }}
controls {{ label: "Later" node: "/later" field: "range" slider {{ least: 0.5 greatest: 2 }} }}
controls {{ label: "Wrong" node: "/sun/light" field: "color" slider {{ greatest: 1 }} }}
controls {{ label: "{WORDS}" press {{ home: true }} }}
controls {{ label: "Dark" press {{ sets {{ node: "/nowhere" field: "on" value: "false" }} }} }}
"""


class VisitedWall(Live):
    """With keys, and a token of a panel for each of `names`: `links`."""

    def __init__(self, panel, names, **options):
        super().__init__(**options)
        self._panel, self._names, self._tokens = panel, names, {}

    def __enter__(self):
        self.make_keys()
        path = self.folder / "hall.panel"
        path.write_text(self._panel)
        for name in self._names:
            self._tokens[name] = self.keys_say("token", name, "--panel", str(path)).split()[-1]
        super().__enter__()
        self.links = {name: f"{self.sealed_link().partition('?')[0]}?token={token}"
                      for name, token in self._tokens.items()}
        return self


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class PanelPage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.enterClassContext(run_folder())
        cls.live = cls.enterClassContext(VisitedWall(PANEL, ("visitor", "guest"), surface="osmesa", size="48x32"))
        cls.browser = cls.enterClassContext(page_browser.Browser())
        cls.wall = cls.enterClassContext(cls.live.connect())
        with cls.wall.edit() as edit:
            edit.create("/sign", "Text", text="Welcome")
            edit.create("/stage", "Switch", choice=0)
            edit.create("/take", "Animation", playing=False, time=1.0)

    def setUp(self):
        self.browser.size(1280, 800)
        self.browser.logged()

    def come_in(self, name="visitor"):
        self.browser.open("about:blank")
        self.browser.open(self.live.links[name])
        self.browser.until("the panel", lambda: self.browser.all(".card"))

    def part(self, label, selector="[aria-label='{}']"):
        return self.browser.until(f"a control {label}",
                                  lambda: next(iter(self.browser.all(selector.format(label))), None))

    def card(self, label):
        return self.browser.until(f"a card {label}",
                                  lambda: next((one for one in self.browser.all(".card") if label in one.text), None))

    def sun(self):
        return self.wall["/sun/light"]

    def light(self, field):
        return getattr(self.sun(), field)

    def assert_nothing_logged(self):
        self.assertEqual(self.browser.logged(), [])

    def test_who_has_its_token_sees_the_panel_and_no_console(self):
        self.come_in()
        self.assertEqual(self.browser.text("#panel-title"), f"The engine hall مرحبا {STRANGE}")
        self.browser.until("that it is live", lambda: "live" in self.browser.text("#panel-state"))
        self.assertNotIn("token", self.browser.driver.current_url)
        self.assertEqual(self.browser.all("#tabs, #api-link, canvas, .tree"), [])
        self.browser.open(self.browser.driver.current_url)  # loaded again, without the token in the address
        self.browser.until("the panel again", lambda: self.browser.all(".card"))
        self.browser.logged()
        for path in ("/wall.jpg", "/metrics", "/tile/front-0-0.png"):
            self.assertEqual(self.browser.driver.execute_async_script("""
                const [path, done] = arguments;
                fetch(path, { headers: { Authorization: `Bearer ${sessionStorage.getItem('tessera-token')}` } })
                  .then((answer) => done(answer.status));""", path), 403)

    def test_names_are_text_whatever_stands_in_them(self):
        self.come_in()
        self.assertEqual(self.browser.run("return document.querySelectorAll('main img, h1 b').length"), 0)
        self.part(STRANGE)
        # What turns a line around turns its own name alone.
        turned = self.browser.run("return [...document.querySelectorAll('.option span')].map((one) => "
                                  "getComputedStyle(one).unicodeBidi)")
        self.assertEqual(set(turned), {"isolate"})
        self.assert_nothing_logged()

    def test_each_kind_of_control_changes_the_scene(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in()
        slider = self.part("Sun")
        before = self.light("intensity")
        slider.send_keys(Keys.ARROW_RIGHT)
        self.browser.until("more sun", lambda: abs(self.light("intensity") - before - 0.05) < 0.01)
        self.part("Sun is up").click()
        self.browser.until("no sun", lambda: self.light("on") is False)
        self.browser.run("const picker = arguments[0]; picker.value = '#00ff00'; picker.dispatchEvent(new "
                         "Event('change'))", self.part("Colour of the sun"))
        self.browser.until("it is green", lambda: tuple(self.light("color")) == (0.0, 1.0, 0.0))
        self.card("Carriage").find_element("xpath", ".//label[contains(., 'Near')]").click()
        self.browser.until("it is near", lambda: tuple(self.wall["/carriage"].translation) == (0, 1, 1))
        sign = self.part(STRANGE)
        self.browser.run("arguments[0].focus(); arguments[0].select()", sign)
        sign.send_keys("Willkommen 世界", "\n")
        self.browser.until("the sign", lambda: self.wall["/sign"].text == "Willkommen 世界")
        self.part("Scene").send_keys("Scene 7")
        self.browser.until("another scene", lambda: self.wall["/stage"].choice == 7)
        self.part("Engine").send_keys(Keys.ARROW_RIGHT)
        self.browser.until("half a second later", lambda: self.wall["/take"].time in (1.5, 2.5))
        self.part("Runs").click()
        self.browser.until("it runs", lambda: self.wall["/take"].playing)
        self.card("Still").find_element("css selector", "button").click()
        self.browser.until("it stands", lambda: not self.wall["/take"].playing and self.wall["/take"].time == 2.0)
        self.card("Evening").find_element("css selector", "button").click()
        self.browser.until("evening",
                           lambda: self.light("intensity") == 0.25 and tuple(self.light("color")) == (1.0, 0.5, 0.25))
        self.browser.until("a word that it is done", lambda: "✓" in self.card("Evening").text)
        self.assert_nothing_logged()

    def test_what_others_change_is_shown(self):
        self.come_in()
        self.sun().intensity = 3.5
        self.browser.until("its number", lambda: "3.5" in self.card("Sun").text)
        self.assertEqual(self.part("Sun").get_property("value"), "3.5")
        self.sun().on = True
        self.browser.until("it is on", lambda: self.part("Sun is up").get_property("checked"))
        self.wall["/stage"].choice = 3
        self.browser.until("the scene", lambda: self.part("Scene").get_property("value") == "3")
        self.wall["/stage"].choice = "all"
        self.browser.until("all", lambda: self.part("Scene").get_property("value") == "12")
        self.wall["/stage"].choice = 77  # none of its options
        self.browser.until("none of them", lambda: self.part("Scene").get_property("value") == "")
        self.wall["/carriage"].translation = (0, 2, 1)
        self.browser.until("the other place",
                           lambda: self.browser.run(
                               "return document.querySelectorAll('.option "
                               ":checked')[0]?.parentElement.textContent") == TURNED)
        self.wall["/sign"].text = STRANGE
        self.browser.until("the sign", lambda: self.part(STRANGE).get_property("value") == STRANGE)
        self.assert_nothing_logged()

    def test_what_is_refused_says_why_and_the_old_value_stays(self):
        self.come_in()
        self.wall["/sign"].text = "short"
        sign = self.part(STRANGE)
        self.browser.until("the sign", lambda: sign.get_property("value") == "short")
        self.browser.run("arguments[0].focus(); arguments[0].select()", sign)
        sign.send_keys("much too long for this sign", "\n")
        self.browser.until("why not", lambda: "too long: 27 bytes" in self.card(STRANGE).text)
        self.browser.until("the old one", lambda: sign.get_property("value") == "short")
        self.assertEqual(self.wall["/sign"].text, "short")
        nobody = self.card("Nobody was there")
        nobody.find_element("css selector", "button").click()
        self.browser.until("why not", lambda: "✕" in nobody.text and "bookmark" in nobody.text)

    def test_what_is_not_there_says_so_and_comes_alive(self):
        self.come_in()
        later = self.part("Later")
        self.assertFalse(later.is_enabled())
        self.assertIn("Not there", self.card("Later").text)
        self.assertIn("there is no /later now", self.card("Later").text)
        self.assertNotIn("children", self.browser.text("main"), "nobody reads here what else is in the scene")
        self.assertIn("is no number", self.card("Wrong").text)
        self.assertFalse(self.part("Wrong").is_enabled())
        self.assertFalse(self.card("Dark").find_element("css selector", "button").is_enabled())
        self.assertIn("Not all is there", self.card("Carriage").text)
        places = self.browser.run("return [...document.querySelectorAll('.option input')].map((one) => one.disabled)")
        self.assertEqual(places, [False, False, True])
        typed = self.part(STRANGE)
        typed.send_keys("x")  # somebody is in the middle of a word
        self.wall.create("/later", "PointLight", range=1.25)
        self.browser.until("it is there", lambda: self.part("Later").is_enabled())
        self.assertEqual(self.part("Later").get_property("value"), "1.25")
        self.assertNotIn("Not there", self.card("Later").text)
        self.assertTrue(self.browser.run("return document.activeElement === arguments[0]", typed), "nobody lost a word")
        self.wall.remove("/later")
        self.browser.until("it is gone", lambda: not self.part("Later").is_enabled())

    def test_the_view_goes_home_and_to_a_bookmark(self):
        def picture():
            return self.wall.image().tobytes()

        home = picture()
        self.wall.view(position=(1.0, 1.0, 6.0))
        self.browser.until("another picture", lambda: picture() != home)
        there = picture()
        self.wall.ask("NavigateView", deed="keep_bookmark", bookmark=1)
        self.come_in()
        self.card("Home").find_element("css selector", "button").click()
        self.browser.until("home", lambda: picture() == home)
        self.card("Boiler").find_element("css selector", "button").click()
        self.browser.until("at the boiler", lambda: picture() == there)

    def test_keys_alone_are_enough(self):
        from selenium.webdriver.common.keys import Keys

        self.come_in()
        self.sun().intensity = 1.0
        self.browser.until("its number", lambda: self.part("Sun").get_property("value") == "1")
        self.browser.press(Keys.TAB)
        for wanted, keys in (("Sun", (Keys.ARROW_UP,)), ("Sun is up", (Keys.SPACE,))):
            for _ in range(6):
                if self.browser.focused() == wanted:
                    break
                self.browser.press(Keys.TAB)
            self.assertEqual(self.browser.focused(), wanted)
            up = self.light("on")
            self.browser.press(*keys)
        self.browser.until("more sun", lambda: abs(self.light("intensity") - 1.05) < 0.01)
        self.browser.until("the other way", lambda: self.light("on") is not up)
        for _ in range(20):
            if self.browser.focused().startswith("Evening"):
                break
            self.browser.press(Keys.TAB)
        self.browser.press(Keys.ENTER)
        self.browser.until("evening", lambda: self.light("intensity") == 0.25)
        self.assert_nothing_logged()

    def offline(self, is_offline):
        self.browser.driver.execute_cdp_cmd("Network.emulateNetworkConditions", {
            "offline": is_offline, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1})

    def test_a_phone_that_sleeps_wakes_with_values_as_they_are(self):
        self.come_in()
        self.browser.until("that it is live", lambda: "live" in self.browser.text("#panel-state"))
        driver = self.browser.driver
        for sleeps in ("frozen", "offline"):
            with self.subTest(sleeps):
                if sleeps == "frozen":
                    driver.execute_cdp_cmd("Page.setWebLifecycleState", {"state": "frozen"})
                else:
                    driver.execute_cdp_cmd("Network.enable", {})
                    self.addCleanup(self.offline, False)
                    self.offline(True)
                    self.browser.until("a banner",
                                       lambda: "Connection lost" in self.browser.text("#banner")
                                       and self.browser.all("#banner"))
                value = 4.5 if sleeps == "frozen" else 1.5
                self.sun().intensity = value
                if sleeps == "frozen":
                    driver.execute_cdp_cmd("Page.setWebLifecycleState", {"state": "active"})
                    # Still hidden, as a page that was frozen is; now somebody looks at it again
                    asleep = driver.current_window_handle
                    driver.switch_to.new_window("tab")
                    driver.close()
                    driver.switch_to.window(asleep)
                else:
                    self.offline(False)
                self.browser.until("the value as it is", lambda: self.part("Sun").get_property("value") == str(value))
                self.browser.until("no banner", lambda: not self.browser.all("#banner"))
                self.assertIn("live", self.browser.text("#panel-state"))

    def test_a_token_that_is_taken_back_says_so(self):
        self.come_in("guest")
        self.live.keys_say("revoke", "guest")
        self.browser.until("why", lambda: "taken back" in self.browser.text("#banner") and self.browser.all("#banner"))
        self.assertIn("ended", self.browser.text("#panel-state"))
        self.browser.logged()
        self.browser.run("document.dispatchEvent(new Event('resume'))")  # nobody asks again and again
        self.assertEqual(self.browser.logged(), [])
        token = self.live.links["visitor"].rpartition("=")[2]
        self.browser.all("#banner input")[0].send_keys(token, "\n")
        self.browser.until("it is live again",
                           lambda: "live" in self.browser.text("#panel-state") and not self.browser.all("#banner"))

    def test_a_person_whose_token_is_taken_back_is_asked_once_for_another(self):
        self.live.keys_say("person", "ada", "--role", "editor", "--out", str(self.live.folder / "ada"))
        token = self.live.keys_say("token", "ada", "--role", "editor").split()[-1]

        def is_let_in():
            self.browser.open("about:blank")
            self.browser.open(self.live.sealed_link().partition("?")[0] + f"?token={token}#scene")
            return self.browser.all("#wall-state")
        self.browser.until("that the server knows her", is_let_in)
        self.browser.until("the console", lambda: "running" in self.browser.text("#wall-state"))
        self.browser.run("window.dials = 0; window.WebSocket = class extends WebSocket { constructor(...said) { "
                         "super(...said); ++dials; } }")
        self.live.keys_say("revoke", "ada")
        self.browser.until("why", lambda: "taken back" in self.browser.text("#banner") and self.browser.all("#banner"))
        dials, frame = self.browser.run("return dials"), self.wall.status().frame
        self.assertLessEqual(dials, 2)
        for event in ("visibilitychange", "online"):
            self.browser.run("(arguments[0] === 'online' ? window : document).dispatchEvent(new Event(arguments[0]))",
                             event)
        self.browser.until("a second of frames", lambda: self.wall.status().frame > frame + 60)
        self.assertEqual(self.browser.run("return dials"), dials, "nobody asks again and again")
        self.browser.logged()

    def test_buttons_have_room_for_their_words_and_an_edge_in_colours_of_the_device(self):
        self.come_in()
        self.browser.size(360, 740)
        button = self.card(WORDS).find_element("tag name", "button")
        tall = "return arguments[0].scrollHeight <= arguments[0].clientHeight"
        self.assertTrue(self.browser.run(tall, button))
        self.addCleanup(self.browser.driver.execute_cdp_cmd, "Emulation.setEmulatedMedia", {"features": []})
        self.browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia",
                                            {"features": [{"name": "forced-colors", "value": "active"}]})
        edge = self.browser.run("const { borderTopStyle, borderTopColor } = getComputedStyle(arguments[0]); return "
                                "[borderTopStyle, borderTopColor]", button)
        self.assertEqual(edge[0], "solid")
        self.assertNotEqual(edge[1], "rgba(0, 0, 0, 0)")
        self.assert_nothing_logged()

    def test_nothing_is_cut_off_faint_or_too_small_for_a_finger(self):
        self.come_in()
        for width, theme in self.browser.sizes_and_themes():
            with self.subTest(width=width, theme=theme):
                self.assertEqual(self.browser.faults(), [])
            self.browser.shoot(f"panel-{width}-{theme}")
        self.assert_nothing_logged()


if __name__ == "__main__":
    unittest.main()
