"""Within Blender: what comes at the wrong moment, and what neither side can show."""
import bpy
from blender_cases import OnAWall, principled
from blender_side import add, box, settle, until, update


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
