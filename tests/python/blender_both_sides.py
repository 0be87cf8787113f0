"""Within Blender: what both sides change at once, and what one side has numbers for and the other has not."""
import math
import os
import signal
import threading
import unittest
import unittest.mock

import bpy
import numpy as np
import tessera
from blender_awkward import pumps
from blender_cases import OnAWall, principled, turned
from blender_side import PERIOD, add, box, only, settle, start, until
from live import Live, run_folder

from tessera_link import pump
from tessera_link.courier import Courier
from tessera_link.mirror import Mirror


class Numbers(OnAWall):
    def assertStandsAsThere(self, thing):
        (node,) = self.wall.find(f"/Stage/**/{thing.name}", type="Transform")
        np.testing.assert_allclose(turned(node), np.array(thing.matrix_parent_inverse @ thing.matrix_basis), atol=2e-5)

    def test_what_is_mirrored_at_the_wall(self):
        """Blender has another turn and other sizes of the same matrix, and neither may come back alone."""
        mother = add(self.stage, "mother", box("m"), (1, 2, 3))
        mother.rotation_euler = (0.3, 0.4, 0.5)
        child = add(self.stage, "child", box("a"), (1, 2, 3), mother)
        self.link()
        for thing in (mother, child):
            (node,) = self.wall.find(f"/Stage/**/{thing.name}", type="Transform")
            turn = tuple(node.rotation)
            node.scale = (-1, 2, 1)
            until("it is mirrored here", lambda: thing.matrix_basis.determinant() < 0)
            settle()
            pumps()
            self.assertEqual((tuple(node.scale), tuple(node.rotation)), ((-1, 2, 1), turn))
            node.rotation = (0.5, 0.5, -0.5, 0.5)
            until("it turns", lambda: abs(thing.matrix_basis[0][0]) < 0.1)
            self.assertStandsAsThere(thing)
            thing.rotation_euler.z += 0.4
            settle()
            self.assertStandsAsThere(thing)
        self.assertEqual(pump.link.notes, {})

    def test_a_turn_of_any_length_changes_no_size(self):
        thing = add(self.stage, "box", box("a"))
        self.link()
        self.node("box").rotation = (1, 1, 1, 1)
        until("it turns", lambda: abs(thing.matrix_basis[0][0]) < 0.1)
        settle()
        pumps()
        self.assertEqual((tuple(self.node("box").rotation), tuple(self.node("box").scale)), ((1, 1, 1, 1), (1, 1, 1)))
        np.testing.assert_allclose(tuple(thing.scale), (1, 1, 1), atol=1e-6)

    def test_numbers_that_blender_does_not_have(self):
        thing = add(self.stage, "box", box("a"), (1, 2, 3))
        thing.rotation_euler = (0.3, 0.4, 0.5)
        link, node = self.link(), self.node("box")
        turn = tuple(node.rotation)
        for field, value in (("translation", (1e39, 1, 1)), ("scale", (1e30, 1, 1)), ("scale", (1e-30, 1e-30, 1e-30))):
            before = np.array(thing.matrix_basis)
            node.set(**{field: value})
            until("that is said", lambda: link.notes)
            settle()
            pumps()
            self.assertEqual((list(link.notes.values()), tuple(getattr(node, field)), tuple(node.rotation)),
                             (["box stands at the wall where Blender has no numbers for it"], value, turn))
            np.testing.assert_allclose(np.array(thing.matrix_basis), before, atol=1e-5)
            node.set(**{field: (2, 2, 2)})
            until("it is here again", lambda: not link.notes)
            self.assertStandsAsThere(thing)
        node.translation = (1e39, 1, 1)
        until("that is said", lambda: link.notes)
        thing.location.y = 5
        settle()
        self.assertEqual(link.notes, {})
        self.assertStandsAsThere(thing)


class AtOnce(OnAWall):
    def setUp(self):
        super().setUp()
        self.thing = add(self.stage, "box", box("a"))

    def test_what_blender_does_not_tell_of(self):
        """Blender draws nothing that is hidden, and tells nothing of it."""
        link = self.link()
        self.thing.hide_viewport = True
        settle()
        self.thing.location.x = 3
        taken = link.counts["taken"]
        self.node("box").translation = (9, 0, 0)
        until("both have moved it", lambda: link.counts["taken"] > taken)
        settle()
        self.assertEqual((self.thing.location.x, self.node("box").translation[0]), (3, 3))
        self.thing.location.x = 4
        self.thing.hide_viewport = False
        settle()
        self.assertEqual(self.node("box").translation[0], 4)

    def test_blender_goes_back_while_the_wall_does(self):
        """What came while another change was to be read is not forgotten when that one is taken back."""
        link = self.link()
        for there, name in ((5, "there"), (7, "once more")):
            self.thing.location.x, self.thing.name = 1, "here"
            taken = link.counts["taken"]
            self.node("box").set(translation=(there, 0, 0), name=name)
            while link.counts["taken"] == taken:  # it is not told of
                link._take_news(float("inf"))
            self.thing.location.x, self.thing.name = link.objects[link.by_name["box", None].key].core.here[
                "translation"][0], "box"
            settle()
            pumps()
            (node,) = self.wall.find("/Stage/*", type="Transform")
            self.assertEqual((self.thing.location.x, self.thing.name), (node.translation[0], node.name))
            node.name = "box"
            until("it is called so again", lambda: self.thing.name == "box")

    def test_the_wall_goes_back_before_what_was_deleted_with_it_has_gone(self):
        """Removals are granted after the changes that were sent with them, and others may come between."""
        mother, other = (add(self.stage, name, box(name)) for name in ("mother", "other"))
        link = self.link()
        removals = link.courier._one_of_many

        def after_undo(wall, batch):
            if batch.removed:
                self.wall.undo()
            return removals(wall, batch)

        link.courier._one_of_many = after_undo
        self.thing.location.x, self.thing.name, self.thing.parent = 5, "here", mother
        bpy.data.objects.remove(other)
        settle()
        self.assertEqual([node.name for node in self.wall.find("/Stage/*", type="Transform")], ["box", "mother"])
        until("it is as it was, as at the wall",
              lambda: (self.thing.location.x, self.thing.name, self.thing.parent) == (0, "box", None), 400)
        settle()
        self.assertEqual((self.node("box").translation[0], link.notes), (0, {}))

    def test_what_was_changed_at_the_wall_before_its_removal_was_granted(self):
        """What comes back at the wall is as it was when it went; fields as those of a new one are not told."""
        self.thing.rotation_euler.z = 1
        link = self.link()
        removals = link.courier._one_of_many

        def after_turn(wall, batch):
            if batch.removed:
                taken = link.counts["taken"]
                self.node("box").rotation = (1, 0, 0, 0)
                while link.counts["taken"] == taken and not link.courier._closing.wait(PERIOD):
                    pass
            return removals(wall, batch)

        link.courier._one_of_many = after_turn
        bpy.data.objects.remove(self.thing)
        settle()
        self.wall.undo()
        until("it is back", lambda: len(self.stage.objects) == 1)
        settle()
        (thing,) = self.stage.objects
        self.assertEqual((tuple(self.node("box").rotation), thing.rotation_euler.z), ((1, 0, 0, 0), 0))

    def test_what_hangs_below_a_node_of_others(self):
        mother = add(self.stage, "mother", box("mother"))
        link = self.link()
        said = "box hangs below another node at the wall than here"

        def to_others():
            self.wall.create("/Stage/others")
            (node,) = self.wall.find("/Stage/**/box", type="Transform")
            with self.wall.edit() as edit:
                edit.place(node, self.node("others"))

        to_others()
        until("that is said", lambda: said in link.notes.values())
        pumps()  # the next link hears of it no more: it finds it
        pump.stop()
        link = self.link()
        self.assertIn(said, link.notes.values())
        self.thing.parent = mother
        settle()
        self.assertIn("/Stage/mother/box", self.wall)
        self.assertNotIn(said, link.notes.values())
        self.node("others").remove()
        to_others()
        until("that is said", lambda: said in link.notes.values())
        bpy.data.objects.remove(self.thing)
        settle()
        self.assertNotIn(said, link.notes.values())

    def test_materials_and_lamps_that_change_while_the_link_is_away(self):
        paint, lamp = principled("paint", Roughness=0.75), bpy.data.lights.new("lamp", "POINT")
        add(self.stage, "painted", box("painted", materials=(paint,)))
        add(self.stage, "lamp", lamp)
        link = self.link()
        first, there = Courier._session, threading.Event()

        def later(courier):
            there.wait()
            first(courier)

        with unittest.mock.patch.object(Courier, "_session", later):
            link.courier._broken = tessera.NetworkError("a test")
            until("it has gone", lambda: link.courier.state == "reconnecting")
            self.node("painted/painted").material.roughness = 0.25
            self.node("lamp/lamp").core.intensity = 5
            there.set()
            until("it is linked again", lambda: link.courier.state == "linked")
        settle()
        roughness = paint.node_tree.nodes["Principled BSDF"].inputs["Roughness"]
        self.assertEqual((roughness.default_value, round(lamp.energy / (4 * math.pi * math.pi), 4)), (0.25, 5))
        self.assertEqual(self.node("painted/painted").material.roughness, 0.25)

    def test_what_was_only_put_into_no_collection_comes_back(self):
        self.link()
        for _ in range(2):
            self.stage.objects.unlink(self.thing)
            settle()
            self.assertNotIn("/Stage/box", self.wall)
            self.wall.undo()
            until("it is back", lambda: len(self.stage.objects) == 1)
            settle()
            self.assertEqual((list(self.stage.objects), len(bpy.data.objects), len(self.marks())), ([self.thing], 1, 1))

    def test_the_root_comes_back_and_goes_before_anybody_looks(self):
        link = self.link()
        self.wall.undo()
        until("it has gone", lambda: link.root_lost)
        self.wall.redo()
        self.wall.undo()
        pumps()
        self.assertEqual((list(self.stage.objects), list(link.notes)), ([self.thing], [("root",)]))
        self.wall.redo()
        until("it is back", lambda: not link.root_lost)
        settle()
        self.assertEqual((list(self.stage.objects), link.notes, len(self.marks())), ([self.thing], {}, 1))

    def test_what_was_removed_is_not_made_again_after_a_refusal(self):
        link = self.link()
        (subject,) = link.objects.values()
        self.node("box").remove()
        until("it is out of its collection", lambda: not self.stage.objects)
        link.dirty(subject)  # as a batch that was refused, for it had gone
        settle()
        self.assertEqual(self.marks(), [])


class Crash(unittest.TestCase):
    def tearDown(self):
        pump.stop()

    def test_all_of_a_place_was_under_way(self):
        with run_folder(), Live(surface="none", journal=True) as live:
            stage = only()
            thing = add(stage, "box", box("a"))
            link = start(stage, live.address)
            os.kill(live.server.pid, signal.SIGSTOP)
            thing.location, thing.rotation_euler, thing.scale = (1, 2, 3), (0.5, 0, 0), (2, 2, 2)
            batches = link.counts["batches"]
            until("it is under way", lambda: link.counts["batches"] > batches)
            live.kill_server()
            until("that is said", lambda: link.courier.state == "reconnecting")
            live.start_server()
            until("linked again", lambda: link.courier.state == "linked")
            settle()
            with live.connect() as wall:
                self.assertEqual((wall["/Stage/box"].translation, wall["/Stage/box"].scale, thing.location.x),
                                 ((1, 2, 3), (2, 2, 2), 1))

    def test_another_parent_was_under_way(self):
        with run_folder(), Live(surface="none", journal=True) as live:
            stage = only()
            above, thing = add(stage, "above", box("a")), add(stage, "box", bpy.data.meshes["a"])
            link = start(stage, live.address)
            os.kill(live.server.pid, signal.SIGSTOP)
            thing.parent = above
            batches = link.counts["batches"]
            until("it is under way", lambda: link.counts["batches"] > batches)
            live.kill_server()
            until("that is said", lambda: link.courier.state == "reconnecting")
            live.start_server()
            until("linked again", lambda: link.courier.state == "linked")
            settle()
            with live.connect() as wall:
                self.assertIn("/Stage/above/box", wall)
                self.assertEqual(thing.parent, above)

    def test_the_removal_of_what_is_there_twice_was_under_way(self):
        with run_folder(), Live(surface="none", journal=True) as live:
            stage = only()
            add(stage, "box", box("a"))
            link = start(stage, live.address)
            with live.connect() as wall:
                twin = Mirror("Node")
                twin.number = wall["/Stage/box"].clone("twin").id
            os.kill(live.server.pid, signal.SIGSTOP)
            link.superfluous.append(twin)
            batches = link.counts["batches"]
            until("it is under way", lambda: link.counts["batches"] > batches)
            live.kill_server()
            until("that is said", lambda: link.courier.state == "reconnecting")
            live.start_server()
            until("linked again", lambda: link.courier.state == "linked")
            settle()
            with live.connect() as wall:
                self.assertEqual([node.name for node in wall.find("/Stage/*", type="Transform")], ["box"])
