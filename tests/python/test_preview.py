"""Small pictures of a running wall, as a page asks for them: what has changed, and nothing else; and where its tiles
are."""
import time
import unittest

from console_socket import WebSocket
from live import PATIENCE, Live, run_folder


class Looker:
    """Asks again and again, as a page does."""

    def __init__(self, live, role="viewer"):
        self.door, self.token = live.link(role).split("//")[1].split("/?token=")
        self.socket = WebSocket(self.door, self.token, timeout=PATIENCE)
        self.stamp = self.asked = 0

    def send(self, shrink=2):
        self.asked += 1
        self.socket.ask(self.asked, "GetPreview", shrink=shrink, after=self.stamp)

    def take(self):
        """The next answer's tiles: names to JPEGs."""
        said = self.socket.read()
        fields = said["fields"]
        pictures = [self.socket.read() for _ in range(said.get("binaries", 0))]
        self.stamp = fields["stamp"]
        self.missing = fields.get("missing", [])
        return {tile["tile"]: pictures[tile["jpeg"]["binary"]] for tile in fields.get("tiles", [])}

    def look(self, shrink=2):
        self.send(shrink)
        return self.take()

    def ask(self, request, **fields):
        self.asked += 1
        self.socket.ask(self.asked, request, **fields)
        return self.socket.read()


def size_of(jpeg):
    """Width and height, from its frame header (ITU T.81, B.2.2)."""
    at = 2
    while jpeg[at + 1] not in (0xC0, 0xC2):
        at += 2 + int.from_bytes(jpeg[at + 2:at + 4], "big")
    return int.from_bytes(jpeg[at + 7:at + 9], "big"), int.from_bytes(jpeg[at + 5:at + 7], "big")


class Preview(unittest.TestCase):
    def setUp(self):
        self.enterContext(run_folder())

    def test_each_answer_is_what_has_changed(self):
        with Live(wall="2x2", surface="osmesa", size="320x180", options=["--rate", "60"]) as live:
            page = Looker(live)
            first = page.look()
            while len(first) < 4:
                first |= page.look()
            self.assertEqual({size_of(jpeg) for jpeg in first.values()}, {(80, 45)})
            page.send()  # nothing changes: the answer is to come
            with live.connect() as wall:
                wall.ask("SetView", position=(0.5, 2, 6))
            moved = page.take()
            self.assertTrue(moved)
            for tile, jpeg in moved.items():
                self.assertNotEqual(jpeg, first[tile])
            self.assertEqual(page.missing, [])
            self.assertEqual({size_of(jpeg) for jpeg in Looker(live).look(shrink=1).values()}, {(160, 90)})

    def test_a_reader_that_stops_keeps_nobody_from_the_newest(self):
        with Live(wall="1x1", surface="osmesa", size="640x360", options=["--rate", "60"]) as live:
            stopped = [Looker(live) for _ in range(5)]
            for looker in stopped:
                for _ in range(50):
                    looker.send(shrink=1)
            page = Looker(live)
            with live.connect() as wall:
                begun = wall.status().frame
                for step in range(20):
                    wall.ask("SetView", position=(0.1 * step, 2, 6))
                    self.assertTrue(page.look(shrink=1) or page.look(shrink=1))
                self.assertGreater(wall.status().frame, begun)

    def test_tiles_of_hosts_that_are_gone_are_named(self):
        with Live(wall="2x2", surface="none", options=["--rate", "60"]) as live:
            live._processes[1].kill()
            page = Looker(live)
            until = time.monotonic() + PATIENCE
            while not page.look() and len(page.missing) != 1:
                self.assertLess(time.monotonic(), until)
            self.assertEqual(len(page.missing), 1)

    def test_where_tiles_are(self):
        with Live(wall="3x1-bezels") as live:
            said = Looker(live).ask("GetWall")
            plan = said["fields"]
            self.assertEqual(said["answer"], "WallPlan")
            self.assertEqual(len(plan["tiles"]), 3)
            screen, = plan["screens"]
            left, middle, right = sorted(plan["tiles"], key=lambda tile: tile.get("x", 0))
            self.assertGreater(middle["x"], left["width"], "the bezel lies between them")
            self.assertEqual(right["x"] + right["width"], screen["width"])
            self.assertAlmostEqual(right["lower_right"][0], screen["lower_right"][0])

    def test_what_is_asked_wrongly_is_refused_in_words(self):
        with Live() as live:
            looker = Looker(live)
            for shrink in (0, 65, -1, "small"):
                error = looker.ask("GetPreview", shrink=shrink)["error"]
                self.assertIn("shrink", error["message"] + error.get("field", ""))


if __name__ == "__main__":
    unittest.main()
