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
