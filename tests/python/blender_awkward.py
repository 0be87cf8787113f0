"""Within Blender: what comes at the wrong moment, and what neither side can show."""
import gc
import os
from unittest import mock

import bpy
import tessera
from blender_cases import OnAWall, principled
from blender_side import add, box, pause, settle, start, until, update
from eventually import eventually

from tessera_link import pump, scan
from tessera_link.courier import Courier, Found
from tessera_link.subjects import ObjectSubject, key_of


def pumps(count=30):
    """As long as news of the wall take, if there are any."""
    for _ in range(count):
        update()
        pump.pump()
        pause()


class Awkward(OnAWall):
    def test_what_comes_back_while_it_is_being_removed(self):
        """Whoever deletes and takes that back at once."""
        thing = add(self.stage, "box", box("a"))
        link = self.link()
        for _ in range(10):
            self.stage.objects.unlink(thing)
            update()
            sent = link.counts["batches"]
            until("the removal is under way", lambda: link.counts["batches"] > sent)
            self.stage.objects.link(thing)
            settle()
            update()
            settle()
            self.assertEqual((len(self.marks()), list(self.stage.objects), link.notes), (1, [thing], {}))
            self.assertEqual(self.node("box/box").core.type, "Geometry")

    def test_a_mesh_is_shown_once_its_material_can_be(self):
        material = principled("red")
        roughness = material.node_tree.nodes["Principled BSDF"].inputs["Roughness"]
        roughness.default_value = float("nan")
        add(self.stage, "box", box("a", materials=(material,)))
        link = self.link()
        self.assertIn("is not finite", " ".join(link.notes.values()))
        self.assertNotIn("/Stage/box/box", self.wall)
        roughness.default_value = 0.5
        settle()
        self.assertEqual(link.notes, {})
        self.assertEqual(self.node("box/box").material.roughness, 0.5)

    def test_a_mesh_is_shown_once_it_can_be(self):
        mesh = box("a")
        mesh.vertices[0].co.x = float("nan")
        add(self.stage, "box", mesh)
        add(self.stage, "fine", box("b"))
        link = self.link()
        self.assertEqual(len(link.notes), 1)
        self.assertIn("/Stage/fine/fine", self.wall)
        mesh.vertices[0].co.x = -1
        mesh.update()
        settle()
        self.assertEqual(link.notes, {})
        self.assertEqual(self.node("box/box").positions[:, 0].min(), -1)

    def test_what_others_hang_elsewhere_while_something_is_under_way(self):
        mother, child = (add(self.stage, name, box(name)) for name in ("mother", "child"))
        link = self.link()
        for turn in range(10):
            child.location.x = turn + 1
            update()
            sent = link.counts["batches"]
            until("the move is under way", lambda: link.counts["batches"] > sent)
            (node,) = self.wall.find("/Stage/**/child", type="Transform")
            with self.wall.edit() as edit:
                edit.place(node, self.node("mother") if turn % 2 == 0 else self.wall["/Stage"])
            until("it hangs there", lambda: child.parent == (mother if turn % 2 == 0 else None))
            settle()
            self.assertEqual((len(self.marks()), link.notes), (2, {}))

    def test_of_several_that_are_deleted_one_has_gone_already(self):
        things = [add(self.stage, name, box(name)) for name in ("a", "b", "c", "kept")]
        link = self.link()
        with link.courier._gate:  # it hears of nothing meanwhile
            self.node("b").remove()
            for thing in things[:3]:
                bpy.data.objects.remove(thing)
            things[3].location.x = 5
            update()
            batches = link.counts["batches"]
            until("the wall has refused that", lambda: link.counts["batches"] > batches + 1)
        settle()
        self.assertEqual([node.name for node in self.wall.find("/Stage/*", type="Transform")], ["kept"])
        self.assertEqual((len(self.marks()), self.node("kept").translation[0]), (1, 5))
        until("it has heard of all", lambda: not link.notes)

    def test_objects_go_while_they_are_looked_at(self):
        link = self.link()
        for at in range(200):
            add(self.stage, f"{at}")
        for turn in range(40):
            update()
            link.pump(budget=0)  # one slice
            if turn % 2:
                bpy.data.objects.remove(bpy.data.objects[f"{turn}"])
        settle()
        self.assertEqual((len(self.marks()), len(self.stage.objects), link.notes), (180, 180, {}))

    def test_what_the_wall_stops_stands_here_as_there(self):
        """A scale of zero is held back there, as is what collides."""
        thing = add(self.stage, "box", box("a"), (1, 2, 3))
        link = self.link()
        thing.scale = (0, 1, 1)
        settle()
        until("it stands as at the wall", lambda: tuple(thing.scale) == tuple(self.node("box").scale) == (1, 1, 1))
        self.assertEqual(list(link.notes.values()), ["box: the wall stopped it; it stands here as it does there"])
        settle()
        thing.location.x = 5
        settle()
        self.assertEqual((self.node("box").translation[0], link.notes), (5, {}))

    def test_refusals_say_numbers_as_people_write_them(self):
        thing = add(self.stage, "box", box("a"))
        thing.location = (float("nan"), 0.5, 2)
        said = " ".join(self.link().notes.values())
        self.assertIn("box: the wall refuses: Transform.translation: [nan, 0.5, 2] is not finite", said)
        thing.location.x = 1
        thing.data.vertices[0].co.x = float("inf")
        thing.data.update()
        settle()
        self.assertNotIn("dtype", " ".join(pump.link.notes.values()))

    def test_numbers_that_no_scene_should_have(self):
        """Whatever is refused is said, and all the rest stands."""
        for at, (name, value) in enumerate((("location", 3e38), ("location", float("-inf")), ("scale", float("nan")),
                                            ("scale", 1e-38), ("scale", 3e38),
                                            ("rotation_euler", float("nan")), ("rotation_euler", 1e30))):
            thing = add(self.stage, f"{at}", box(f"{at}"))
            setattr(thing, name, (value, 1, 1))
        none = add(self.stage, "none", box("none"))
        none.rotation_mode, none.rotation_quaternion = "QUATERNION", (0, 0, 0, 0)
        mirrored = add(self.stage, "mirrored", box("mirrored"))
        mirrored.scale = (-1, -2, 3)
        link = self.link()
        self.assertIn("/Stage/mirrored/mirrored", self.wall)
        self.assertIn("/Stage/none/none", self.wall)
        self.assertEqual([note for note in link.notes.values() if "fault" in note or "array(" in note], [])
        for thing in list(self.stage.objects):
            thing.location, thing.scale, thing.rotation_euler = (1, 2, 3), (1, 1, 1), (0, 0, 0)
        settle()
        self.assertEqual(link.notes, {})
        self.assertEqual(len(self.marks()), 9)

    def test_a_deep_tree(self):
        """The wall's is 256 nodes deep at most, with that of Blender's up and the marks."""
        above = None
        for at in range(1500):  # more than Python goes down
            above = add(self.stage, f"{at}", None, (0, 0, 0.01), above)
        link = self.link()
        self.assertEqual(len(self.marks()), 253)
        self.assertEqual(len(link.notes), 200)
        self.assertIn("253: the wall refuses: ", "".join(link.notes.values()))
        self.assertIn("300: 299, which it hangs below, is not there", link.notes.values())
        self.assertLess(link.counts["sent"], 20000)
        bpy.data.objects["253"].parent = None
        until("the rest is there", lambda: len(self.marks()) == 253 + 253)

    def test_what_would_hang_below_itself(self):
        """Here the child stands above its mother, and at the wall meanwhile below her."""
        first, second = add(self.stage, "first", box("a")), add(self.stage, "second", box("b"))
        link = self.link()
        with link.courier._gate:
            with self.wall.edit() as edit:
                edit.place(self.node("first"), self.node("second"))
            second.parent = first
            update()
        pumps()
        self.assertEqual((first.parent, second.parent), (None, first))
        self.assertRegex(" ".join(link.notes.values()), "first cannot hang below second|second: the wall refuses")
        second.parent = None
        settle()
        self.assertEqual(len(self.marks()), 2)

    def test_names_are_exchanged(self):
        first, second = add(self.stage, "first", box("a")), add(self.stage, "second", box("b"))
        self.link()
        numbers = [self.node(name).id for name in ("first", "second")]
        first.name, second.name, first.name = "between", "first", "second"
        settle()
        self.assertEqual([self.node(name).id for name in ("second", "first")], numbers)
        self.node("first").name = "second"  # which one here has already
        until("it is called almost so", lambda: second.name != "first")
        settle()
        self.assertEqual((len(self.marks()), pump.link.notes), (2, {}))

    def test_constraints_hold_and_nothing_goes_to_and_fro(self):
        target = add(self.stage, "target", None, (5, 1, 2))
        mother = add(self.stage, "mother", None, (50, 11, 2))
        mother.rotation_euler, mother.scale = (1.3, 0.4, 0.5), (1.3, 1.3, 1.3)
        held, carried = (add(self.stage, name, box(name), (1, 2, 3), mother) for name in ("held", "carried"))
        held.constraints.new("LIMIT_ROTATION")
        carried.constraints.new("CHILD_OF").target = target
        for thing in (held, carried):
            thing.rotation_euler, thing.scale = (0.1, 0.2, 0.3), (1.7, 1.7, 1.7)
        link = self.link()
        target.location, target.rotation_euler = (8, 3, 4), (0.1, 0.2, 0.3)  # what follows it stands elsewhere
        settle()
        for name in ("held", "carried"):
            (node,) = self.wall.find(f"/Stage/**/{name}", type="Transform")
            for at in range(1, 9):
                sent, taken, value = link.counts["sent"], link.counts["taken"], (at / 3, 7.1 - at, 0.3 * at)
                node.set(translation=value, scale=(1 + at / 7,) * 3)
                until("it is there", lambda: link.counts["taken"] == taken + 2)
                pumps(10)
                self.assertEqual((link.counts["sent"] - sent, node.translation), (0, value), name)

    def test_modes_in_which_a_mesh_is_edited(self):
        thing = add(self.stage, "box", box("a"))
        link = self.link()
        bpy.context.view_layer.objects.active = thing
        thing.select_set(True)
        for mode in ("EDIT", "SCULPT", "WEIGHT_PAINT", "OBJECT"):
            bpy.ops.object.mode_set(mode=mode)
            self.node("box").translation = (len(mode), 0, 0)
            until("it moves", lambda: thing.location.x == len(mode))
            if mode == "EDIT":
                bpy.ops.mesh.select_all(action="SELECT")
                bpy.ops.transform.translate(value=(0, 0, 5))
            settle()
            self.assertEqual(self.node("box/box").positions[:, 2].max(), 6)
        self.assertEqual((len(self.marks()), link.notes), (1, {}))

    def test_a_thousand_go_at_once(self):
        things = [add(self.stage, f"{at}", box(f"{at}", 0.1)) for at in range(1000)]
        add(self.stage, "kept", box("kept"))
        update()
        bpy.ops.ed.undo_push(message="begin")
        link = self.link()
        link.counts["longest_ms"], batches = 0.0, link.counts["batches"]
        bpy.data.batch_remove(things)
        update()
        bpy.ops.ed.undo_push(message="delete")
        settle()
        self.assertEqual((len(self.marks()), link.counts["batches"] - batches), (1, 1))
        self.wall.undo()  # they were hung below one node, which was then removed
        self.wall.undo()
        until("they are here again", lambda: len(self.stage.objects) == 1001)
        settle()
        self.assertEqual((len(self.marks()), link.notes), (1001, {}))
        for count in (1, 1001):  # that they came is a step, too
            bpy.ops.ed.undo()
            settle()
            self.assertEqual((len(self.marks()), len(link.collection.objects), link.notes), (count, count, {}))

    def test_pythons_collection_looks_at_nothing_twice(self):
        for at in range(2000):
            add(self.stage, f"{at}", bpy.data.meshes.get("a") or box("a"))
        link = self.link()
        self.assertEqual(len(link.objects), 2000)
        self.assertGreater(gc.get_freeze_count(), 20000)
        self.assertLess(len(gc.get_objects(generation=2)), 20000)
        pump.stop()
        self.assertEqual(gc.get_freeze_count(), 0)

    def test_all_are_looked_through_slice_by_slice(self):
        """After undo: a pump without any time looks at few."""
        for at in range(1000):
            add(self.stage, f"{at}", bpy.data.meshes.get("a") or box("a"))
        update()
        bpy.ops.ed.undo_push(message="begin")
        self.link()
        bpy.ops.ed.undo_push(message="once more")
        by_name, get = [], ObjectSubject.get

        def counted(subject):
            if subject.thing is None:
                by_name.append(subject)  # which takes as long as there are objects
            return get(subject)

        with mock.patch.object(ObjectSubject, "get", counted):
            bpy.ops.ed.undo()
            update()
        known_as, looked_at, most = scan.known_as, [], 0
        self.assertEqual(by_name, [])
        with mock.patch.object(scan, "known_as", lambda thing: looked_at.append(None) or known_as(thing)):
            while pump.link.rescan or pump.link._scanning:
                pump.link.pump(budget=0)
                most = max(most, len(looked_at))
                looked_at.clear()
        self.assertLess(most, 4 * scan.SLICE)

    def test_copies_of_collections_show_themselves(self):
        """What is drawn is said; instances are not."""
        kept = bpy.data.collections.new("kept")
        add(kept, "inside", box("a"))
        thing = add(self.stage, "copies")
        thing.instance_type, thing.instance_collection = "COLLECTION", kept
        link = self.link()
        self.assertEqual(list(link.notes.values()), ["copies (empty with instances): only its place is shown"])
        self.assertEqual(len(self.marks()), 1)


class Whole(OnAWall):
    """The collection is known by its key."""

    def setUp(self):
        super().setUp()
        self.thing = add(self.stage, "box", box("a"))

    def test_another_one_of_its_name(self):
        link = self.link()
        self.stage.name = "Old"
        new = bpy.data.collections.new("Stage")
        bpy.context.scene.collection.children.link(new)
        update()
        bpy.ops.ed.undo_push(message="names")
        settle()
        self.assertIs(link.collection, self.stage)
        bpy.data.objects["box"].location.x = 1
        update()
        bpy.ops.ed.undo_push(message="move")
        bpy.ops.ed.undo()
        settle()
        self.assertEqual((link.collection.name, len(self.marks()), len(link.objects), link.notes), ("Old", 1, 1, {}))
        bpy.data.objects["box"].location.x = 4
        settle()
        self.assertEqual(self.node("box").translation[0], 4)

    def test_it_is_removed_and_another_one_called_so(self):
        update()
        bpy.ops.ed.undo_push(message="begin")
        link = self.link()
        bpy.data.collections.remove(self.stage)
        pumps()
        new = bpy.data.collections.new("Stage")
        bpy.context.scene.collection.children.link(new)
        add(new, "another", box("b"))
        pumps()
        self.assertEqual((link.collection, len(link.notes), [node.name for node in self.marks()]),
                         (None, 1, [f"blender:{next(iter(link.objects))}"]))
        self.assertIn("the collection Stage was removed here", next(iter(link.notes.values())))
        self.node("box").translation = (0, 6, 0)  # nobody follows
        bpy.ops.ed.undo_push(message="removed")
        bpy.ops.ed.undo()
        until("it is linked again", lambda: link.collection is not None and link.courier.state == "linked")
        settle()
        self.assertEqual((link.notes, len(self.marks()), [each.name for each in link.collection.objects]),
                         ({}, 1, ["box"]))
        self.assertEqual(bpy.data.objects["box"].location.y, 6)

    def test_it_is_removed_while_something_is_under_way(self):
        """What is answered while nobody listens is not waited for; what was never heard to be granted is asked anew."""
        update()
        bpy.ops.ed.undo_push(message="begin")
        link = self.link()
        bpy.data.objects["box"].location.x = 5
        update()
        bpy.ops.ed.undo_push(message="move")
        sent = link.counts["batches"]
        until("the move is under way", lambda: link.counts["batches"] > sent)
        self.assertIsNotNone(link._under_way)
        bpy.data.collections.remove(self.stage)
        pumps()
        self.node("box").translation = (0, 6, 0)
        pumps()
        bpy.ops.ed.undo_push(message="removed")
        bpy.ops.ed.undo()
        until("it is linked again", lambda: link.collection is not None and link.courier.state == "linked")
        settle()
        stand = [tuple(bpy.data.objects["box"].location), tuple(self.node("box").translation)]
        self.assertEqual((link.notes, stand), ({}, [(5, 0, 0)] * 2))
        bpy.data.objects["box"].location.z = 7
        settle()
        self.assertEqual(tuple(self.node("box").translation), (5, 0, 7))

    def test_a_copy_is_another_one(self):
        link = self.link()
        copy = self.stage.copy()
        copy.name = "Copy"
        bpy.context.scene.collection.children.link(copy)
        settle()
        bpy.data.collections.remove(self.stage)
        pumps()
        self.assertIsNone(link.collection)
        pump.stop()
        start(copy, self.live.address)
        self.assertEqual([len(self.wall.find(f"/{name}/**/blender:*")) for name in ("Stage", "Copy")], [1, 1])
        self.wall["/Copy"].remove()

    def test_an_object_of_two_collections(self):
        """What one link knew of it is not what the other one knows."""
        self.link()
        pump.stop()
        other = bpy.data.collections.new("Other")
        bpy.context.scene.collection.children.link(other)
        add(other, "first", box("first"))
        start(other, self.live.address)
        pump.stop()
        other.objects.link(self.thing)
        link = start(other, self.live.address)
        self.assertEqual((link.notes, len(self.thing.users_collection), len(self.wall.find("/Other/**/blender:*"))),
                         ({}, 2, 2))
        self.wall["/Other"].remove()

    def test_a_file_is_opened_again(self):
        path = os.path.join(self.live.folder, "file.blend")
        self.link()
        self.stage.name = "Renamed"
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        self.assertIsNone(pump.link)
        link = start(bpy.data.collections["Renamed"], self.live.address)
        self.assertEqual((link.notes, len(self.marks()), len(self.wall.find("/*/blender-link:*"))), ({}, 1, 1))

    def test_another_blender_was_first(self):
        """Both found nothing."""
        link = pump.start(self.stage, self.live.address)
        self.assertTrue(eventually(lambda: link.courier.state == "linked"))
        theirs = self.wall.create("/Stage")
        with self.wall.edit() as edit:
            edit.add(theirs, f"blender-link:{link.key}", edit.object("ApplicationData", key="blender of theirs"))
        update()
        pump.pump()
        until("it is taken up", lambda: link.root.number == theirs.id)
        settle()
        self.assertEqual((len(self.wall.find("/*/blender-link:*")), len(self.marks()), link.notes), (1, 1, {}))
        self.assertEqual(len(self.stage.objects), 1)

    def test_the_collection_was_made_twice(self):
        """Its root was under way when the link broke, and was granted after nothing had been found."""
        add(self.stage, "box", box("a"))
        link, first = self.link(), Courier._take_up

        class Forgets(dict):
            """As another Blender's would be."""

            def __setitem__(self, key, value):
                pass

        def finds_nothing(courier, wall, role, patient=False):
            Courier._take_up = first
            return Found(role, wall.ask("GetWall"), patient)

        for ours in (True, False):
            Courier._take_up, link.stamps = finds_nothing, {} if ours else Forgets()
            with mock.patch.object(Courier, "_yield_to_the_first"):
                link.courier._broken = tessera.NetworkError("cut")
                until("it is there twice", lambda: len(self.wall.find("/*/blender-link:*")) == 2)
                settle()
            link.look_again_soon()
            settle()
            pumps()
            self.assertEqual(len(self.wall.find("/*/blender-link:*")), 1 if ours else 2)
            self.assertEqual(bool(link.notes), not ours, link.notes)
        self.assertIn("once more at /Stage[1]:", *link.notes.values())
        self.wall["/Stage[1]"].remove()
        bpy.data.objects["box"].location.x = 5
        settle()
        self.assertEqual(self.node("box").translation[0], 5)

    def test_undo_while_nothing_is_linked(self):
        """It goes back to before there were keys, in a file that has no place."""
        update()
        bpy.ops.ed.undo_push(message="box")
        self.link()
        self.step()
        pump.stop()
        bpy.ops.ed.undo()
        stage = bpy.data.collections["Stage"]
        self.assertEqual(key_of(stage), "")
        start(stage, self.live.address)
        self.assertEqual((len(self.wall.find("/*/blender-link:*")), len(self.marks()), pump.link.notes), (1, 1, {}))
        pump.stop()
        stage.name = "other"
        another = bpy.data.collections.new("Stage")
        bpy.context.scene.collection.children.link(another)
        start(another, self.live.address)
        add(another, "more")
        settle()
        self.assertEqual(len(self.wall.find("/*/blender-link:*")), 2)
        self.wall["/Stage[1]"].remove()

    def step(self):
        bpy.data.objects["box"].location.z += 1
        update()
        bpy.ops.ed.undo_push(message="a step")
        settle()

    def test_undo_of_what_was_before_the_link_broke(self):
        link = self.link()
        add(self.stage, "kept", box("kept"))
        settle()
        for remove in (lambda: bpy.data.objects.remove(bpy.data.objects["box"]), lambda: self.node("box").remove()):
            remove()
            until("it is gone", lambda: len(link.objects) == 1)
            settle()
            link.courier._broken = tessera.NetworkError("a test")
            until("it has gone", lambda: link.courier.state == "reconnecting")
            until("it is linked again", lambda: link.courier.state == "linked")
            settle()
            self.wall.undo()
            until("it is back", lambda: "box" in self.stage.objects)
            settle()
            self.assertEqual((len(self.marks()), link.notes, self.node("box/box").core.type), (2, {}, "Geometry"))

    def test_what_a_library_has(self):
        """Read only, and of the same names as what is here."""
        path = os.path.join(self.live.folder, "library.blend")
        self.stage.name = self.thing.name = "other"
        far = bpy.data.collections.new("Far")
        add(far, "box", box("far", materials=(principled("paint", Roughness=0.125),)), (7, 0, 0))
        bpy.data.libraries.write(path, {far})
        bpy.data.collections.remove(far)
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.setUp()
        self.thing.data.materials.append(principled("paint", Roughness=0.75))
        with bpy.data.libraries.load(path, link=True) as (_, into):
            into.collections = ["Far"]
        self.stage.children.link(into.collections[0])
        (theirs,) = into.collections[0].objects
        link = self.link()
        for _ in range(3):
            add(self.stage, "more")  # all are looked at again
            settle()
        boxes = {round(node.translation[0]): node for node in self.wall.find("/Stage/box", type="Transform")}
        self.assertEqual((sorted(boxes), len(self.marks()), link.notes), ([0, 7], 5, {}))
        for at, roughness in ((0, 0.75), (7, 0.125)):
            self.assertEqual(self.wall.handle(boxes[at].id, "Node").children[1].core.material.roughness, roughness)
        boxes[7].translation = (8, 0, 0)
        boxes[7].name = "called"
        until("it moves", lambda: theirs.location.x == 8)
        settle()
        self.assertEqual((theirs.name, self.thing.location.x), ("box", 0))
        self.assertEqual(list(link.notes.values()),
                         ["box is of library.blend: what is changed at the wall is not saved here"])
        boxes[7].remove()
        until("that is said", lambda: len(link.notes) == 2)
        add(self.stage, "more")
        settle()
        self.assertIn("box was removed at the wall; here it stays in Far, which is of a library", link.notes.values())
        self.assertEqual(len(self.marks()), 5)
