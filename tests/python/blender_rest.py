"""Within Blender: both sides are compared at rest, and whoever moves something meanwhile goes first."""
import threading
import time
from unittest import mock

import bpy
from blender_awkward import pumps
from blender_cases import OnAWall
from blender_side import add, box, settle, until, update

from tessera_link import link as link_module
from tessera_link import pump

MOST = 600  # pumps that a move may take: far fewer than a comparison does here
HELD = 20.0  # s


class Rest(OnAWall):
    def setUp(self):
        super().setUp()
        for at in range(3):
            add(self.stage, f"{at}", box("a"), (at, 0, 0))
        update()
        bpy.ops.ed.undo_push(message="begin")
        self.link()
        self.step()
        self.ends = threading.Event()  # of what is slow here
        self.began = 0

    def test_what_is_made_and_moved_here_asks_for_none(self):
        begun = pump.link._epoch  # each comparison begins another one
        add(self.stage, "new", box("new"))
        self.step()
        settle()
        self.assertFalse(pump.link._rest.is_awaited)
        pumps(200)
        self.assertEqual(pump.link._epoch, begun)

    def step(self):
        bpy.data.objects["2"].location.z += 1
        update()
        bpy.ops.ed.undo_push(message="a step")
        settle()

    def lasts(self, pace=0.0):
        """Until it may end, a step each `pace` seconds."""
        self.began, deadline = self.began + 1, time.monotonic() + HELD
        while not self.ends.wait(pace) and time.monotonic() < deadline:
            yield

    def slow_tree(self):
        kind, first = type(self.wall), type(self.wall).tree

        def tree(wall, node):
            for page in first(wall, node):
                for _ in self.lasts(0.02):
                    yield page
                yield page

        return mock.patch.object(kind, "tree", tree)

    def slow_taking_up(self):
        first = link_module.take_up

        def take_up(link, found):
            yield from self.lasts()
            yield from first(link, found)

        return mock.patch.object(link_module, "take_up", take_up)

    def moves_are_not_held_up(self):
        bpy.ops.ed.undo()
        until("both are compared", lambda: self.began == 1)
        bpy.data.objects["1"].location.z = 5
        until("the move is granted", lambda: self.wall["/Stage/1"].translation[2] == 5, MOST)
        until("both are compared", lambda: self.began == 2)
        self.wall["/Stage/0"].translation = (0, 0, 7)
        until("the move is here", lambda: bpy.data.objects["0"].location.z == 7, MOST)
        self.ends.set()
        settle()
        pumps()
        began, sent = self.began, pump.link.counts["sent"]
        pumps(200)
        self.assertEqual((self.began, pump.link.counts["sent"], pump.link.notes), (began, sent, {}))
        self.assertEqual(self.wall["/Stage/2"].translation[2], bpy.data.objects["2"].location.z)

    def test_while_the_wall_is_looked_through(self):
        with self.slow_tree():
            self.moves_are_not_held_up()

    def test_while_objects_are_taken_up(self):
        with self.slow_taking_up():
            self.moves_are_not_held_up()

    def test_while_all_are_looked_through_after_undo(self):
        first = link_module.Link._scan

        def scan(link):
            yield from self.lasts()
            yield from first(link)

        with mock.patch.object(link_module.Link, "_scan", scan):
            bpy.ops.ed.undo()
            until("all are looked through", lambda: self.began == 1)
            bpy.data.objects["1"].location.z = 5
            until("the move is granted", lambda: self.wall["/Stage/1"].translation[2] == 5, MOST)
            self.ends.set()
            settle()
        self.assertEqual(pump.link.notes, {})

    def test_what_another_blender_adds_is_said(self):
        with self.wall.edit() as edit:
            node = edit.add(self.wall["/Stage"], "new", edit.object("Transform"))
            edit.add(node, f"blender:{'1' * 32}", edit.object("ApplicationData"))
        until("it is said", lambda: pump.link.notes)
        (said,) = pump.link.notes.values()
        self.assertEqual(said, "1 nodes below the collection at the wall are not of this file")

    def test_it_is_made_although_something_moves_all_the_time(self):
        with self.slow_taking_up(), mock.patch("tessera_link.rest._PATIENCE", 1.0):
            self.ends.set()
            bpy.ops.ed.undo()
            at = iter(range(10000))

            def compared():
                bpy.data.objects["1"].location.z = next(at)
                return self.began == 1

            until("both are compared", compared)
            settle()
