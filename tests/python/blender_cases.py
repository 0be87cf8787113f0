"""Within Blender: what the add-on claims. Counts and values alone are judged here; times are measured by
tests/bench/blender.py."""
import math
import os
import unittest

import bpy
import numpy as np
from blender_side import PERIOD, add, box, only, pause, settle, start, until, update
from live import Live, run_folder
from mathutils import Euler, Matrix

from tessera_link import pump


def principled(name, colour=(0.8, 0.8, 0.8, 1), **inputs):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    sockets = material.node_tree.nodes["Principled BSDF"].inputs
    sockets["Base Color"].default_value = colour
    for socket, value in inputs.items():
        sockets[socket.replace("_", " ")].default_value = value
    return material


def turned(node):
    """What a Transform does, 4 × 4."""
    w, x, y, z = np.array(node.rotation) / np.linalg.norm(node.rotation)
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                               [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                               [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]) * np.array(
                                   node.scale)
    matrix[:3, 3] = node.translation
    return matrix


class OnAWall(unittest.TestCase):
    """A wall that is there, and a file that is empty."""

    options = {}

    @classmethod
    def setUpClass(cls):
        cls.enterClassContext(run_folder())
        cls.live = cls.enterClassContext(Live(**{"surface": "none", **cls.options}))
        cls.wall = cls.enterClassContext(cls.live.connect())

    def setUp(self):
        self.stage = only()

    def tearDown(self):
        pump.stop()
        if "/Stage" in self.wall:
            self.wall["/Stage"].remove()

    def link(self):
        return start(self.stage, self.live.address)

    def node(self, path):
        return self.wall[f"/Stage/{path}"]

    def marks(self):
        return [node for node in self.wall.find("/Stage/**/blender:*")]


class Shown(OnAWall):
    def world_corners(self, *path):
        """Of the wall's triangles, in the world."""
        matrix = turned(self.wall["/Stage"])
        node = self.wall["/Stage"]
        for name in path:
            node = self.wall[f"{node.path}/{name}"]
            matrix = matrix @ turned(node)
        parts = [child for child in node.children if child.core is not None and child.core.type == "Geometry"]
        corners = [part.positions[part.indices] for part in parts]
        found = np.concatenate(corners).astype(float)
        return found @ matrix[:3, :3].T + matrix[:3, 3]

    def assertSameTriangles(self, thing, *path):
        """Corner by corner, whatever the order: +Z up there is +Y up here."""
        evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
        mesh = evaluated.to_mesh()
        mesh.calc_loop_triangles()
        there = np.array([evaluated.matrix_world @ mesh.vertices[at].co for triangle in mesh.loop_triangles
                          for at in triangle.vertices])
        there = np.stack([there[:, 0], there[:, 2], -there[:, 1]], axis=1)
        found = self.world_corners(*path)
        self.assertEqual(found.shape, there.shape)
        size = np.abs(there).max()
        order = [np.lexsort(np.round(each / size, 4).T) for each in (there, found)]
        np.testing.assert_allclose(found[order[1]], there[order[0]], rtol=0, atol=1e-6 * size)

    def test_objects_stand_where_they_stand(self):
        mother = add(self.stage, "mother", box("a"), (1, 2, 3))
        mother.rotation_euler = Euler((0.3, -0.7, 1.1))
        mother.scale = (1, 2.5, 0.5)
        child = add(self.stage, "child", box("b", 0.3), (4, 0, -1), mother)
        child.rotation_mode = "AXIS_ANGLE"
        child.rotation_axis_angle = (0.6, 0.2, 0.5, 0.8)
        child.matrix_parent_inverse = Matrix.Translation((0.5, 0, 2)) @ Matrix.Rotation(0.4, 4, "X")
        mirrored = add(self.stage, "mirrored", bpy.data.meshes["b"], (-5, 1, 1), child)
        mirrored.scale = (-1, 1, 2)
        free = add(self.stage, "free", bpy.data.meshes["a"], (1e4, -2e4, 0.5))
        free.rotation_mode = "QUATERNION"
        free.rotation_quaternion = (0.5, -0.5, 0.1, 0.7)
        self.link()
        self.assertSameTriangles(mother, "mother")
        self.assertSameTriangles(child, "mother", "child")
        self.assertSameTriangles(mirrored, "mother", "child", "mirrored")
        self.assertSameTriangles(free, "free")

    def test_modifiers_curves_and_letters_are_meshes(self):
        smooth = add(self.stage, "smooth", box("a"))
        smooth.modifiers.new("more", "SUBSURF").levels = 2
        plain = add(self.stage, "plain", bpy.data.meshes["a"], (5, 0, 0))
        letters = bpy.data.curves.new("letters", "FONT")
        letters.body = "Ab"
        add(self.stage, "letters", letters, (0, 5, 0))
        self.link()
        for thing in (smooth, plain, bpy.data.objects["letters"]):
            self.assertSameTriangles(thing, thing.name)
        self.assertNotEqual(self.node("smooth/smooth").core, self.node("plain/plain").core)
        smooth.modifiers["more"].levels = 1
        settle()
        self.assertSameTriangles(smooth, "smooth")

    def test_one_mesh_is_one_geometry(self):
        mesh = box("a")
        for at in range(5):
            add(self.stage, f"box {at}", mesh, (3 * at, 0, 0))
        self.link()
        self.assertEqual(len({self.node(f"box {at}/box {at}").core for at in range(5)}), 1)
        mesh.vertices[0].co = (-2, -2, -2)
        mesh.update()
        before = pump.link.counts["sent"]
        settle()
        self.assertLessEqual(pump.link.counts["sent"] - before, 1)
        self.assertSameTriangles(bpy.data.objects["box 3"], "box 3")

    def test_materials_are_parts(self):
        red = principled("red", (1, 0.1, 0.05, 1), Metallic=0.25, Roughness=0.75, Emission=(0.5, 0.25, 0, 1),
                         Emission_Strength=4)
        glass = principled("glass", Alpha=0.5)
        glass.blend_method = "BLEND"
        glass.use_backface_culling = True
        add(self.stage, "box", box("a", materials=(red, glass)))
        self.link()
        found = [self.node(f"box/{name}").material for name in ("box", "box 2")]
        np.testing.assert_allclose(found[0].baseColor, (1, 0.1, 0.05, 1), 1e-6)
        np.testing.assert_allclose([found[0].metallic, found[0].roughness, *found[0].emissive], (0.25, 0.75, 2, 1, 0),
                                   1e-6)
        self.assertEqual((found[0].doubleSided, found[0].alphaMode), (True, "opaque"))
        self.assertEqual((found[1].doubleSided, found[1].alphaMode, found[1].baseColor[3]), (False, "blend", 0.5))
        self.assertEqual([len(self.node(f"box/{name}").indices) for name in ("box", "box 2")], [30, 6])
        bpy.data.meshes["a"].polygons[1].material_index = 0
        bpy.data.meshes["a"].update()
        settle()
        self.assertNotIn("/Stage/box/box 2", self.wall)
        self.assertEqual(len(self.node("box/box").indices), 36)

    def test_a_picture_on_a_material(self):
        image = bpy.data.images.new("checks", 4, 2)
        pixels = np.zeros((2, 4, 4), np.float32)
        pixels[0, 0], pixels[1, 3] = (1, 0, 0, 1), (0, 0.2, 1, 1)  # lower left, upper right
        image.pixels.foreach_set(pixels.reshape(-1))
        material = principled("pictured")
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        material.node_tree.links.new(node.outputs["Color"],
                                     material.node_tree.nodes["Principled BSDF"].inputs["Base Color"])
        mesh = box("a", materials=(material,))
        mesh.uv_layers.new().data.foreach_set("uv", np.tile([0.25, 0.125], 24).astype(np.float32))
        add(self.stage, "box", mesh)
        self.link()
        found = self.node("box/box")
        picture = found.material.baseColorImage
        self.assertEqual((picture.widthPx, picture.heightPx), (4, 2))
        rows = picture.pixels.reshape(2, 4, 4)
        self.assertEqual((rows[1, 0].tolist(), rows[0, 3].tolist()), ([255, 0, 0, 255], [0, 51, 255, 255]))
        self.assertEqual(found.material.baseColor, (1, 1, 1, 1))
        self.assertEqual(set(map(tuple, found.texcoords.tolist())), {(0.25, 0.875)})

    def test_normals_flat_smooth_and_by_angle(self):
        mesh = box("a")
        thing = add(self.stage, "box", mesh)
        self.link()
        self.assertEqual(len(self.node("box/box").positions), 24)
        mesh.polygons.foreach_set("use_smooth", np.ones(6, bool))
        mesh.update()
        settle()
        self.assertEqual(len(self.node("box/box").positions), 8)
        mesh.use_auto_smooth, mesh.auto_smooth_angle = True, math.radians(30)
        thing.update_tag(refresh={"DATA"})
        settle()
        normals = self.node("box/box").normals
        self.assertEqual(len(normals), 24)
        np.testing.assert_allclose(np.sort(np.abs(normals), axis=1), np.tile([0, 0, 1], (24, 1)), atol=1e-6)

    def test_lights(self):
        lamp, spot, sun = (bpy.data.lights.new(name, kind)
                           for name, kind in (("lamp", "POINT"), ("spot", "SPOT"), ("sun", "SUN")))
        lamp.energy, spot.energy, sun.energy, lamp.color = 4 * math.pi ** 2, 100, math.pi, (1, 0.5, 0.25)
        spot.spot_size, spot.spot_blend = 1.2, 0.25
        for light in (lamp, spot, sun, bpy.data.lights.new("panel", "AREA")):
            add(self.stage, light.name, light)
        link = self.link()
        add(self.stage, "box", box("a", materials=(principled("red", (0.3, 0.1, 0.7, 1)),)),
            (0.1, 0.2, 0.3)).rotation_euler = (1, 2, 3)
        settle()
        self.assertAlmostEqual(self.node("lamp/lamp").intensity, 1, 6)
        self.assertEqual(self.node("lamp/lamp").color, (1, 0.5, 0.25))
        self.assertAlmostEqual(self.node("sun/sun").intensity, 1, 6)
        self.assertAlmostEqual(self.node("spot/spot").outerAngle, 0.6, 6)
        self.assertAlmostEqual(self.node("spot/spot").innerAngle, 0.45, 6)
        self.assertEqual(list(link.notes.values()), ["panel (area light): only its place is shown"])
        for _ in range(20):  # what was sent comes back rounded, and is no news
            update()
            pump.pump()
        self.assertEqual((link.counts["taken"], spot.energy), (0, 100))
        spot.energy = 50
        settle()
        self.assertAlmostEqual(self.node("spot/spot").intensity, 50 / (4 * math.pi ** 2), 5)
        self.node("lamp/lamp").intensity = 2.0
        until("brighter", lambda: abs(lamp.energy - 8 * math.pi ** 2) < 1e-3)

    def test_names_in_every_script(self):
        names = ["Würfel/2[3]", "世界 مرحبا 👋", "<b>&amp;", "*", "blender:x", ".."]
        for name in names:
            add(self.stage, name, box(name))
        self.link()
        self.assertEqual({node.name for node in self.wall["/Stage"].children if node.core.type == "Transform"},
                         set(names))

    def test_what_is_left_out_is_said(self):
        add(self.stage, "bones", bpy.data.armatures.new("bones"))
        sheared = add(self.stage, "sheared", box("a"))
        sheared.parent = add(self.stage, "mother")
        sheared.matrix_parent_inverse = Matrix(((1, 0.5, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)))
        update()
        link = self.link()
        self.assertEqual(sorted(link.notes.values()),
                         ["bones (armature): only its place is shown", "sheared is sheared: it is shown without that"])

    def test_the_view_follows_the_camera(self):
        camera = add(self.stage, "camera", bpy.data.cameras.new("camera"), (3, -8, 2))
        camera.rotation_euler = Euler((math.radians(80), 0, math.radians(20)))
        bpy.context.scene.camera = camera
        thing = add(self.stage, "box", box("a"))
        update()
        # In the middle of what it sees
        thing.location = camera.matrix_world @ Matrix.Translation((0, 0, -6)).translation
        link = self.link()
        link.camera_leads = True
        until("the box is in the middle", lambda: self.in_the_middle("box"))
        camera.location = (0, -30, 40)
        camera.rotation_euler = (0, 0, 0)
        thing.location = (0, -30, 35)
        until("the box is in the middle again", lambda: self.in_the_middle("box"))

    def in_the_middle(self, name):
        hit = self.wall.pick(960, 540)  # the head is 0.2 m above the middle of the screen of a wall 1x1
        above = self.wall.pick(960, 420)
        return any(each.hit and self.wall.handle(each.node, "Node").parent.name == name for each in (hit, above))


class BothWays(OnAWall):
    def test_a_move_there_moves_it_here_and_is_not_sent_back(self):
        thing = add(self.stage, "box", box("a"), (1, 2, 3))
        link = self.link()
        sent = link.counts["sent"]
        self.node("box").translation = (1 / 3, 0.1, -7)  # which floats do not hold
        until("it moves", lambda: abs(thing.location.z + 7) < 1e-6)
        np.testing.assert_allclose(thing.location, (1 / 3, 0.1, -7), 1e-6)
        for _ in range(20):
            update()
            pump.pump()
        self.assertEqual((link.counts["sent"], self.node("box").translation), (sent, (1 / 3, 0.1, -7)))
        self.node("box").set(rotation=(0.5, 0.5, 0.5, 0.5), scale=(1, 2, 3))
        until("it turns", lambda: abs(thing.scale.z - 3) < 1e-5)
        thing.location.x = 5  # the rest stays as the wall has it, to the last bit
        settle()
        self.assertEqual(link.counts["sent"], sent + 1)
        self.assertEqual((self.node("box").translation[0], self.node("box").rotation), (5, (0.5, 0.5, 0.5, 0.5)))

    def test_a_drag_here_is_seen_by_others_and_is_one_step_of_undo(self):
        thing = add(self.stage, "box", box("a"), (0, 0, 0))
        link = self.link()
        with self.wall.follow("changes", timeout=60) as changes:
            number, seen = self.node("box").core.id, []
            for at in range(1, 31):
                thing.location.x = at
                update()
                pump.pump()
                pause(2 * PERIOD)
            settle()
            while not seen or seen[-1] != 30:
                for column in next(changes).columns:
                    if column.field.name == "translation" and number in column.ids:
                        seen.append(column.values[column.ids.tolist().index(number)][0])
        self.assertEqual(seen, sorted(set(seen)))  # it never went back
        self.assertEqual(thing.location.x, 30)
        self.assertGreater(link.counts["batches"], 2)
        self.wall.undo()
        until("the whole drag is taken back", lambda: thing.location.x == 0)
        self.assertEqual(self.node("box").translation, (0, 0, 0))
        self.assertIn("/Stage/box", self.wall)

    def test_drags_of_two_things_are_two_steps(self):
        first, second = add(self.stage, "first", box("a")), add(self.stage, "second", box("b"))
        self.link()
        for thing in (first, second):
            for at in range(1, 11):
                thing.location.x = at
                update()
                pump.pump()
                pause()
            settle()
        self.wall.undo()
        until("the second one is taken back", lambda: second.location.x == 0)
        settle()
        self.assertEqual((first.location.x, self.node("first").translation[0]), (10, 10))

    def test_many_moved_at_once_go_there_and_back_as_one(self):
        for at in range(40):
            add(self.stage, f"box {at}", bpy.data.meshes.get("a") or box("a"))
        link = self.link()
        batches = link.counts["batches"]
        for thing in self.stage.objects:
            thing.location = (1, 2, 3)
        settle()
        self.assertEqual(link.counts["batches"], batches + 1)
        self.wall.undo()
        until("all are back", lambda: not any(thing.location.length for thing in self.stage.objects))

    def test_while_it_is_dragged_others_do_not_pull_it_back(self):
        thing = add(self.stage, "box", box("a"))
        self.link()
        for at in range(20):
            thing.location.x = at
            if at % 5 == 0:
                self.node("box").translation = (-50, 0, 0)
            update()
            pump.pump()
        thing.location.x = 99
        settle()
        self.assertEqual((thing.location.x, self.node("box").translation[0]), (99, 99))

    def test_a_parent_moves_alone(self):
        mother = add(self.stage, "mother", None)
        for at in range(50):
            add(self.stage, f"child {at}", bpy.data.meshes.get("a") or box("a"), (at, 0.1, 0.2), mother)
        link = self.link()
        sent = link.counts["sent"]
        mother.location, mother.rotation_euler = (1, 2, 3), (0.1, 0.2, 0.3)
        settle()
        self.assertEqual(link.counts["sent"] - sent, 2)
        child = bpy.data.objects["child 7"]
        child.parent = None
        settle()
        self.assertIn("/Stage/child 7", self.wall)
        self.wall.ask("MoveNode", node=self.node("mother").id, translation=(9, 9, 9))
        until("it moves", lambda: mother.location.x == 9)
        with self.wall.edit() as edit:
            edit.place(self.node("child 7"), self.node("mother"))
        until("it hangs where the wall has it", lambda: child.parent is mother)

    def test_names_and_materials_both_ways(self):
        material = principled("red", Roughness=0.5)
        thing = add(self.stage, "box", box("a", materials=(material,)))
        link = self.link()
        thing.name = "crate"
        settle()
        self.assertIn("/Stage/crate", self.wall)
        self.node("crate").name = "Kiste 箱"
        until("it is called so", lambda: thing.name == "Kiste 箱")
        sockets = material.node_tree.nodes["Principled BSDF"].inputs
        sockets["Roughness"].default_value = 0.25
        settle()
        there = self.node("Kiste 箱/box").material
        self.assertEqual(there.roughness, 0.25)
        sent = link.counts["sent"]
        there.set(roughness=0.75, baseColor=(0.5, 0.25, 0.125, 1))
        until("the colour comes", lambda: tuple(sockets["Base Color"].default_value) == (0.5, 0.25, 0.125, 1))
        settle()
        self.assertEqual((sockets["Roughness"].default_value, link.counts["sent"]), (0.75, sent))

    def test_deleted_here(self):
        kept = add(self.stage, "kept", box("a"))
        for at in range(20):
            add(self.stage, f"gone {at}", bpy.data.meshes["a"])
        child = add(self.stage, "child", bpy.data.meshes["a"], (1, 0, 0), bpy.data.objects["gone 0"])
        self.link()
        self.assertEqual(len(self.marks()), 22)
        bpy.data.objects.remove(bpy.data.objects["gone 19"])
        settle()
        self.assertEqual(len(self.marks()), 21)
        for at in range(19):
            bpy.data.objects.remove(bpy.data.objects[f"gone {at}"])
        settle()
        self.assertEqual({node.name for node in self.wall["/Stage"].children if node.core.type == "Transform"},
                         {"kept", "child"})
        self.assertEqual(len(kept.users_collection) + len(child.users_collection), 2)

    def test_removed_there(self):
        for name in ("box", "other"):
            add(self.stage, name, bpy.data.meshes.get("a") or box("a"))
        link = self.link()
        self.node("box").remove()
        until("it is in no collection", lambda: not bpy.data.objects["box"].users_collection)
        settle()
        self.assertEqual(list(link.notes.values()),
                         ["box was removed at the wall: it is in no collection now, and the file keeps it"])
        self.wall.undo()
        until("it is back", lambda: "box" in self.stage.objects)
        settle()
        self.assertEqual((link.notes, len(self.marks())), ({}, 2))
        self.wall["/Stage"].remove()
        until("that is said", lambda: link.notes)
        self.assertEqual(len(self.stage.objects), 2)
        self.wall.undo()
        until("it is all there", lambda: not link.notes)
        bpy.data.objects["box"].location.x = 4
        settle()
        self.assertEqual((self.node("box").translation[0], len(self.marks())), (4, 2))

    def test_what_went_with_its_last_user_is_made_again(self):
        image = bpy.data.images.new("checks", 2, 2)
        material = principled("pictured")
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        material.node_tree.links.new(node.outputs["Color"],
                                     material.node_tree.nodes["Principled BSDF"].inputs["Base Color"])
        add(self.stage, "box", box("a", materials=(material,)))
        link = self.link()
        bpy.data.objects.remove(bpy.data.objects["box"])
        settle()
        until("that is known", lambda: not link.contents.images["checks", None].mirror.number)
        add(self.stage, "again", bpy.data.meshes["a"])
        settle()
        self.assertEqual(self.node("again/again").material.baseColorImage.widthPx, 2)
        self.stage.name = "Bühne"
        bpy.data.objects["again"].location.x = 3
        settle()
        self.assertEqual((self.node("again").translation[0], link.notes), (3, {}))

    def test_copies_in_blender_are_others(self):
        thing = add(self.stage, "box", box("a"))
        self.link()
        copy = thing.copy()
        self.stage.objects.link(copy)
        copy.location.x = 5
        settle()
        self.assertEqual(len(self.marks()), 2)
        self.assertEqual((self.node("box").translation[0], self.node("box.001").translation[0]), (0, 5))

    def test_what_is_refused_is_said_and_the_rest_goes_on(self):
        bad, good = add(self.stage, "bad", box("a")), add(self.stage, "good", box("b"))
        link = self.link()
        bad.location.x, good.location.x = float("nan"), 3
        until("that is said", lambda: any("bad: the wall refuses" in note for note in link.notes.values()))
        settle()
        self.assertEqual(self.node("good").translation[0], 3)
        bad.location.x = 1
        settle()
        self.assertEqual((self.node("bad").translation[0], link.notes), (1, {}))


class Undo(OnAWall):
    def setUp(self):
        super().setUp()
        self.thing = add(self.stage, "box", box("a"))
        self.other = add(self.stage, "other", box("b"))
        update()
        bpy.ops.ed.undo_push(message="begin")

    def box(self):
        """Undo makes new ones of all objects."""
        return bpy.data.objects["box"]

    def test_blenders_undo_is_an_edit_of_the_wall(self):
        link = self.link()
        self.box().location.x = 3
        update()
        bpy.ops.ed.undo_push(message="move")
        settle()
        self.assertEqual(self.node("box").translation[0], 3)
        bpy.ops.ed.undo()
        settle()
        self.assertEqual((self.box().location.x, self.node("box").translation[0]), (0, 0))
        self.wall.undo()  # of that edit, which is a step of the wall's own
        until("it is taken back there", lambda: self.box().location.x == 3)
        self.wall.redo()
        until("and done again", lambda: self.box().location.x == 0)
        bpy.ops.ed.redo()
        settle()
        self.assertEqual((self.box().location.x, self.node("box").translation[0]), (3, 3))
        self.assertEqual(len(self.marks()), 2)
        self.assertEqual(link.notes, {})

    def test_the_walls_undo_is_no_step_of_blenders(self):
        self.link()
        self.box().location.x = 3
        update()
        bpy.ops.ed.undo_push(message="move")
        settle()
        self.wall.undo()
        until("it is back", lambda: self.box().location.x == 0)
        settle()
        self.wall.redo()
        until("it is there again", lambda: self.box().location.x == 3)
        bpy.ops.ed.undo()  # of the one step that Blender has
        settle()
        self.assertEqual((self.box().location.x, self.node("box").translation[0]), (0, 0))

    def test_blenders_undo_leaves_what_others_moved(self):
        self.link()
        bpy.data.objects["other"].location.x = 1
        update()
        bpy.ops.ed.undo_push(message="move other")
        settle()
        self.node("box").translation = (0, 0, 8)
        until("it moves", lambda: self.box().location.z == 8)
        bpy.data.objects["other"].location.x = 2
        update()
        bpy.ops.ed.undo_push(message="move other again")
        settle()
        bpy.ops.ed.undo()
        settle()
        self.assertEqual((bpy.data.objects["other"].location.x, self.node("other").translation[0]), (1, 1))
        self.assertEqual((self.box().location.z, self.node("box").translation[2]), (8, 8))

    def test_undo_over_the_link_itself_makes_nothing_twice(self):
        self.box().location.x = 3
        update()
        bpy.ops.ed.undo_push(message="move")
        self.link()
        numbers = sorted(node.id for node in self.wall.find("/Stage/**"))
        bpy.ops.ed.undo()
        settle()
        self.assertEqual((self.box().location.x, self.node("box").translation[0]), (0, 0))
        self.assertEqual(sorted(node.id for node in self.wall.find("/Stage/**")), numbers)

    def test_a_deletion_and_both_undos(self):
        link = self.link()
        bpy.data.objects.remove(self.box())
        update()
        bpy.ops.ed.undo_push(message="delete")
        settle()
        self.assertNotIn("/Stage/box", self.wall)
        bpy.ops.ed.undo()
        settle()
        self.assertEqual((len(self.marks()), len(link.objects)), (2, 2))
        self.assertIn("/Stage/box", self.wall)
        bpy.data.objects.remove(self.box())
        settle()
        self.wall.undo()
        until("the wall's undo brings it back", lambda: "box" in bpy.data.objects)
        settle()
        self.assertEqual((len(self.marks()), self.box().data.name), (2, "a"))
        self.box().location.x = 6
        settle()
        self.assertEqual(self.node("box").translation[0], 6)


class Many(OnAWall):
    def test_ten_thousand_objects(self):
        mesh = box("a", 0.2)
        for at in range(10000):
            add(self.stage, f"{at}", mesh, (at % 100, at // 100, 0))
        link = self.link()
        self.assertEqual(len(self.marks()), 10000)
        for at in (7, 9999):
            sent, batches = link.counts["sent"], link.counts["batches"]
            bpy.data.objects[f"{at}"].location.z = 1
            self.assertLess(settle(), 200)
            self.assertEqual((link.counts["sent"] - sent, link.counts["batches"] - batches), (1, 1))
        self.assertEqual(self.node("9999").translation, (99, 99, 1))
        nodes = self.wall.nodes([self.node(f"{at}") for at in range(1000)])
        nodes.translations = np.tile([1.0, 2.0, 3.0], (1000, 1))
        sent = link.counts["sent"]
        until("a thousand move", lambda: bpy.data.objects["999"].location.z == 3)
        settle()
        self.assertEqual(link.counts["sent"], sent)
        pump.stop()
        again = start(self.stage, self.live.address)
        self.assertEqual((len(self.marks()), again.notes), (10000, {}))


class Large(OnAWall):
    def test_a_million_triangles(self):
        side = 708
        x, y = np.meshgrid(np.linspace(-1, 1, side, dtype=np.float32), np.linspace(-1, 1, side, dtype=np.float32))
        mesh = bpy.data.meshes.new("field")
        corners = np.arange(side * side).reshape(side, side)
        quads = np.stack([corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]],
                         axis=-1).reshape(-1, 4)
        mesh.vertices.add(side * side)
        mesh.vertices.foreach_set("co", np.stack([x, y, np.sin(4 * x)], axis=-1).reshape(-1))
        mesh.loops.add(quads.size)
        mesh.loops.foreach_set("vertex_index", quads.reshape(-1))
        mesh.polygons.add(len(quads))
        mesh.polygons.foreach_set("loop_start", np.arange(0, quads.size, 4))
        mesh.polygons.foreach_set("loop_total", np.full(len(quads), 4))
        mesh.polygons.foreach_set("use_smooth", np.ones(len(quads), bool))
        mesh.update(calc_edges=True)
        add(self.stage, "field", mesh)
        link = self.link()
        found = self.node("field/field")
        self.assertEqual((len(found.positions), len(found.indices)), (side * side, 6 * len(quads)))
        batches = link.counts["batches"]
        for at in range(50):  # it is read again at once only as often as that costs little
            mesh.vertices[0].co.z = at
            mesh.update()
            update()
            pump.pump()
        self.assertLessEqual(link.counts["batches"] - batches, 10)
        mesh.vertices[0].co.z = 77
        mesh.update()
        settle()
        self.assertEqual(self.node("field/field").positions[:, 2].max(), 77)


class NotLetIn(OnAWall):
    def ends(self, *words, **more):
        link = pump.start(self.stage, *words, **more)
        until("it says what is wrong", lambda: link.courier.state in ("failed", "reconnecting"))
        return link.courier.state, link.courier.message

    def test_no_wall(self):
        self.assertEqual(self.ends("here")[0], "failed")
        state, said = self.ends("127.0.0.1:9")
        self.assertEqual(state, "reconnecting")
        self.assertIn("no Tessera server at 127.0.0.1:9", said)

    def test_a_wrong_token(self):
        path = os.path.join(self.live.folder, "wrong")
        with open(path, "w") as file:
            file.write("a" * 40 + "\n")
        state, said = self.ends(self.live.address, token_file=path)
        self.assertEqual(state, "failed")
        self.assertRegex(said, "token|refuse")

    def test_a_viewer_may_not_edit(self):
        add(self.stage, "box", box("a"))
        state, said = self.ends(self.live.address, token_file=self.live.token_file("viewer"))
        self.assertEqual((state, "/Stage" in self.wall), ("failed", False))
        self.assertIn("viewer's: it may look, and not edit", said)
        start(self.stage, self.live.address, token_file=self.live.token_file("editor"))
        self.assertIn("/Stage/box", self.wall)

    def test_by_a_pages_link_and_by_the_buttons(self):
        add(self.stage, "box", box("a"))
        bpy.context.scene.tessera_link.collection = self.stage
        bpy.context.preferences.addons["tessera_link"].preferences.address = self.live.link("editor")
        self.assertEqual(bpy.ops.tessera.link(), {"FINISHED"})
        self.assertFalse(bpy.ops.tessera.link.poll())
        until("linked", lambda: pump.link.courier.state == "linked")
        settle()
        self.assertIn("/Stage/box", self.wall)
        self.assertEqual(bpy.ops.tessera.unlink(), {"FINISHED"})
        self.assertIn("/Stage/box", self.wall)
        bpy.context.preferences.addons["tessera_link"].preferences.address = ""  # the one of this user on this machine
        self.assertEqual(bpy.ops.tessera.link(), {"FINISHED"})
        until("linked", lambda: pump.link.courier.state == "linked")
        settle()
        self.assertEqual(len(self.marks()), 1)


class Server(unittest.TestCase):
    """Killed, and started again."""

    def scene(self):
        stage = only()
        add(stage, "box", box("a", materials=(principled("red"),)), (1, 2, 3))
        add(stage, "other", bpy.data.meshes["a"], (4, 5, 6))
        lamp = bpy.data.lights.new("lamp", "POINT")
        add(stage, "lamp", lamp)
        return stage

    def killed(self, live, link):
        live.kill_server()
        until("that is said", lambda: link.courier.state == "reconnecting")

    def back(self, live, link):
        live.start_server()
        until("linked again", lambda: link.courier.state == "linked")
        settle()

    def tearDown(self):
        pump.stop()

    def test_with_a_journal_the_same_nodes_go_on(self):
        with run_folder(), Live(surface="none", journal=True) as live:
            link = start(self.scene(), live.address)
            with live.connect() as wall:
                before = sorted(node.id for node in wall.find("/Stage/**"))
            sent = link.counts["sent"]
            self.killed(live, link)
            bpy.data.objects["box"].location.x = 50  # nobody is there
            add(bpy.data.collections["Stage"], "new", bpy.data.meshes["a"])
            bpy.data.objects.remove(bpy.data.objects["lamp"])
            for _ in range(20):
                update()
                pump.pump()
            self.back(live, link)
            with live.connect() as wall:
                after = sorted(node.id for node in wall.find("/Stage/**"))
                self.assertEqual(len(set(before) - set(after)), 3)  # of the lamp
                self.assertEqual(len(set(after) - set(before)), 3)  # of the new one
                self.assertEqual(wall["/Stage/box"].translation, (50, 2, 3))
                self.assertEqual(wall["/Stage/new/new"].core, wall["/Stage/box/box"].core)
                self.assertLess(link.counts["sent"] - sent, 15)
                wall["/Stage/other"].translation = (0, 0, 1)
            until("the link goes on", lambda: bpy.data.objects["other"].location.z == 1)

    def test_without_one_all_is_sent_anew(self):
        with run_folder(), Live(surface="none") as live:
            link = start(self.scene(), live.address)
            for turn in range(2):
                self.killed(live, link)
                bpy.data.objects["box"].location.x = 60 + turn
                self.back(live, link)
                with live.connect() as wall:
                    self.assertEqual(len(wall.find("/Stage/**/blender:*")), 3)
                    self.assertEqual(len(wall.find("/*/blender-link:*")), 1)
                    self.assertEqual(wall["/Stage/box"].translation, (60 + turn, 2, 3))
                    self.assertEqual(len(wall["/Stage/box/box"].indices), 36)
                    self.assertEqual(wall["/Stage/box/box"].material.roughness, 0.5)
                    self.assertEqual(wall["/Stage/lamp/lamp"].core.type, "PointLight")
                    self.assertTrue(wall["/Stage/lamp/lamp"].shadows)
                self.assertEqual(link.notes, {})
