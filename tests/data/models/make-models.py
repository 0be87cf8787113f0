#!/usr/bin/env python3
"""Writes the models beside it: small ones of every format that readers count, made of formulas, so that tests of files
need no others.

    tests/data/models/make-models.py         # writes them anew, the same bytes each time
"""
import base64
import json
import math
import pathlib
import struct
import zlib

HERE = pathlib.Path(__file__).resolve().parent


def png(width, height, colour):
    """An 8-bit RGB picture; colour(x, y) is its pixel."""
    rows = b"".join(b"\0" + bytes(c for x in range(width) for c in colour(x, y)) for y in range(height))
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR",
                                        struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) + chunk(
                                            b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


class Gltf:
    """A file of one buffer, put together part by part."""
    KINDS = {"f": (5126, 4), "H": (5123, 2), "I": (5125, 4), "B": (5121, 1)}
    WIDTHS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}

    def __init__(self):
        self.bytes = b""
        self.json = {"asset": {"version": "2.0", "generator": "make-models.py"}, "scene": 0, "bufferViews": [],
                     "accessors": []}

    def view(self, body):
        self.bytes += b"\0" * (-len(self.bytes) % 4)
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(body)})
        self.bytes += body
        return len(self.json["bufferViews"]) - 1

    def accessor(self, rows, kind="f", bounds=False):
        rows = [row if isinstance(row, (list, tuple)) else (row,) for row in rows]
        code, _ = self.KINDS[kind]
        accessor = {"bufferView": self.view(b"".join(struct.pack("<%d%s" % (len(row), kind), *row) for row in rows)),
                    "componentType": code,
                    "count": len(rows), "type": self.WIDTHS[len(rows[0])]}
        if bounds:
            exact = [struct.unpack("<%df" % len(row), struct.pack("<%df" % len(row), *row)) for row in rows]
            accessor["min"] = [min(c) for c in zip(*exact)]
            accessor["max"] = [max(c) for c in zip(*exact)]
        self.json["accessors"].append(accessor)
        return len(self.json["accessors"]) - 1

    def write_glb(self, name):
        self.json["buffers"] = [{"byteLength": len(self.bytes)}]
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        body = self.bytes + b"\0" * (-len(self.bytes) % 4)
        (HERE / name).write_bytes(b"glTF" + struct.pack("<II", 2,
                                                        12 + 8 + len(text) + 8 + len(body)) + struct.pack(
                                                            "<I", len(text)) + b"JSON" + text +
                                  struct.pack("<I", len(body)) + b"BIN\0" + body)

    def write_gltf(self, name, beside):
        (HERE / beside).write_bytes(self.bytes)
        self.json["buffers"] = [{"byteLength": len(self.bytes), "uri": beside}]
        (HERE / name).write_text(json.dumps(self.json, indent=1) + "\n")


def turn(axis, angle):
    return [math.sin(angle / 2) * c for c in axis] + [math.cos(angle / 2)]


def arm():
    """A tube on three joints that bends, and a plate beside it that swells."""
    g = Gltf()
    sides, rings = 10, 13
    positions, normals, joints, weights, triangles = [], [], [], [], []
    for r in range(rings):
        height = 2.0 * r / (rings - 1)
        for s in range(sides):
            a = 2 * math.pi * s / sides
            positions.append((0.2 * math.cos(a), height, 0.2 * math.sin(a)))
            normals.append((math.cos(a), 0.0, math.sin(a)))
            share = max(0.0, min(1.0, height - math.floor(height))) if height < 2 else 1.0
            first = min(int(height), 1)
            joints.append((first, first + 1, 0, 0))
            weights.append((1 - share, share, 0.0, 0.0))
            if r + 1 < rings:
                at, beside = r * sides + s, r * sides + (s + 1) % sides
                triangles += [at, at + sides, beside, beside, at + sides, beside + sides]
    binds = [[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -float(j), 0, 1] for j in range(3)]
    plate = [(x - 0.5, 0.0, y - 0.5) for y in (0, 0.5, 1) for x in (0, 0.5, 1)]
    swollen = [(0.0, 0.5 * (1 - abs(2 * x)) * (1 - abs(2 * z)), 0.0) for x, _, z in plate]
    turned = [(0.3 * z, 0.0, -0.3 * x) for x, _, z in plate]
    faces = [i for y in range(2) for x in range(2)
             for i in (3 * y + x, 3 * y + x + 3, 3 * y + x + 1, 3 * y + x + 1, 3 * y + x + 3, 3 * y + x + 4)]
    g.json["materials"] = [{"name": "hide",
                            "pbrMetallicRoughness": {"baseColorFactor": [0.7, 0.5, 0.3, 1], "metallicFactor": 0}}]
    g.json["meshes"] = [
        {"name": "tube", "primitives": [{"attributes": {"POSITION": g.accessor(positions, bounds=True),
                                                        "NORMAL": g.accessor(normals),
                                                        "JOINTS_0": g.accessor(joints, "B"),
                                                        "WEIGHTS_0": g.accessor(weights)}, "indices": g.accessor(
                                                            triangles, "H"), "material": 0}]},
        {"name": "plate", "weights": [0, 0],
         "primitives": [{"attributes": {"POSITION": g.accessor(plate, bounds=True)}, "indices": g.accessor(faces, "H"),
                         "material": 0,
                         "targets": [{"POSITION": g.accessor(swollen, bounds=True)},
                                     {"POSITION": g.accessor(turned, bounds=True)}]}]}]
    g.json["skins"] = [{"joints": [1, 2, 3], "inverseBindMatrices": g.accessor(binds)}]
    g.json["nodes"] = [{"name": "tube", "mesh": 0, "skin": 0}, {"name": "shoulder", "children": [2]},
                       {"name": "elbow", "translation": [0, 1, 0], "children": [3]},
                       {"name": "hand", "translation": [0, 1, 0]},
                       {"name": "plate", "mesh": 1, "translation": [1.5, 0, 0]}]
    g.json["scenes"] = [{"nodes": [0, 1, 4]}]
    # Between frames, so that it does not matter on which side of one a step is
    times = g.accessor([0, 0.51, 1.26, 2], bounds=True)
    samplers, channels = [], []

    def play(node, path, rows, kind="LINEAR"):
        channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
        samplers.append({"input": times, "output": g.accessor(rows), "interpolation": kind})
    play(1, "rotation", [turn((0, 0, 1), a) for a in (0, 0.6, -0.4, 0)])
    play(2, "rotation", [turn((1, 0, 0), a) for a in (0, 1.1, 0.3, 0)])
    flat = [(0, 0, 0)]
    play(1, "translation", [row for key in ((0, 0, 0), (0, 0.3, 0.1), (0.2, 0.1, 0), (0, 0, 0))
                            for row in flat + [key] + flat], "CUBICSPLINE")
    play(3, "scale", [(1, 1, 1), (1.5, 0.7, 1), (1, 1, 1.2), (1, 1, 1)], "STEP")
    play(4, "weights", [w for key in ((0, 0), (1, 0), (0.4, 1), (0, 0)) for w in key])
    g.json["animations"] = [{"name": "wave", "samplers": samplers, "channels": channels}]
    g.write_glb("arm.glb")


def stall():
    """Materials, pictures, two sets of texture coordinates, colours, lines, points, lamps and a camera."""
    g = Gltf()
    corners = [(-1, 0, 0), (1, 0, 0), (1, 1, 0), (-1, 1, 0)]
    squares = [(0, 0), (2, 0), (2, 1), (0, 1)]
    small = [(0, 0), (0.5, 0), (0.5, 0.5), (0, 0.5)]
    colours = [(1, 0, 0, 1), (0, 1, 0, 1), (0, 0, 1, 1), (1, 1, 1, 0.5)]
    position, texcoord, second, colour = g.accessor(corners,
                                                    bounds=True), g.accessor(squares), g.accessor(small), g.accessor(
                                                        colours)
    square = g.accessor([0, 1, 2, 0, 2, 3], "H")
    checks = png(16, 16, lambda x, y: (230, 220, 200) if (x // 4 + y // 4) % 2 else (40, 60, 90))
    grey = png(8, 8, lambda x, y: (0, 32 * x, 255 - 32 * y))
    (HERE / "checks.png").write_bytes(checks)
    g.json["images"] = [{"uri": "checks.png"}, {"bufferView": g.view(grey), "mimeType": "image/png"},
                        {"uri": "data:image/png;base64," + base64.b64encode(grey).decode()}]
    g.json["samplers"] = [{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728, "minFilter": 9984}, {}]
    g.json["textures"] = [{"source": 0, "sampler": 0}, {"source": 1, "sampler": 1}, {"source": 2}]
    g.json["materials"] = [
        {"name": "awning", "doubleSided": True, "alphaMode": "MASK", "alphaCutoff": 0.25,
         "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1,
                                                       "extensions": {
                                                           "KHR_texture_transform": {
                                                               "offset": [0.25, 0], "scale": [2, 1], "rotation": 0.5}}},
                                  "metallicRoughnessTexture": {"index": 1}},
         "normalTexture": {"index": 2, "scale": 0.5}, "occlusionTexture": {"index": 1, "strength": 0.75},
         "emissiveFactor": [0.1, 0, 0]},
        {"name": "lacquer", "alphaMode": "BLEND",
         "pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.9, 0.6], "roughnessFactor": 0.3},
         "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 0.8, "clearcoatRoughnessFactor": 0.2},
                        "KHR_materials_ior": {"ior": 1.4}}},
        {"name": "sign", "pbrMetallicRoughness": {"baseColorFactor": [1, 0.9, 0.2, 1]},
         "extensions": {"KHR_materials_unlit": {}}}]
    line = g.accessor([(math.cos(a), 1.2, math.sin(a)) for a in (0.0, 1.5, 3.0, 4.5)], bounds=True)
    dots = g.accessor([(0.1 * i, 1.5, 0.05 * i * i) for i in range(7)], bounds=True)
    g.json["meshes"] = [
        {"name": "roof", "primitives": [{"attributes": {"POSITION": position, "TEXCOORD_0": texcoord,
                                                        "TEXCOORD_1": second}, "indices": square, "material": 0},
                                        {"attributes": {"POSITION": position, "COLOR_0": colour}, "indices": square,
                                         "material": 1}]},
        {"name": "band", "primitives": [{"attributes": {"POSITION": position}, "mode": 5, "material": 2},
                                        {"attributes": {"POSITION": position}, "mode": 6, "material": 2}]},
        {"name": "cords", "primitives": [{"attributes": {"POSITION": line}, "mode": 3},
                                         {"attributes": {"POSITION": line}, "mode": 2},
                                         {"attributes": {"POSITION": line}, "mode": 1}]},
        {"name": "lamps", "primitives": [{"attributes": {"POSITION": dots}, "mode": 0}]}]
    g.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.1}}]
    g.json["extensionsUsed"] = ["KHR_lights_punctual", "KHR_texture_transform", "KHR_materials_clearcoat",
                                "KHR_materials_ior", "KHR_materials_unlit"]
    g.json["extensions"] = {"KHR_lights_punctual": {
        "lights": [{"type": "point", "intensity": 20}, {"type": "directional", "color": [1, 0.9, 0.8]},
                   {"type": "spot", "spot": {"outerConeAngle": 0.5}}]}}
    lamp = lambda i, at: {"translation": at, "extensions": {"KHR_lights_punctual": {"light": i}}}
    g.json["nodes"] = [{"name": "stall", "children": [1, 2, 3, 4, 5]},
                       {"name": "roof", "mesh": 0, "translation": [0, 1, 0]},
                       {"name": "front", "mesh": 1, "scale": [1, -1, 1]},
                       {"name": "back", "mesh": 1, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0.25, 1, 0, 0, 0, -1, 1]},
                       {"name": "cords", "mesh": 2}, {"name": "lamps", "mesh": 3},
                       {"name": "eye", "camera": 0, "translation": [0, 1, 4]}, lamp(0, [0, 2, 1]), lamp(1, [0, 3, 0]),
                       lamp(2, [1, 2, 2])]
    g.json["scenes"] = [{"name": "market", "nodes": [0, 6, 7, 8, 9]}]
    g.write_gltf("stall.gltf", "stall.bin")


def revolved(profile, sides):
    """Vertices and quads of a profile (radius, height) about Y."""
    vertices = [(r * math.cos(2 * math.pi * s / sides), h, r * math.sin(2 * math.pi * s / sides)) for r, h in profile
                for s in range(sides)]
    quads = [(p * sides + s, (p + 1) * sides + s, (p + 1) * sides + (s + 1) % sides, p * sides + (s + 1) % sides)
             for p in range(len(profile) - 1) for s in range(sides)]
    return vertices, quads


def bench():
    """An OBJ: groups, a library, numbers forwards and backwards, polygons, lines and points."""
    (HERE / "bench.mtl").write_text("newmtl oak\nKd 0.6 0.4 0.2\nKs 0.2 0.2 0.2\nNs 30\nmap_Kd checks.png\n\nnewmtl "
                                    "iron\nKd 0.3 0.3 0.35\nd 0.9\nillum 2\n")
    vertices, quads = revolved([(0.3, 0), (0.35, 0.2), (0.2, 0.5), (0.4, 0.6)], 12)
    out = ["# made by make-models.py", "mtllib bench.mtl", "o stool"]
    out += ["v %.6g %.6g %.6g" % v for v in vertices]
    out += ["vt %.6g %.6g" % (i / 12, j / 3) for j in range(4) for i in range(12)]
    out += ["g side", "usemtl oak"]
    out += ["f " + " ".join("%d/%d" % (i + 1, i + 1) for i in quad) for quad in quads]
    out += ["g lid", "usemtl iron", "f " + " ".join(str(i - 12) for i in reversed(range(12)))]
    out += ["g foot", "f " + " ".join(str(i + 1) for i in range(12))]
    out += ["g marks", "v 1 0 0", "v 1 1 0", "v 1 1 1", "v 2 1 1", "l -4 -3 -2 -1", "l 49 52", "p 49 50"]
    (HERE / "bench.obj").write_text("\n".join(out) + "\n")


def vane():
    """An OFF: triangles, squares and a star that is not convex."""
    star = [((0.4 if i % 2 else 1.0) * math.cos(math.pi * i / 5), (0.4 if i % 2 else 1.0) * math.sin(math.pi * i / 5),
             0.0) for i in range(10)]
    box = [(x, y, 0.5 + z) for x in (-0.2, 0.2) for y in (-0.2, 0.2) for z in (0, 0.4)]
    faces = [tuple(range(8))] + [tuple(10 + i for i in f)
                                 for f in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6))] + [
                                     (10, 12, 16), (10, 16, 14), (11, 15, 17), (11, 17, 13)]
    out = ["OFF", "%d %d 0" % (len(star) + len(box), len(faces))]
    out += ["%.6g %.6g %.6g" % v for v in star + box]
    out += [" ".join(map(str, (len(f),) + f)) for f in faces]
    (HERE / "vane.off").write_text("\n".join(out) + "\n")


def shell():
    """PLYs: a binary one with colours and normals, and points in text."""
    vertices, quads = revolved([(0.05 + 0.4 * math.sin(0.25 * i), 0.1 * i) for i in range(12)], 24)
    head = ("ply\nformat binary_little_endian 1.0\ncomment made by make-models.py\nelement vertex %d\nproperty float "
            "x\nproperty float y\nproperty float z\n"
            "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face %d\nproperty list uchar int "
            "vertex_indices\nend_header\n")
    body = b"".join(struct.pack("<fffBBB", *v, int(255 * v[1] / 1.2), 120, 200) for v in vertices)
    body += b"".join(struct.pack("<Biiii", 4, *q) for q in quads)
    (HERE / "shell.ply").write_bytes((head % (len(vertices), len(quads))).encode() + body)
    dots = [(math.cos(0.4 * i) * 0.01 * i, 0.02 * i, math.sin(0.4 * i) * 0.01 * i) for i in range(120)]
    (HERE / "swarm.ply").write_text("ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float "
                                    "y\nproperty float z\nend_header\n" % len(dots) +
                                    "".join("%.6g %.6g %.6g\n" % d for d in dots))


def wedge():
    """STLs, in text and binary."""
    def normal(a, b, c):
        u, v = [b[i] - a[i] for i in range(3)], [c[i] - a[i] for i in range(3)]
        n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        length = math.sqrt(sum(x * x for x in n))
        return tuple(x / length for x in n)
    p = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0), (0, 0, 1), (0, 1, 1)]
    triangles = [(p[a], p[b], p[c])
                 for a, b, c in ((0, 2, 1), (0, 3, 2), (0, 1, 4), (3, 5, 2), (0, 4, 5), (0, 5, 3), (1, 2, 5),
                                 (1, 5, 4))]
    out = ["solid wedge"]
    for t in triangles:
        out += ["facet normal %.6g %.6g %.6g" % normal(*t),
                "outer loop"] + ["vertex %g %g %g" % v for v in t] + ["endloop", "endfacet"]
    (HERE / "wedge.stl").write_text("\n".join(out + ["endsolid wedge"]) + "\n")
    vertices, quads = revolved([(1.0, 0), (1.2, 0.1), (1.2, 0.3), (1.0, 0.4), (1.0, 0)], 36)
    rim = [(vertices[q[i]], vertices[q[j]], vertices[q[k]]) for q in quads for i, j, k in ((0, 1, 2), (0, 2, 3))]
    (HERE / "rim.stl").write_bytes(b"made by make-models.py".ljust(80, b"\0") + struct.pack("<I", len(rim)) +
                                   b"".join(struct.pack("<12fH", *normal(*t), *[c for v in t for c in v], 0)
                                            for t in rim))


def sunlit():
    """A glTF of physical light: balls and a bench in the sun, which is of 80,000 lx, and a lamp of 900 cd."""
    g = Gltf()

    def stored(vertices, normals, faces):
        return {"attributes": {"POSITION": g.accessor(vertices, bounds=True), "NORMAL": g.accessor(normals)},
                "indices": g.accessor([i for face in faces for i in face], "H")}

    def ball(radius, sides):
        ups = [math.pi * (i / sides - 0.5) for i in range(sides + 1)]
        around = [2 * math.pi * j / (2 * sides) for j in range(2 * sides)]
        normals = [(math.cos(a) * math.cos(b), math.sin(a), math.cos(a) * math.sin(b)) for a in ups for b in around]
        quads = [(i * 2 * sides + j, (i + 1) * 2 * sides + j, (i + 1) * 2 * sides + (j + 1) % (2 * sides),
                  i * 2 * sides + (j + 1) % (2 * sides)) for i in range(sides) for j in range(2 * sides)]
        return ([tuple(radius * c for c in n) for n in normals], normals,
                [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])

    def box(x, y, z):
        vertices, normals, faces = [], [], []
        for axis, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
            for sign in (1, -1):
                first = len(vertices)
                for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                    corner = [0.0, 0.0, 0.0]
                    corner[axis], corner[i], corner[j] = float(sign), a * float(sign), float(b)
                    vertices.append((corner[0] * x, corner[1] * y, corner[2] * z))
                    normals.append(tuple(float(sign) if k == axis else 0.0 for k in range(3)))
                faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
        return vertices, normals, faces

    looks = [((0.6, 0.58, 0.55), 0, 0.9), ((0.7, 0.2, 0.12), 0, 0.4), ((0.9, 0.75, 0.4), 1, 0.35),
             ((0.1, 0.25, 0.6), 0, 0.6), ((0.9, 0.9, 0.88), 0, 0.8)]
    g.json["materials"] = [{"pbrMetallicRoughness": {"baseColorFactor": [*colour, 1], "metallicFactor": metal,
                                                     "roughnessFactor": rough}} for colour, metal, rough in looks]
    bench, round_ = stored(*box(2.4, 0.05, 1.4)), stored(*ball(0.4, 16))
    g.json["meshes"] = [{"primitives": [{**(round_ if i else bench), "material": i}]} for i in range(5)]
    g.json["extensionsUsed"] = ["KHR_lights_punctual"]
    g.json["extensions"] = {"KHR_lights_punctual": {"lights": [
        {"type": "directional", "intensity": 80000, "color": [1, 0.96, 0.9]},
        {"type": "point", "intensity": 900, "color": [1, 0.7, 0.4]}]}}
    g.json["nodes"] = ([{"name": "bench", "mesh": 0}] +
                       [{"name": "ball %d" % i, "mesh": i + 1, "translation": [1.0 * i - 1.5, 0.45, 0]}
                        for i in range(4)] +
                       [{"name": "sun", "rotation": turn((0.8, 0.6, 0), -0.9),
                         "extensions": {"KHR_lights_punctual": {"light": 0}}},
                        {"name": "lamp", "translation": [0, 1.2, 0.8],
                         "extensions": {"KHR_lights_punctual": {"light": 1}}}])
    g.json["scenes"] = [{"nodes": list(range(len(g.json["nodes"])))}]
    g.write_glb("sunlit.glb")


for make in (arm, stall, bench, vane, shell, wedge, sunlit):
    make()
