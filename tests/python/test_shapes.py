"""What `wall.show` takes: objects laid out as trimesh, pyvista and open3d document theirs, none of which is required;
and pictures."""
import types
import unittest

import numpy as np

import tessera
from live import PATIENCE, ROOT, Live
from tessera import _picture, colours
from tessera.shapes import shape_of

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])
RED_TO_BLUE = np.array([[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 255, 255]], np.uint8)


class Trimesh:
    """trimesh.Trimesh: vertices (n, 3) float64, faces (m, 3) int64, visual.kind, visual.vertex_colors (n, 4) uint8,
    visual.face_colors."""

    def __init__(self, kind=None):
        self.vertices, self.faces = VERTICES.view(), TRIANGLES.view()
        self.visual = types.SimpleNamespace(kind=kind, vertex_colors=RED_TO_BLUE, face_colors=RED_TO_BLUE[:2])


class PyvistaPolyData:
    """pyvista.PolyData: points (n, 3) float32, faces packed [n, i, j, k, …], lines packed; regular_faces raises where
    they differ."""

    def __init__(self, faces=(), lines=()):
        self.points, self.faces, self.lines = VERTICES.astype(np.float32), np.array(faces, np.int64), np.array(
            lines, np.int64)

    @property
    def regular_faces(self):
        raise ValueError("faces are not regular")


class Vector3d(list):
    """open3d.utility.Vector3dVector and Vector3iVector: sequences that numpy takes."""


class Open3dMesh:
    def __init__(self):
        self.vertices, self.triangles = Vector3d(VERTICES.tolist()), Vector3d(TRIANGLES.tolist())
        self.vertex_colors = Vector3d((RED_TO_BLUE[:, :3] / 255).tolist())


class Open3dCloud:
    def __init__(self):
        self.points, self.colors = Vector3d(VERTICES.tolist()), Vector3d((RED_TO_BLUE[:, :3] / 255).tolist())


class Shapes(unittest.TestCase):
    def test_trimesh(self):
        shape = shape_of(Trimesh())
        self.assertEqual((shape.primitive, shape.positions.dtype, shape.indices.dtype),
                         ("triangles", np.float32, np.uint32))
        self.assertTrue(np.array_equal(shape.indices, TRIANGLES))
        self.assertTrue(np.array_equal(shape_of(Trimesh("vertex")).colours, RED_TO_BLUE))
        self.assertIsNone(shape_of(Trimesh("texture")).colours)
        painted = shape_of(Trimesh("face"))
        self.assertEqual((len(painted.positions), painted.indices), (6, None))
        self.assertTrue(np.array_equal(painted.colours, np.repeat(RED_TO_BLUE[:2], 3, 0)))

    def test_pyvista(self):
        shape = shape_of(PyvistaPolyData([3, 0, 1, 2, 3, 0, 2, 3]))
        self.assertEqual(shape.primitive, "triangles")
        self.assertTrue(np.array_equal(shape.indices, TRIANGLES))
        quad = shape_of(PyvistaPolyData([4, 0, 1, 2, 3]))
        self.assertEqual((quad.primitive, quad.lengths.tolist(), quad.indices.reshape(-1).tolist()),
                         ("polygons", [4], [0, 1, 2, 3]))
        mixed = shape_of(PyvistaPolyData([3, 0, 1, 2, 4, 0, 1, 2, 3]))
        self.assertEqual((mixed.lengths.tolist(), mixed.indices.tolist()), ([3, 4], [0, 1, 2, 0, 1, 2, 3]))
        self.assertEqual(shape_of(PyvistaPolyData()).primitive, "points")
        line = shape_of(PyvistaPolyData(lines=[2, 0, 1, 3, 1, 2, 3]))
        self.assertEqual((line.primitive, line.lengths.tolist(), line.indices.tolist()),
                         ("line-strips", [2, 3], [0, 1, 1, 2, 3]))

    def test_open3d(self):
        mesh = shape_of(Open3dMesh())
        self.assertTrue(np.array_equal(mesh.indices, TRIANGLES) and np.array_equal(mesh.colours, RED_TO_BLUE))
        cloud = shape_of(Open3dCloud())
        self.assertEqual(cloud.primitive, "points")
        self.assertTrue(np.array_equal(cloud.colours, RED_TO_BLUE))

    def test_arrays_alone(self):
        self.assertEqual(shape_of((VERTICES, TRIANGLES)).primitive, "triangles")
        self.assertEqual(shape_of(VERTICES).primitive, "points")
        points = np.zeros((10, 3), np.float32)
        self.assertTrue(np.shares_memory(shape_of(points).positions, points))

    def test_what_makes_no_sense_is_named(self):
        for x, what in ((5, "a int has neither vertices and faces nor points"),
                        (np.zeros((3, 2)), r"points: an array of shape \(3, 2\)"),
                        ((VERTICES, [[0, 1, 9]]), "a face names vertex 9, and there are 4"),
                        ((VERTICES, [[0, -1, 2]]), "a face names vertex -1"),
                        ((VERTICES, [[0.5, 1, 2]]), "faces of float64"), (np.full((2, 3), np.nan), "is not finite"),
                        (PyvistaPolyData([3, 0, 1]), "packed faces end in the middle"),
                        (np.array([["a", "b", "c"]]), "places are N × 3 numbers"),
                        ([[0, 0, 0], [1, 1]], "points: .*inhomogeneous"),
                        ((VERTICES, [[0, 1, 2], [0, 1]]), "faces: .*inhomogeneous"),
                        (([[0, 0, 0], [1]], TRIANGLES), "vertices: .*inhomogeneous")):
            with self.subTest(what=what), self.assertRaisesRegex(tessera.BadInput, what):
                shape_of(x)

    def test_masked_values_are_not_shown(self):
        whole = np.ma.array(VERTICES, mask=False)
        self.assertEqual(shape_of(whole).positions.shape, (4, 3))
        for given in (np.ma.array(VERTICES, mask=VERTICES > 0.5),
                      (np.ma.array(VERTICES, mask=VERTICES > 0.5), TRIANGLES)):
            with self.assertRaisesRegex(tessera.BadInput, "values are masked"):
                shape_of(given)
        with self.assertRaisesRegex(tessera.BadInput, "scalars: 1 values are masked"):
            colours.of_scalars(np.ma.array([1.0, 2.0], mask=[False, True]))

    def test_numbers_become_colours(self):
        shades = colours.of_scalars([0, 0.5, 1, np.nan])
        self.assertEqual(shades[0].tolist(), [0x44, 0x01, 0x54, 255])
        self.assertEqual(shades[2].tolist(), [0xFD, 0xE7, 0x25, 255])
        self.assertEqual(shades[3].tolist(), [128, 128, 128, 255])
        self.assertEqual(colours.of_scalars([5, 5, 5]).shape, (3, 4))
        self.assertAlmostEqual(colours.of_scalars([0, 10], "grey", (0, 20))[1, 0], 128, delta=1)
        with self.assertRaisesRegex(tessera.BadInput, "is it viridis"):
            colours.of_scalars([1], "viridid")
        self.assertEqual(colours.linear("#ffffff"), (1.0, 1.0, 1.0, 1.0))
        for given, what in (([[0, 0, np.nan]], "not all colours are finite"),
                            ([["red", "", ""]], "is no type of numbers"), ([[0, 0, 300]], "from 0 to 255"),
                            ([[0, 0, 0], [1]], "colors: .*inhomogeneous")):
            with self.subTest(what=what), self.assertRaisesRegex(tessera.BadInput, what):
                colours.of_any(given, 1, "colors")
        for given in ((0, 0, np.nan), "#12", (1, 2), ("a", "b", "c"), 5):
            with self.subTest(color=given), self.assertRaises(tessera.BadInput):
                colours.linear(given)


class Pictures(unittest.TestCase):
    def test_png_comes_back_whatever_filters_it_has(self):
        pixels = np.random.default_rng(1).integers(0, 255, (33, 17, 3), np.uint8)
        self.assertTrue(np.array_equal(_picture.decode_png(memoryview(_picture.encode_png(pixels))), pixels))
        rows = pixels.copy()
        filters = np.arange(33, dtype=np.uint8) % 5
        for at, kind in enumerate(filters):
            for x in range(17):
                left, up = (pixels[at, x - 1] if x else 0), (pixels[at - 1, x] if at else 0)
                corner = pixels[at - 1, x - 1] if x and at else 0
                left, up, corner = (np.zeros(3, int) + each for each in (left, up, corner))
                estimate = left + up - corner
                a, b, c = abs(estimate - left), abs(estimate - up), abs(estimate - corner)
                paeth = np.where((a <= b) & (a <= c), left, np.where(b <= c, up, corner))
                rows[at, x] = (pixels[at, x] - (0, left, up, (left + up) // 2, paeth)[kind]) & 255
        self.assertTrue(np.array_equal(_picture._unfiltered(filters, rows), pixels))

    def test_rubbish_is_no_picture(self):
        whole = _picture.encode_png(np.zeros((4, 4, 3), np.uint8))
        for data in (b"", b"GIF89a", whole[:20]):
            with self.assertRaises(tessera.BadInput):
                _picture.decode_png(memoryview(data))


class OnTheWall(unittest.TestCase):
    """Three tiles with overlaps, drawn in memory."""

    @classmethod
    def setUpClass(cls):
        cls.live = cls.enterClassContext(Live("3x1-bezels", surface="osmesa", size="192x108"))
        cls.wall = cls.enterClassContext(cls.live.connect())
        cls.wall["/drive"].playing = False

    def test_the_picture_is_the_one_of_tessera_ctl(self):
        file = self.live.folder / "wall.png"
        done = self.live.run("tessera-ctl", "--server", self.live.address, "--timeout", "30000", "snapshot", str(file))
        self.assertEqual(done.returncode, 0, done.stderr)
        mine = self.wall.image()
        self.assertEqual((mine.shape, mine.dtype), ((108, 192, 3), np.uint8))
        self.assertTrue(np.array_equal(mine, _picture.decode_png(memoryview(file.read_bytes()))))
        self.assertEqual(self.wall._repr_png_()[:8], b"\x89PNG\r\n\x1a\n")

    def test_a_picture_is_not_older_than_the_last_edit(self):
        self.wall.show((VERTICES * 100 - [50, 50, 20], TRIANGLES), "/screen", color="#ff0000", unlit=True)
        for shade, channel in (("#00ff00", 1), ("#0000ff", 2), ("#ff0000", 0)):
            self.wall.show((VERTICES * 100 - [50, 50, 20], TRIANGLES), "/screen", color=shade, unlit=True)
            upper = self.wall.image()[:20].reshape(-1, 3)
            self.assertGreater((upper.argmax(1) == channel).mean(), 0.9, shade)
        self.wall.remove("/screen")

    def test_whatever_has_vertices_is_shown_and_replaced(self):
        for x in (Trimesh("vertex"), PyvistaPolyData([4, 0, 1, 2, 3]), Open3dMesh(), Open3dCloud(),
                  (VERTICES, TRIANGLES), VERTICES):
            with self.subTest(x=type(x).__name__):
                node = self.wall.show(x, at=(0, 1, -1), radius=0.05)
                shape = node / "shape"
                self.assertTrue(np.array_equal(shape.positions, VERTICES.astype(np.float32)))
                again = self.wall.show(VERTICES + 1, node.path, scalars=[0, 1, 2, 3])
                self.assertEqual((again.id, again.translation, shape.primitive), (node.id, (0.0, 1.0, -1.0), "points"))
                self.assertTrue(np.array_equal(shape.colors.reshape(-1, 4), colours.of_scalars([0, 1, 2, 3])))
                node.remove()
        with self.assertRaisesRegex(tessera.BadInput, "3 numbers for 4 vertices"):
            self.wall.show(VERTICES, scalars=[1, 2, 3])
        for path in ("//x", "", "/", "cloud", "/a//b"):
            with self.subTest(path=path), self.assertRaisesRegex(tessera.BadInput, "no path to show anything at"):
                self.wall.show(VERTICES, path)
        with self.assertRaises(tessera.BadInput):
            self.wall.show(VERTICES, "/often", color="#ff0000", at=5)
        for _ in range(2):  # somebody removes it; an edit that shows it is refused
            shown = self.wall.show(VERTICES, "/often")
            self.assertTrue(np.array_equal((shown / "shape").positions, VERTICES.astype(np.float32)))
            self.wall.remove("/often")
            with self.assertRaises(tessera.Refused), self.wall.edit():
                self.wall.show(VERTICES, "/often")
                self.wall.remove("/row")
        for removed in ("/often/shape", "/often"):
            self.wall.show(VERTICES, "/often")
            self.wall.show(VERTICES, "/often")
            self.wall.remove(removed)
            self.assertEqual([child.name for child in self.wall.show(VERTICES, "/often").children], ["shape"])
        with self.wall.edit():
            self.wall.show(VERTICES, "/often")
            twice = self.wall.show(VERTICES + 1, "/often", color="#00ff00")
        self.assertTrue(np.array_equal((twice / "shape").positions, VERTICES.astype(np.float32) + 1))
        twice.children[0].material = None
        again = self.wall.show(VERTICES + 2, "/often", color="#0000ff")
        self.assertEqual((again.id, (again / "shape").material.baseColor), (twice.id, (0.0, 0.0, 1.0, 1.0)))
        with self.assertRaisesRegex(tessera.BadInput, "something that show has not made|holds"):
            self.wall.create("/taken", "PointLight")
            self.wall.create("/taken/shape", "Geometry")
            self.wall.show(VERTICES, "/taken")


class Layouts(unittest.TestCase):
    def test_every_shipped_wall_is_laid_out_as_tessera_ctl_does(self):
        # With nobody drawing there is no picture; the sizes are those that walls say of themselves.
        for name, size in (("2x2", None), ("cave4-stereo", None), ("curved-9x2", None), ("powerwall-4k-2x3", None)):
            with self.subTest(wall=name), Live(name) as live, live.connect() as wall:
                width, height, tiles = _picture.layout_of(wall._link.configuration)
                self.assertGreater(width * height, 0)
                for tile in tiles:
                    self.assertTrue(0 <= tile.left and tile.left + tile.width <= width and 0 <= tile.top
                                    and tile.top + tile.height <= height, tile)


if __name__ == "__main__":
    unittest.main()
