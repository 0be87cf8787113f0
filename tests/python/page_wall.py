"""A wall of real processes, the console's page before it in a browser, and a program beside it that knows better."""
import unittest

import page_browser
from live import Live, run_folder


class OnAPage(unittest.TestCase):
    """`self.live`, `self.browser`, `self.wall`: for all tests of a class."""
    wall_name, options = "1x1", {"surface": "none"}

    @classmethod
    def setUpClass(cls):
        cls.enterClassContext(run_folder())
        cls.live = cls.enterClassContext(Live(wall=cls.wall_name, **cls.options))
        cls.browser = cls.enterClassContext(page_browser.Browser())
        cls.wall = cls.enterClassContext(cls.live.connect())

    def setUp(self):
        self.browser.size(1280, 800)
        self.browser.logged()

    def come_in(self, role="operator", tab="wall"):
        self.browser.open("about:blank")
        self.browser.open(f"{self.live.link(role)}#{tab}")
        self.browser.until("the wall", lambda: "running" in self.browser.text("#wall-state"))

    def assert_nothing_logged(self):
        self.assertEqual(self.browser.logged(), [])


class OnAScene(OnAPage):
    """With a hand in its tab Scene."""

    def part(self, name):
        self.browser.run("document.getElementById(arguments[0]).click()", f"tab-scene-{name}")

    def shown(self, selector, text=""):
        """The first that is shown and says that; among very many it is asked for at once, and not one by one."""
        return self.browser.until(f"{selector} with {text}", lambda: self.browser.run(
            "return [...document.querySelectorAll(arguments[0])].find((one) => one.checkVisibility() && "
            "one.textContent.includes(arguments[1]))", selector, text))

    def press(self, selector, text):
        self.shown(selector, text).click()

    def row(self, name):
        return self.shown("[role=treeitem]", name)

    def select(self, name):
        self.browser.run("arguments[0].click()", self.row(name))
        self.browser.until(f"the fields of {name}", lambda: name in self.browser.text(".object h2"))

    def field(self, label):
        return self.shown(f".object [aria-label='{label}']")

    def type(self, field, text):
        from selenium.webdriver.common.keys import Keys

        self.browser.run("arguments[0].focus(); arguments[0].select()", field)
        field.send_keys(text, Keys.ENTER)

    def texts(self, selector):
        return self.browser.run("return [...document.querySelectorAll(arguments[0])].filter((one) => "
                                "one.checkVisibility()).map((one) => one.textContent)", selector)


STRANGE = "<img src=x onerror=alert(1)>"


class BesideALamp(OnAScene):
    """And beside many nodes, some with strange names."""
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
