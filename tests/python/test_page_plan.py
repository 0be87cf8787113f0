"""The tab Plan of the console's page: a CAVE with its heads and wands, where the wall and its trackers say they are."""
import pathlib
import socket
import subprocess
import tempfile
import unittest

import page_browser
import page_wall
from live import BIN, ROOT

CAVE = ROOT / "deploy/walls/cave4-stereo.wall"


class OnAPlan(page_wall.OnAPage):
    def heads(self):
        """Of the plan, in words."""
        return self.browser.text("[aria-label=Heads]")

    def in_metres(self, side):
        """Of the head's circle, from the upper left of the room, by what 2.4 m are there."""
        return self.browser.run("""
            const svg = document.querySelector(`[data-side=${arguments[0]}]`);
            const points = [...svg.querySelectorAll('.screen')].flatMap((one) => [...one.points]);
            const xs = points.map(({ x }) => x), ys = points.map(({ y }) => y);
            const metre = (Math.max(...xs) - Math.min(...xs)) / 2.4, head = svg.querySelector('[data-user=viewer]');
            return [(head.cx.baseVal.value - Math.min(...xs)) / metre,
              (head.cy.baseVal.value - Math.min(...ys)) / metre];""", side)


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class Room(OnAPlan):
    wall_name = str(CAVE)

    def test_the_plan_shows_heads_where_the_wall_says_they_are(self):
        self.come_in(tab="plan")
        with self.wall.follow("poses", timeout=page_browser.PATIENCE) as poses:
            self.wall.ask("SetView", user="viewer", head=(0.4, 1.5, 1.1))
            head = next(told for told in poses if told.heads[0].position[0] == 0.4).heads[0]
        words = "viewer: x {:.2f} m, y {:.2f} m, z {:.2f} m, not tracked".format(*head.position)
        self.browser.until(words, lambda: words in self.heads())
        self.assertIn("front: 2.40 m wide, 2.40 m high", self.browser.text("[aria-label=Screens]"))
        # In the drawing from above: metres to the right of the room's left edge, and behind its front.
        x, z = self.in_metres("above")
        self.assertAlmostEqual(x, 0.4 + 1.2, delta=0.01)
        self.assertAlmostEqual(z, 1.1, delta=0.01)
        z, y = self.in_metres("side")
        self.assertAlmostEqual(z, 1.1, delta=0.01)
        self.assertAlmostEqual(y, 2.4 - 1.5, delta=0.01)
        self.assert_nothing_logged()

    def test_nobody_is_told_of_heads_while_the_plan_is_not_shown(self):
        self.come_in(tab="plan")
        self.browser.run("""
            window.told = {};
            const real = JSON.parse;
            JSON.parse = (text) => { const said = real(text);
              if (said.notice) told[said.notice] = (told[said.notice] ?? 0) + 1; return said; };""")
        self.browser.until("poses", lambda: self.browser.run("return told.Poses ?? 0") > 3)
        self.browser.run("document.getElementById('tab-time').click()")
        self.browser.until("twenty frames without poses", lambda: self.browser.run("""
            if (told.Poses !== told.before) Object.assign(told, { before: told.Poses, Frame: 0 });
            return told.Frame > 20;"""))

    def test_nothing_is_cut_off_faint_or_too_small_for_a_finger(self):
        self.come_in(tab="plan")
        for width, theme in self.browser.sizes_and_themes():
            self.browser.until("its drawings",
                               lambda: self.browser.run("return document.querySelectorAll('.plan .head').length") >= 2)
            with self.subTest(width=width, theme=theme):
                self.assertEqual(self.browser.faults(), [])
            self.browser.shoot(f"plan-{width}-{theme}")
        self.assert_nothing_logged()


@unittest.skipIf(page_browser.WHY_NOT, page_browser.WHY_NOT)
class TrackedRoom(OnAPlan):
    """The same with a tracker."""

    @classmethod
    def setUpClass(cls):
        folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("127.0.0.1", 0))
            cls.port = free.getsockname()[1]
        room = folder / "room.wall"
        room.write_text(CAVE.read_text().replace("eye_separation_m: 0.065 }",
                                                 "eye_separation_m: 0.065\n  head { tracker: \"art\" sensor: 0 } }\n"
                        f"trackers {{ name: \"art\" dtrack {{ listen: \"127.0.0.1:{cls.port}\" }} }}\n"
                        "wands { name: \"right\" mount { tracker: \"art\" flystick: 0 } }"))
        cls.wall_name, cls.options = str(room), {"surface": "none"}
        super().setUpClass()

    def test_a_head_that_moves_is_followed(self):
        self.come_in(tab="plan")
        path = self.live.folder / "way.txt"
        path.write_text("0 0 1.6 1.0\n1 0.8 1.6 1.0\n100 0.8 1.6 1.0\n")
        self.browser.reduce_motion(False)
        player = self.play(path)
        try:
            self.browser.until("the tracker's head", lambda: "seen by a tracker" in self.heads())
            self.browser.until("it arrives", lambda: "viewer: x 0.80 m, y 1.60 m, z 1.00 m" in self.heads())
            self.browser.until("in the drawing, too", lambda: abs(self.in_metres("above")[0] - 2.0) < 0.02)
            self.assertIn("art: dtrack", self.browser.text("[aria-label=Trackers]"))
        finally:
            player.terminate()
            player.wait()
        player = self.play(path, "--flystick", "--buttons", "2")
        try:
            words = "right: x 0.80 m, y 1.60 m, z 1.00 m, seen by a tracker, pressed: 1"
            self.browser.until(words, lambda: words in self.browser.text("[aria-label=Wands]"))
        finally:
            player.terminate()
            player.wait()
        self.assert_nothing_logged()

    def play(self, path, *more):
        command = [BIN / "tessera-ctl", "play-tracker", f"127.0.0.1:{self.port}", str(path), "--seconds", "60", *more]
        return subprocess.Popen(command, stdout=subprocess.DEVNULL)

    def test_who_wants_little_motion_has_little(self):
        self.browser.reduce_motion(True)
        self.come_in(tab="plan")
        path = self.live.folder / "far.txt"
        path.write_text("0 0 1.6 1.0\n100 1 1.6 1.0\n")
        player = self.play(path)
        try:
            self.browser.until("the tracker's head", lambda: "seen by a tracker" in self.heads())
            drawn = self.browser.driver.execute_async_script("""
                const done = arguments[0], svg = document.querySelector('[data-side=above]');
                const times = [];
                new MutationObserver(() => {
                  times.push(performance.now());
                  if (times.length === 3) done(times[2] - times[0]);
                }).observe(svg, { childList: true });""")
        finally:
            player.terminate()
            player.wait()
        self.assertGreater(drawn, 1900, "milliseconds for two drawings")


if __name__ == "__main__":
    unittest.main()
