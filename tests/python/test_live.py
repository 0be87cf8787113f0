"""A program in Python and a running wall: edits, arrays, what is told, and what is refused."""
import copy
import pickle
import threading
import unittest
from unittest import mock

import numpy as np

import tessera
from eventually import eventually
from live import PATIENCE, ROOT, Live


class OnAWall(unittest.TestCase):
    """One wall for all tests of a class; nobody draws."""

    options = {"surface": "none"}

    @classmethod
    def setUpClass(cls):
        cls.live = cls.enterClassContext(Live(**cls.options))
        cls.wall = cls.enterClassContext(cls.live.connect())


class Edits(OnAWall):
    def test_a_field_is_set_when_the_assignment_returns(self):
        node = self.wall["/row"]
        node.translation = (1, 2, 3)
        self.assertEqual(node.translation, (1.0, 2.0, 3.0))
        with self.live.connect() as other:
            self.assertEqual(other["/row"].translation, (1.0, 2.0, 3.0))
        node.set(translation=np.array([0.5, 0, 0]), scale=[2, 2, 2])
        self.assertEqual((node.translation, node.scale, node.rotation), ((0.5, 0, 0), (2, 2, 2), (1, 0, 0, 0)))

    def test_a_tree_is_walked(self):
        names = [child.name for child in self.wall.root.children]
        self.assertIn("carriage", names)
        body = self.wall["/carriage"] / "body"
        self.assertEqual((body.path, body.parent.path, body.core.type), ("/carriage/body", "/carriage", "Geometry"))
        self.assertEqual(self.wall["/carriage/body"].core.material.type, "Material")
        self.assertTrue("/carriage" in self.wall and "/carrage" not in self.wall)
        self.assertEqual(len(self.wall.find("/row*", "Transform")), 5)
        self.assertEqual(self.wall[f"#{body.id}"].path, body.path)

    def test_nodes_come_go_and_are_copied(self):
        made = self.wall.create("/made", translation=(1, 0, 0))
        inner = made.create("light", "PointLight", intensity=3.0)
        self.assertEqual((inner.path, inner.intensity), ("/made/light", 3.0))
        copy = made.clone("copy", deep=True)
        copy.translation = (2, 0, 0)
        self.assertEqual((copy.path, made.translation), ("/copy", (1.0, 0.0, 0.0)))
        copy.move((1, 0, 0), by=True)
        self.assertEqual(copy.translation, (3.0, 0.0, 0.0))
        inner.name = "lamp"
        self.assertIn("/made/lamp", self.wall)
        self.wall.remove("/copy")
        made.remove()
        self.assertFalse("/made" in self.wall or "/copy" in self.wall)

    def test_an_edit_is_granted_or_refused_as_one_and_is_one_step(self):
        with self.wall.edit() as edit:
            node = self.wall.create("/batch")
            self.wall.create("/batch/ball", "Geometry", positions=np.eye(3), indices=np.arange(3, dtype=np.uint32))
            self.wall["/row"].translation = (7, 7, 7)
            self.wall["/row"].translation = (8, 8, 8)  # the last one counts
            self.assertNotIn("/batch", self.live.run("tessera-ctl", "--server", self.live.address, "tree").stdout)
        self.assertEqual((self.wall["/row"].translation, node.path, len(edit.committed.ids)),
                         ((8.0, 8.0, 8.0), "/batch", 4))
        self.assertEqual(self.wall["/batch/ball"].positions.shape, (3, 3))
        self.wall.undo()
        self.assertNotIn("/batch", self.wall)
        self.wall.redo()
        self.assertIn("/batch", self.wall)
        self.assertEqual(self.wall["/batch"].id, node.id)
        before = self.wall["/row"].translation
        with self.assertRaises(tessera.BadInput):
            with self.wall.edit():
                self.wall["/row"].translation = (9, 9, 9)
                self.wall["/batch"].rotation = (0, 0, 0, 0)  # the server's word: no direction
        self.assertEqual(self.wall["/row"].translation, before)
        with self.assertRaises(RuntimeError):
            with self.wall.edit():
                self.wall["/row"].translation = (9, 9, 9)
                raise RuntimeError("of the caller")
        self.assertEqual(self.wall["/row"].translation, before)

    def test_what_an_edit_hangs_its_nodes_below_is_asked_for_once(self):
        with mock.patch.object(self.wall, "_ask", wraps=self.wall._ask) as asked, self.wall.edit():
            made = [self.wall.create(f"/carriage/part{at}") for at in range(20)]
        self.assertEqual(asked.call_count, 1)
        self.assertEqual(made[-1].parent.path, "/carriage")
        self.wall.undo()

    def test_edits_of_one_name_are_one_step(self):
        node = self.wall.create("/dragged")
        for at in range(4):
            with self.wall.edit(undo="drag"):
                node.translation = (at, 0, 0)
        self.wall.undo()
        self.assertEqual(node.translation, (0.0, 0.0, 0.0))

    def test_words_references_and_flags(self):
        body = self.wall["/carriage/body"]
        paint = body.core.material
        paint.set(baseColor=(0, 1, 0, 1), alphaMode="opaque", doubleSided=True)
        self.assertEqual((paint.alphaMode, paint.doubleSided), ("opaque", True))
        self.assertEqual(body.material, paint)
        self.assertEqual(self.wall["/drive"].mode, "once")
        with self.assertRaisesRegex(tessera.BadInput,
                                    'Material.alphaMode: "opak" is none of auto, opaque, mask, blend; is it opaque'):
            paint.alphaMode = "opak"
        body.material = None
        self.assertIsNone(body.material)
        body.material = paint
        turned = (self.wall.create("/matrix", "ComponentTransform")
                  if "matrix" in self.wall.schema.types["ComponentTransform"].fields else None)
        if turned is not None:
            matrix = np.eye(4)
            matrix[:3, 3] = (1, 2, 3)
            turned.matrix = matrix
            self.assertTrue(np.array_equal(turned.matrix, matrix))

    def test_many_nodes_at_once(self):
        with self.wall.edit() as edit:
            self.wall.create("/many")
            made = [edit.create(f"/many/n{at}") for at in range(300)]
        nodes = self.wall.nodes(made)
        places = np.random.default_rng(1).random((300, 3))
        nodes.translations = places
        self.assertTrue(np.array_equal(nodes.translation, places))
        with self.wall.edit() as edit:
            edit.set(nodes, "scale", np.full((300, 3), 2.0))
            edit.set(made[7], scale=(3, 3, 3))  # after the array: it counts
        self.assertEqual((made[7].scale, made[8].scale), ((3.0, 3.0, 3.0), (2.0, 2.0, 2.0)))
        nodes.name = [f"m{at}" for at in range(300)]
        self.assertEqual(len(self.wall.nodes("/many/m*")), 300)
        for wrong, what in ((np.zeros((299, 3)), "299 × 3 numbers instead of 300 × 3"), (np.zeros((300, 2)), "300 × 2"),
                            (np.full((300, 3), np.nan), "not all numbers are finite")):
            with self.assertRaisesRegex(tessera.BadInput, what):
                nodes.translation = wrong
        with self.assertRaisesRegex(tessera.BadInput, "several types"):
            self.wall.nodes(["/many", "/sky"])

    def test_two_threads_edit_and_each_has_its_own_batch(self):
        nodes = [self.wall.create(f"/thread{at}") for at in range(2)]
        faults = []

        def work(at):
            try:
                for turn in range(10):
                    with self.wall.edit():
                        nodes[at].translation = (turn, 0, 0)
            except Exception as error:  # told by the test's own thread
                faults.append(error)
        threads = [threading.Thread(target=work, args=(at,)) for at in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(PATIENCE)
        self.assertEqual((faults, [node.translation[0] for node in nodes]), ([], [9.0, 9.0]))


class Arrays(OnAWall):
    def test_arrays_of_any_size_come_back(self):
        node = self.wall.create("/array", "Geometry", primitive="points")
        for count in (1, 5_461, 5_462, 100_000, 700_000):  # a leaf of 65,536 bytes; more than 1 MiB; several pieces
            with self.subTest(count=count):
                points = np.random.default_rng(count).random((count, 3), np.float32)
                node.positions = points
                back = node.positions
                self.assertEqual((back.dtype, back.shape), (np.float32, (count, 3)))
                self.assertTrue(np.array_equal(back, points))
        node.positions = np.zeros((0, 3), np.float32)
        self.assertEqual((node.fields()["positions"], node.positions.shape, node.colors.dtype),
                         (0, (0, 3), np.dtype("uint8")))

    def test_several_arrays_go_with_one_edit(self):
        points = np.random.default_rng(1).random((30_000, 3), np.float32)
        shades = np.random.default_rng(2).integers(0, 255, (30_000, 4), np.uint8)
        with self.wall.edit():
            for at in range(5):
                self.wall.create(f"/several{at}", "Geometry", primitive="points", positions=points + at,
                                 colors=shades ^ np.uint8(at))
        for at in range(5):
            self.assertTrue(np.array_equal(self.wall[f"/several{at}"].positions, points + at))
            self.assertTrue(np.array_equal(self.wall[f"/several{at}"].colors.reshape(-1, 4), shades ^ np.uint8(at)))

    def test_what_the_server_has_is_not_sent_again(self):
        sent = []
        really = self.wall._link.request
        self.wall._link.request = lambda body, uploads=(), *more, **said: (
            sent.append(body.size + sum(map(len, uploads))), really(body, uploads, *more, **said))[1]
        try:
            points = np.random.default_rng(5).random((200_000, 3), np.float32)
            node = self.wall.create("/again", "Geometry", primitive="points", positions=points)
            node.positions = points[:10]
            node.positions = points
            self.assertLess(sent[-1], 1000)
            # One that it is only said to have is asked for in vain, and then sent.
            other = points + 1
            edit = self.wall.edit()
            edit.set(node, positions=other)
            self.wall._taken.update(dict.fromkeys(edit._arrays.by_name))
            edit.commit()
        finally:
            del self.wall._link.request
        self.assertTrue(np.array_equal(node.positions, other))

    def test_whole_numbers_come_as_what_they_are(self):
        node = self.wall.create("/whole", "Geometry", positions=np.eye(3), indices=[2, 1, 0],
                                colors=np.full((3, 4), 200))
        self.assertEqual((node.indices.dtype, node.indices.tolist()), (np.dtype("uint32"), [2, 1, 0]))
        self.assertEqual((node.colors.dtype, node.colors.shape), (np.dtype("uint8"), (3, 4)))
        node.core.write("indices", 1, [0, 1])
        self.assertEqual(node.indices.tolist(), [2, 0, 1])
        for first in (1.5, 0.3, -1, True, None, "a", 2 ** 64):
            with (self.subTest(first=first),
                  self.assertRaisesRegex(tessera.BadInput, "Geometry.indices: first is the number")):
                node.core.write("indices", first, [0])
        # Bytes are elements as they lie on the wire; a view of numbers is numbers.
        with self.assertRaisesRegex(tessera.BadInput, "Geometry.indices: 5 bytes are no elements of 1 uint32"):
            node.indices = b"abcde"
        node.positions = memoryview(np.eye(3))
        self.assertTrue(np.array_equal(node.positions, np.eye(3, dtype=np.float32)))
        node.indices = memoryview(np.array([1, 2, 0], ">u4"))
        self.assertEqual(node.indices.tolist(), [1, 2, 0])
        with self.assertRaisesRegex(tessera.BadInput, "Geometry.indices: its elements are uint32, not float32"):
            node.indices = memoryview(np.zeros(3, np.float32))

    def test_arrays_of_every_core_come_back_as_they_went(self):
        numbers = np.random.default_rng(7)
        cube = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
        some, turned = numbers.random((5, 3), np.float32), np.tile(np.eye(3, 4, dtype=np.float32).reshape(-1), (2, 1))
        triangle = {"positions": np.eye(3, dtype=np.float32), "normals": np.eye(3, dtype=np.float32),
                    "colors": numbers.integers(0, 255, (3, 4), np.uint8),
                    "texcoords": numbers.random((3, 2), np.float32), "texcoords1": numbers.random((3, 2), np.float32),
                    "indices": np.array([2, 0, 1], np.uint32)}
        cores = {
            "Geometry": triangle,
            "SubdivisionSurface": {"points": cube, "faceSizes": np.full(6, 4, np.uint32),
                                   "faceVertices": np.array(
                                       [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3],
                                       np.uint32),
                                   "creases": np.array([[0, 1], [1, 3]], np.uint32),
                                   "creaseSharpness": np.array([2, 3], np.float32),
                                   "corners": np.array([7], np.uint32), "cornerSharpness": np.ones(1, np.float32),
                                   "holes": np.array([5], np.uint32)},
            "NurbsSurface": {"degreeU": 1, "degreeV": 1, "knotsU": np.array([0., 0, 1, 1]),
                             "knotsV": np.array([0., 0, 1, 1]),
                             "points": np.array([(0., 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 1 / 3)]),
                             "weights": np.array([1, 1, 1, 2 / 3])},
            "Skin": {**triangle, "jointIndices": np.array([[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]], np.uint16),
                     "jointWeights": np.tile(np.array([0.5, 0.5, 0, 0], np.float32), (3, 1)),
                     "inverseBinds": turned, "joints": ["/bones/left", "/bones/right"]},
            "Particles": {"positions": some, "tails": some + 1, "colors": numbers.integers(0, 255, (5, 4), np.uint8),
                          "sizes": some[:, 0].copy(), "ages": some[:, 1].copy(), "turns": some[:, 2].copy()},
            "DistanceLOD": {"ranges": np.array([1., 2, 3])},
            "Volume": {"slices": np.array([[0., 0, 1, 0.5]]), "clipPlanes": np.array([[1., 0, 0, 0.25]])},
            "ApplicationData": {"data": np.frombuffer(b"anything", np.uint8)},
        }
        for bone in ("/bones", "/bones/left", "/bones/right"):
            self.wall.create(bone)
        for at, (core, fields) in enumerate(cores.items()):
            with self.subTest(core):
                node = self.wall.create(f"/core{at}", core, **fields)
                for name, value in fields.items():
                    if isinstance(value, np.ndarray):
                        back = getattr(node, name)
                        self.assertEqual((name, back.dtype, back.shape), (name, value.dtype, value.shape))
                        self.assertTrue(np.array_equal(back, value), name)
                node.remove()

    def test_a_part_of_an_array_is_written(self):
        points = np.zeros((100_000, 3), np.float32)
        node = self.wall.create("/part", "Geometry", primitive="points", positions=points)
        points[17:19] = ((1, 2, 3), (4, 5, 6))
        node.core.write("positions", 17, points[17:19])
        self.assertTrue(np.array_equal(node.positions, points))

    def test_what_could_mean_two_things_is_refused(self):
        node = self.wall.create("/doubt", "Geometry", positions=np.eye(3))
        data = self.wall.create("/data", "ApplicationData", key="numbers")
        with self.assertRaisesRegex(tessera.BadInput, r"ApplicationData.data: elements of int64 could mean two things"):
            data.data = np.arange(3)
        for wrong, what in (([0, 1, -1], "from 0 to 4294967295"), ([0, 1, 2 ** 32], "from 0 to 4294967295"),
                            ([0.0, 1.0, 2.0], "its elements are uint32, not float64")):
            with self.subTest(wrong=wrong), self.assertRaisesRegex(tessera.BadInput, "Geometry.indices: .*" + what):
                node.indices = wrong
        with self.assertRaisesRegex(tessera.BadInput, "Geometry.colors: its numbers are from 0 to 255"):
            node.colors = np.full((3, 4), 256)
        with self.assertRaisesRegex(tessera.BadInput, "Geometry.positions: 4 numbers are no elements of 3"):
            node.positions = np.zeros(4, np.float32)
        with self.assertRaisesRegex(tessera.BadInput, "Geometry.positions: .* is not finite"):
            node.positions = np.full((1, 3), np.inf)
        with self.assertRaisesRegex(tessera.BadInput, "Geometry.positions: not all numbers are finite"):
            node.positions = np.full((10, 3), np.nan)
        with self.assertRaisesRegex(tessera.BadInput,
                                    r"Geometry.positions: \[\[1e\+300, 1e\+300, 1e\+300\]\] is more than a float32 "
                                    r"holds"):
            node.positions = np.full((1, 3), 1e300)
        data.data = np.arange(3, dtype=np.uint8)
        data.data = []
        self.assertEqual(data.data.size, 0)
        with self.assertRaisesRegex(tessera.BadInput, "Geometry.positions: object is no type of numbers"):
            node.positions = [None]


class Refusals(OnAWall):
    def test_each_failure_has_its_exception_and_names_what_is_wrong(self):
        row = self.wall["/row"]
        for values, kind, what in (
                ({"translation": (1, 2)}, tessera.BadInput,
                 "Transform.translation: an array of 2 numbers instead of 3"),
                ({"translation": (1, 2, float("nan"))}, tessera.BadInput,
                 r"Transform.translation: \[1, 2, nan\] is not finite"),
                ({"translation": "here"}, tessera.BadInput, "Transform.translation: 'here' is no number"),
                ({"translation": None}, tessera.BadInput, "Transform.translation: None is no number"),
                ({"translation": (1, "2", 3)}, tessera.BadInput, "Transform.translation"),
                ({"translaton": (1, 2, 3)}, tessera.UnknownField,
                 '/row.* is a Transform, which has no field "translaton"; is it translation'),
                ({"name": 5}, tessera.BadInput, "Node.name: 5 is no text"),
                ({"core": "x" * 5000}, tessera.TesseraError, "")):
            with self.subTest(values=str(values)[:60]), self.assertRaisesRegex(kind, what):
                row.set(**values)
        with self.assertRaisesRegex(tessera.NotFound, 'there is no "roe"'):
            self.wall["/roe"]
        with self.assertRaises(AttributeError):
            row.nothing
        with self.assertRaisesRegex(tessera.UnknownField, 'there is no type "Tranform"; is it Transform'):
            self.wall.create("/x", "Tranform")
        with self.assertRaisesRegex(tessera.BadInput, "is no path of a new node"):
            self.wall.create("x")
        with self.assertRaises(tessera.NotFound):
            self.wall.create("/nowhere/x")
        with self.assertRaises(tessera.Refused):
            with self.wall.edit():
                row.remove()
        with self.assertRaises(tessera.Refused):
            with self.wall.edit(), self.wall.edit():
                pass
        with self.assertRaises(tessera.TesseraError):
            self.wall.load("/etc/passwd")
        with self.assertRaisesRegex(tessera.UnknownField, 'nothing of "frame" is told; .*is it frames'):
            self.wall.follow("frame")
        with self.assertRaisesRegex(tessera.BadInput, "roughness"):
            self.wall["/carriage/body"].core.material.roughness = 9
        with self.assertRaisesRegex(tessera.BadInput, "Material.roughness: .* is more than a float32 holds"):
            self.wall["/carriage/body"].core.material.roughness = 1e300
        with self.assertRaisesRegex(tessera.NotFound, 'Geometry.material: node "/nowhere": there is no "nowhere"'):
            self.wall["/carriage/body"].material = "/nowhere"
        with self.assertRaisesRegex(tessera.UnknownField, 'show has no look "colour"; is it color'):
            self.wall.show(np.eye(3), colour=1)

    def test_what_nobody_would_give_is_refused_in_words(self):
        wall, huge = self.wall, 2 ** 64 - 1
        switch = wall.create("/odd", "Switch")
        ball = wall.create("/odd/ball", "Geometry", positions=np.eye(3), indices=np.arange(3, dtype=np.uint32))
        odd = [
            lambda: setattr(switch, "choice", huge), lambda: setattr(switch, "choice", 2 ** 70),
            lambda: setattr(switch, "choice", np.uint64(huge)),
            lambda: setattr(ball, "material", -5), lambda: setattr(ball, "material", 1 << 63),
            lambda: setattr(ball, "material", 1.5),
            lambda: setattr(ball, "name", "half \ud800"), lambda: setattr(ball, "name", b"bytes"),
            lambda: setattr(switch, "layers", 2 ** 64),
            lambda: wall["/half \ud800"], lambda: "/half \ud800" in wall, lambda: wall.find("/\udfff*"),
            lambda: wall.load("/half \ud800"), lambda: wall.load(None),
            lambda: wall.create(None), lambda: wall.create("/odd/half \ud800"), lambda: wall.create("/odd/b", 5),
            lambda: wall.create("/odd/b", ["Group"]),
            lambda: wall.ask(None), lambda: wall.ask("GetObjects"[:3]), lambda: wall.ask("GetObjects", names=5),
            lambda: wall.ask("GetObjects", names="/odd"),
            lambda: wall.ask("GetObjects", names=[None]), lambda: wall.ask("GetTree", node=2 ** 64),
            lambda: wall.ask("GetTree", node=1.5),
            lambda: wall.ask("GetTree", node=None, levels=np.array([1, 2])),
            lambda: wall.ask("PickAt", x_px=10 ** 400, y_px=0), lambda: wall.ask("PickAt", x_px=np.bool_(True), y_px=0),
            lambda: wall.ask("SetView", position=5), lambda: wall.ask("GetTree", node=1, after=5),
            lambda: wall.ask("GetTree", node=1, after=[5]),
            lambda: wall.nodes(None), lambda: wall.nodes([1, 2]), lambda: wall.nodes([switch, 3.5]),
            lambda: wall.nodes([ball.core]),
            lambda: wall.follow(None), lambda: wall.follow(["frames"]), lambda: wall.object(None),
            lambda: wall.object("Material", nothing=1),
            lambda: wall.follow("frames", most=0), lambda: wall.follow("changes", most=-1),
            lambda: wall.follow("frames", most="x"), lambda: wall.follow("frames", timeout="x"),
            lambda: setattr(ball, "core", "/odd"), lambda: setattr(ball, "core", 5),
            lambda: wall.edit().write("/odd", "positions", 0, b""), lambda: wall.edit().write(ball, [], 0, b""),
            lambda: wall.respond("x", "stop"), lambda: wall.respond(float("nan"), "stop"),
            lambda: wall.respond(None, "stop"), lambda: wall.find("/odd", below=5),
            lambda: wall.load("asset://x", under=5), lambda: ball.clone(under=5), lambda: wall.show(np.eye(3), 5),
            lambda: wall.edit(undo="\ud800"), lambda: ball.move((0, 0, 0), undo=5),
            lambda: wall.ask("GetStatus", timeout="x"), lambda: wall.ask("GetStatus", timeout=10 ** 400),
            lambda: tessera.connect(5), lambda: tessera.connect(self.live.address, name=5),
            lambda: tessera.connect(self.live.address, token_file=5),
            lambda: tessera.connect(self.live.address, timeout="x"), lambda: wall.nodes(memoryview(np.eye(3))),
            lambda: wall.edit().set("/odd", choice=1), lambda: wall.edit().place("/odd", wall.root),
            lambda: wall.edit().place(switch, None),
            lambda: wall.ask("UndoStep", timeout=1j),
            lambda: wall.follow(np.arange(3)), lambda: wall.edit(undo=np.arange(3)),
            lambda: wall.respond(1, np.arange(3)), lambda: wall.find("/odd", np.arange(3)),
            lambda: wall.find("/odd", below=np.arange(3)), lambda: wall.create("/odd/b", np.arange(3)),
            lambda: wall.show(np.eye(3), scalars=[1, 2, 3], cmap=np.arange(3)),
            lambda: wall.show(np.eye(3), color=5), lambda: wall.show(np.eye(3), scalars="abc"),
            lambda: wall.show(np.eye(3), scalars=[1, 2, 3], cmap=[]),
            lambda: wall.show(np.eye(3), scalars=[1, 2, 3], clim=5),
            lambda: wall.show(np.eye(3), scalars=[1, 2, 3], clim=(1, "x")),
            lambda: wall.show(np.eye(3), scalars=[1, 2, 3], clim=(1, 2, 3)),
        ]
        for index in (-1, 2 ** 32, 1.5, None, True, "0"):
            odd += [lambda index=index: wall.edit().create("/odd/b", index=index),
                    lambda index=index: wall.edit().place(ball, wall.root, index)]
        before = [child.path for child in switch.children]
        for at, each in enumerate(odd):
            with self.assertRaises(tessera.TesseraError, msg=f"number {at}") as refused:
                each()
            self.assertNotIn("placeholder", str(refused.exception), f"number {at}")
        self.assertEqual([child.path for child in switch.children], before)
        wall.ask("GetObjects", names=["/odd"], paths=np.bool_(True), timeout=np.float32(60))
        self.assertIs(copy.deepcopy(switch), switch)
        self.assertIs(copy.copy(wall.nodes("/odd")).__class__, tessera.Nodes)
        for kept in (switch, wall.nodes("/odd")):
            with self.assertRaisesRegex(TypeError, "keep"):
                pickle.dumps(kept)
        switch.remove()

    def test_what_is_refused_within_an_edit_leaves_nothing_of_itself(self):
        wall = self.wall
        with wall.edit() as edit:
            node = wall.create("/whole")
            for wrong in (lambda: wall.create("/whole/a", "Geometry", positions=[[1, 2]]),
                          lambda: wall.create("/whole/b", "Geometry", colour=1),
                          lambda: wall.create("/whole/c", "Transform", translation=(0, 0, 0), scale="big"),
                          lambda: wall.object("Material", roughness="rough"),
                          lambda: wall["/row"].set(translation=(9, 9, 9), scale="big"),
                          lambda: node.set(translation=(1, 2, 3), rotation=5),
                          lambda: wall.nodes(["/row"]).set(translations=np.ones((1, 3)), scales=np.ones(5)),
                          lambda: wall.create("/whole/d", index=-1),
                          lambda: wall.show(np.eye(3), "/whole/shown", radius="x"),
                          lambda: wall.create("/whole/e", "Geometry", positions=np.ones((50_000, 3)), indices="none")):
                with self.assertRaises(tessera.BadInput):
                    wrong()
            wall.create("/whole/b")
        self.assertEqual(len(edit.committed.ids), 4, "two nodes, two cores")
        self.assertEqual([child.name for child in node.children], ["b"])
        self.assertEqual(node.translation, (0, 0, 0))
        self.assertNotEqual(wall["/row"].translation, (9, 9, 9))
        self.assertFalse(edit._arrays.by_name, "nothing goes with it")
        with wall.edit() as edit:
            with self.assertRaises(tessera.BadInput):
                wall["/row"].set(scale=(1, 1, 1), translation="far")
        self.assertIsNone(edit.committed, "nothing is left to be sent")
        node.remove()

    def test_every_request_that_is_described_is_answered_as_described(self):
        answered = 0
        for said in self.wall.schema.requests.values():
            needed = {field["name"]: (0, 0, 0) for field in said.fields if field["type"] == "Vector"
                      and not field.get("optional")}
            with self.subTest(request=said.name):
                try:
                    told = self.wall.ask(said.name, **needed)
                except tessera.TesseraError as error:
                    self.assertNotIsInstance(error, (tessera.NetworkError, tessera.UnknownField), said.name)
                else:
                    self.assertEqual(repr(told).split("(")[0], said.answer)
                    answered += 1
        self.assertGreater(answered, 12)

    def test_the_link_outlives_refusals(self):
        for _ in range(20):
            with self.assertRaises(tessera.TesseraError):
                self.wall.ask("RemoveNode", node=1)
        self.assertTrue(self.wall.connected)
        self.assertEqual(self.wall.status().applications, 1)

    def test_an_edit_that_is_too_large_is_not_sent(self):
        with self.assertRaisesRegex(tessera.LimitExceeded, "67108864 is the most"):
            edit = self.wall.edit()
            ids = np.arange(2_500_000, dtype=np.uint64) + 10
            transform = self.wall.schema.type("Transform")
            edit._put_many(transform, transform.field("translation"), ids, np.zeros((2_500_000, 3)))
            edit.commit()


class Told(OnAWall):
    def test_frames_come_and_an_iterator_waits_for_them(self):
        with self.wall.frames(timeout=PATIENCE) as frames:
            first, second = next(frames), next(frames)
        self.assertGreater(second.frame, first.frame)
        self.assertEqual(first.shown, ["all"])
        self.assertEqual(list(frames), [])

    def test_whatever_is_told_of_each_frame(self):
        for what in self.wall.schema.subscriptions:
            if what in ("picks", "questions", "states"):
                continue  # told when somebody does something: below
            with self.subTest(what=what), self.wall.follow(what, timeout=PATIENCE) as told:
                self.assertGreater(next(told).frame, 0)

    def test_states_are_told_at_once_and_when_somebody_comes(self):
        with self.wall.follow("states", timeout=PATIENCE) as states:
            first = next(states)
            self.assertEqual([host.name for host in first.hosts], ["all"])
            with self.live.connect():
                while (told := next(states)).applications <= first.applications:
                    pass
            self.assertGreater(told.comings, first.comings)

    def test_picks_are_told(self):
        with self.wall.follow("picks", timeout=PATIENCE) as picks:
            picked = self.wall.pick(960, 700)
            told = next(picks)
        self.assertEqual((told.hit, told.node, told.point), (picked.hit, picked.node, picked.point))
        self.assertTrue(picked.hit)
        self.assertIn("/", self.wall[f"#{picked.node}"].path)

    def test_two_iterators_of_one_kind_each_get_all(self):
        with self.wall.frames(timeout=PATIENCE) as one, self.wall.frames(timeout=PATIENCE) as other:
            wanted = next(other).frame
            self.assertTrue(any(told.frame >= wanted for told in one))
            one.close()
            self.assertGreater(next(other).frame, 0)

    def test_a_reader_that_stops_loses_the_oldest_and_is_told_how_many(self):
        with self.wall.follow("frames", timeout=PATIENCE, most=2) as frames:
            self.assertTrue(eventually(lambda: frames.missed >= 3))

    def test_changes_are_told_with_objects_and_fields(self):
        node = self.wall.create("/watched")
        with self.wall.follow("changes", timeout=PATIENCE) as changes:
            done = node.set(translation=(1, 2, 3))
            for change in changes:
                if change.sequence == done.sequence:
                    break
            column = next(each for each in change.columns if node.core.id in each.ids)
            self.assertEqual((column.type.name, column.field.name), ("Transform", "translation"))
            self.assertEqual(column.values[column.ids.tolist().index(node.core.id)].tolist(), [1, 2, 3])
            self.assertEqual(self.wall.status().applications, 2)

    def test_a_tree_is_told_and_its_numbers_are_handles(self):
        with self.wall.edit(undo="tree") as edit:
            top = edit.add(self.wall.root, "a/b[1]", edit.object("Transform", translation=(1, 2, 3)))
            shared = edit.object("Geometry", positions=[[0, 0, 0], [1, 0, 0], [0, 1, 0]])
            parts = [edit.add(top, "part", shared) for _ in range(700)]  # more than a page
        rows, names, cores = [], {}, {}
        for page, content in self.wall.tree(top):
            rows += page.tolist()
            for column in content.columns:
                if column.type.name == "Node":
                    {"name": names, "core": cores}[column.field.name].update(zip(column.ids.tolist(), column.values))
        self.assertEqual((len(rows), rows[0][0], rows[0][2]), (701, top.id, 700))
        self.assertEqual((names[top.id], {int(cores[part.id]) for part in parts}), ("a/b[1]", {shared.id}))
        handle = self.wall.handle(top.id, "Node", top.core.id, "Transform")
        self.assertEqual((handle, handle.translation), (top, (1, 2, 3)))
        self.assertEqual(self.wall.handle(shared.id, "Geometry").positions.shape, (3, 3))
        for wrong in (lambda: self.wall.handle(-1), lambda: self.wall.handle(1 << 63),
                      lambda: self.wall.handle(1, "Nothing"),
                      lambda: next(self.wall.tree("/")), lambda: self.wall.edit().add("/", "x"),
                      lambda: self.wall.edit().add(self.wall.root, 7),
                      lambda: self.wall.edit().add(self.wall.root, "x", self.wall.handle(7, "Material"))):
            with self.assertRaises(tessera.BadInput):
                wrong()
        with self.assertRaises(tessera.NotFound):
            next(self.wall.tree(self.wall.handle(10 ** 9)))
        handle.remove()

    def test_nothing_in_time(self):
        with (self.wall.follow("questions", timeout=0.05) as questions,
              self.assertRaisesRegex(tessera.Timeout, '"questions" came within 0.05 s')):
            next(questions)

    def test_changes_end_with_the_wall_that_they_are_asked_of(self):
        wall = self.live.connect()
        changes = wall.follow("changes")
        wall.close()
        for _ in changes:  # what has come already is told
            pass

    def test_a_subscription_ends_with_the_wall(self):
        wall = self.live.connect()
        frames = wall.frames()
        threading.Timer(0.1, wall.close).start()
        self.assertGreaterEqual(sum(1 for _ in frames), 0)
        with self.assertRaisesRegex(tessera.NetworkError, "closed"):
            wall.status()


class TwoWalls(OnAWall):
    options = {"surface": "none"}

    def test_handles_of_another_wall_are_refused_and_nothing_happens(self):
        with Live(surface="none") as other, other.connect() as there:
            theirs, ours = there.create("/theirs"), self.wall.create("/ours")
            material = there.object("Material")
            wrong = [lambda: self.wall.edit().set(theirs, translation=(9, 9, 9)),
                     lambda: self.wall.edit().place(theirs, ours),
                     lambda: self.wall.edit().place(ours, theirs),
                     lambda: self.wall.edit().set(there.nodes([theirs]), "translation", [[7, 7, 7]]),
                     lambda: self.wall.find("/*", below=theirs), lambda: self.wall.nodes([ours, theirs]),
                     lambda: self.wall.create("/box", "Geometry", material=material),
                     lambda: self.wall.load("asset://x.tsct", under=theirs),
                     lambda: self.wall.edit().write(theirs, "name", 0, [1])]
            for each in wrong:
                with self.assertRaisesRegex(tessera.BadInput, "another wall"):
                    each()
            self.assertEqual((theirs.translation, ours.translation), ((0, 0, 0), (0, 0, 0)))
            self.assertNotIn("/box", self.wall)

    def test_threads_that_show_at_one_path_make_one_node(self):
        for round in range(5):
            ready, path = threading.Barrier(4), f"/shown-{round}"

            def show():
                ready.wait(PATIENCE)
                self.wall.show(np.eye(3), path)
            threads = [threading.Thread(target=show) for _ in range(4)]
            for each in threads:
                each.start()
            for each in threads:
                each.join(PATIENCE)
            self.assertEqual(len(self.wall.find(path)), 1)

    def test_the_numbers_of_nodes_cannot_be_changed(self):
        nodes = self.wall.nodes([self.wall.create("/fixed")])
        with self.assertRaises(ValueError):
            nodes.ids[0] = 1


class Collisions(OnAWall):
    options = {"surface": "none", "scene": ROOT / "tests/data/scenes/yard.tsct"}

    def test_what_collides_is_stopped_told_and_asked_about(self):
        wall = self.wall
        wall["/drive"].playing = False
        wall["/carriage"].translation = (-2, 0.5, 0)
        with wall.follow("contacts", timeout=PATIENCE) as contacts:
            done = wall["/carriage"].move((4, 0.5, 0))
            self.assertIn(wall["/carriage"].core.id, done.stopped)
            touching = next(told for told in contacts if len(told.contacts))
        self.assertEqual(touching.contacts["point"].shape[1], 3)
        self.assertLess(wall["/carriage"].translation[0], 2)
        self.assertGreater(len(wall.contacts()), 0)
        wall["/carriage"].translation = (-2, 0.5, 0)
        wall["/stop"].set(response="ask", patience=600)
        with wall.follow("questions", timeout=PATIENCE) as questions:
            wall["/carriage"].move((4, 0.5, 0))
            asked = next(told for told in questions if len(told.questions)).questions[0]
            self.assertEqual(wall.questions()["id"].tolist(), [asked["id"]])
            wall.respond(asked, "move", translation=(0, 0.5, 0))
            self.assertTrue(any(asked["id"] in told.closed for told in questions))
        self.assertEqual(wall["/carriage"].translation, (0.0, 0.5, 0.0))
        with self.assertRaises(tessera.Refused):
            wall.respond(asked, "pass")

    def test_motions_play_and_pause(self):
        drive = self.wall["/drive"]
        drive.pause()
        drive.seek(0.25)
        self.assertEqual((drive.playing, drive.time), (False, 0.25))
        drive.play()
        self.assertTrue(drive.playing)
        drive.pause()


if __name__ == "__main__":
    unittest.main()
