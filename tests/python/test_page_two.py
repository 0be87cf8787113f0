"""Two people on the console's page, each in a browser of their own: one thing that both drag, a handle, undo in the
middle, who leaves."""
import contextlib
import math
import unittest

import page_browser
import test_page_picture as picture

BODY = (-2, 0.5, 0.5)  # the front of the carriage


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class PageTwo(picture.OnAPicture):
    @classmethod
    def setUpClass(cls):
        cls.show_yard()
        super().setUpClass()
        cls.ada, cls.ben = cls.browser, cls.enterClassContext(page_browser.Browser())

    def setUp(self):
        self.wall["/drive"].playing = False
        self.wall["/carriage"].translation = (-2, 0.5, 0)
        self.wall.ask("SetView", **picture.STAND)
        for one in (self.ada, self.ben):
            with self.at(one):
                super().setUp()
                self.come_in()
                self.choose("Drag")

    @contextlib.contextmanager
    def at(self, browser):
        """What follows is done there."""
        before, self.browser = self.browser, browser
        try:
            yield
        finally:
            self.browser = before

    def hand(self, browser, u, v, kind="mouseMoved"):
        with self.at(browser):
            if kind == "mouseReleased":
                self.mouse("mouseMoved", u, v)
            return self.mouse(kind, u, v)

    def is_told(self, browser, words):
        with self.at(browser):
            self.browser.until(words, lambda: words in self.said())

    def where(self):
        return self.wall["/carriage"].translation

    def take(self, browser):
        part = self.hand(browser, *picture.seen_at(BODY), "mousePressed")
        self.is_told(browser, "/carriage")
        return part

    def led(self, from_, to):
        """To where such a way of a hand leads the carriage from where it stood."""
        way = picture.minus(picture.on_depth(picture.stand_ray(*to), BODY[2]),
                            picture.on_depth(picture.stand_ray(*from_), BODY[2]))
        return picture.plus((-2, 0.5, 0), way)

    def test_of_two_who_drag_one_thing_the_last_has_it_and_nobody_hangs(self):
        u, v = picture.seen_at(BODY)
        depth = self.wall.status().undo_depth
        begun = {one: self.take(one) for one in (self.ada, self.ben)}
        for i in range(1, 5):
            self.hand(self.ada, u - 0.01 * i, v)
            self.hand(self.ben, u, v - 0.01 * i)
        there = self.hand(self.ada, u + 0.03, v - 0.05, "mouseReleased")
        wanted = self.led(begun[self.ada], there)
        self.ada.until("where ada let go", lambda: math.dist(self.where(), wanted) < 1e-9)
        there = self.hand(self.ben, u - 0.04, v - 0.06, "mouseReleased")
        wanted = self.led(begun[self.ben], there)
        self.ben.until("where ben let go", lambda: math.dist(self.where(), wanted) < 1e-9)
        self.assertGreaterEqual(self.wall.status().undo_depth, depth + 2)
        for one in (self.ada, self.ben):
            with self.at(one):
                self.browser.run("document.getElementById('tab-scene').click()")
                self.browser.until("a row",
                                   lambda: self.browser.run(
                                       "const row = [...document.querySelectorAll('[role=treeitem]')].find((one) => "
                                       "one.textContent.includes('carriage')); row?.click(); return row"))
                x = f"{self.where()[0]:.7g}"
                self.browser.until("the same place",
                                   lambda: self.browser.run(
                                       "return document.querySelector(\".object [aria-label='translation, "
                                       "x']\")?.value") == x)
                self.assert_nothing_logged()

    def test_who_takes_a_step_back_in_the_middle_takes_nothing_out_of_a_hand(self):
        u, v = picture.seen_at(BODY)
        begun = self.take(self.ada)
        self.hand(self.ada, u + 0.02, v)
        self.ada.until("it has moved", lambda: self.where()[0] > -2)
        self.wall.undo()
        self.ada.until("it is back", lambda: self.where()[0] == -2)
        there = self.hand(self.ada, u + 0.04, v, "mouseReleased")
        wanted = self.led(begun, there)
        self.ada.until("it is where the hand is", lambda: math.dist(self.where(), wanted) < 1e-9)

    def test_a_handle_is_one_hands_and_free_once_they_leave(self):
        eye = picture.plus(picture.STAND["position"], picture.times(picture.VIEWER, 1.5))
        rays = ({"origin": eye, "direction": picture.minus((-4.2 + x * 0.08, 1 + y * 0.08, 0), eye)}
                for x in range(-10, 11) for y in range(-10, 11))
        handle = next(told for told in (self.wall.ask("GrabHandle", ray=ray) for ray in rays) if told.hit)
        self.wall.ask("ReleaseHandle")
        u, v = picture.seen_at(handle.point)
        self.hand(self.ada, u, v, "mousePressed")
        self.is_told(self.ada, "Handle of /gizmo")
        self.hand(self.ben, u, v, "mousePressed")
        self.hand(self.ben, u, v, "mouseReleased")
        self.is_told(self.ben, "✕")
        self.ada.open("about:blank")
        self.ada.until("it is let go", lambda: not self.wall[f"#{handle.node}"].core.held)
        self.hand(self.ben, u, v, "mousePressed")
        self.hand(self.ben, u, v, "mouseReleased")
        self.is_told(self.ben, "Handle of /gizmo")
        with self.at(self.ben):
            self.assertNotIn("✕", self.said())
            self.assert_nothing_logged()


if __name__ == "__main__":
    unittest.main()
