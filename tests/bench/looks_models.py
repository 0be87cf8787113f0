"""Models of our own for looks.py: one .glb for each glTF extension that the importer reads, some of plain glTF 2.0.

Written anew at each run, of numbers alone: `write_models(folder)`. Units are metres; each model lies within some three
metres of its origin and faces +Z."""
import json
import math
import struct
import zlib

import numpy as np

FLOAT, UBYTE, BYTE, USHORT, SHORT, UINT = 5126, 5121, 5120, 5123, 5122, 5125
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
COMPONENTS = {FLOAT: np.float32, UBYTE: np.uint8, BYTE: np.int8, USHORT: np.uint16, SHORT: np.int16, UINT: np.uint32}


def png(pixels):
    """Of height × width × 3 or 4 (uint8); rows are not filtered."""
    height, width, channels = pixels.shape
    rows = np.zeros((height, 1 + width * channels), np.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 6 if channels == 4 else 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) +
            chunk(b"IEND", b""))


def dds(pixels):
    """Of height × width × 4 (uint8): without compression, one level (Microsoft's DDS_HEADER, 32 bits of RGBA)."""
    height, width, _ = pixels.shape
    head = struct.pack("<4sIIIIIII44x", b"DDS ", 124, 0x100F, height, width, 4 * width, 0, 1)
    head += struct.pack("<II4sIIIII", 32, 0x41, b"\0\0\0\0", 32, 0xFF, 0xFF00, 0xFF0000, 0xFF000000)
    return head + struct.pack("<IIIII", 0x1000, 0, 0, 0, 0) + pixels.tobytes()


def webp(pixels):
    """Of height × width × 4 (uint8): WebP without loss ("WebP Lossless Bitstream Specification"). All codes are
    of eight bits, so it is as long as without compression."""
    height, width, _ = pixels.shape
    bits = []

    def number(value, count):  # the lowest bit first
        bits.extend((value >> at) & 1 for at in range(count))

    number(0x2F, 8)
    number(width - 1, 14)
    number(height - 1, 14)
    number(1, 1)  # alpha counts
    number(0, 3 + 3)  # version 0; no transform, no cache of colours, one group of codes
    for symbols in (256 + 24, 256, 256, 256):  # green with lengths, red, blue, alpha
        number(0, 1)
        # Twelve lengths of codes of lengths, in the specification's order: of 0, the third, and 8, the last, one bit.
        number(12 - 4, 4)
        for at in range(12):
            number(1 if at in (2, 11) else 0, 3)
        number(0, 1)  # as many symbols as there are
        bits.extend([1] * 256 + [0] * (symbols - 256))
    number(0b001, 4)  # distances: one symbol, 0
    codes = np.unpackbits(pixels[:, :, [1, 0, 2, 3]].reshape(-1, 4), axis=1).ravel()
    data = np.packbits(np.concatenate([np.array(bits, np.uint8), codes]), bitorder="little").tobytes()
    padded = data + b"\0" * (len(data) % 2)
    return struct.pack("<4sI4s4sI", b"RIFF", 12 + len(padded), b"WEBP", b"VP8L", len(data)) + padded


class Model:
    """A glTF document that grows, with one buffer."""

    def __init__(self):
        self.bytes = bytearray()
        self.json = {"asset": {"version": "2.0", "generator": "tests/bench/looks_models.py"}, "scene": 0,
                     "scenes": [{"nodes": []}], "nodes": [], "meshes": [], "materials": [], "accessors": [],
                     "bufferViews": []}

    def _add(self, what, thing):
        self.json.setdefault(what, []).append(thing)
        return len(self.json[what]) - 1

    def use(self, extension, required=False):
        for list_of in ["extensionsUsed"] + ["extensionsRequired"] * required:
            names = self.json.setdefault(list_of, [])
            if extension not in names:
                names.append(extension)

    def view(self, data, stride=0):
        self.bytes += b"\0" * (-len(self.bytes) % 4)
        view = {"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)}
        if stride:
            view["byteStride"] = stride
        self.bytes += data
        return self._add("bufferViews", view)

    def accessor(self, values, component=FLOAT, normalized=False):
        """Rows are padded to four bytes, as vertex attributes have to be."""
        values = np.asarray(values).astype(COMPONENTS[component])
        values = values.reshape(len(values), -1)
        width = values.shape[1] * values.itemsize
        stride = width + -width % 4 if component != UINT else width
        rows = np.zeros((len(values), stride), np.uint8)
        rows[:, :width] = np.ascontiguousarray(values).view(np.uint8).reshape(len(values), width)
        said = {"bufferView": self.view(rows.tobytes(), stride if stride != width else 0), "componentType": component,
                "count": len(values), "type": TYPES[values.shape[1]], "min": values.min(axis=0).tolist(),
                "max": values.max(axis=0).tolist()}
        if normalized:
            said["normalized"] = True
        return self._add("accessors", said)

    def mesh(self, shape, **attributes):
        """`shape`: positions, normals, texture coordinates, indices; more attributes are accessors by their names."""
        positions, normals, texcoords, indices = shape
        said = {"POSITION": self.accessor(positions), "NORMAL": self.accessor(normals),
                "TEXCOORD_0": self.accessor(texcoords), **attributes}
        return said, self.accessor(indices, UINT)

    def material(self, **said):
        for name in said.get("extensions", {}):
            self.use(name)
        return self._add("materials", said)

    def place(self, mesh, material, at=(0, 0, 0), **said):
        attributes, indices = mesh
        number = self._add("meshes", {"primitives": [{"attributes": attributes, "indices": indices,
                                                      "material": material}]})
        return self.node(mesh=number, translation=list(at), **said)

    def node(self, **said):
        number = self._add("nodes", said)
        self.json["scenes"][0]["nodes"].append(number)
        return number

    def picture(self, pixels, encode=png, mime="image/png"):
        return self._add("images", {"bufferView": self.view(encode(pixels)), "mimeType": mime})

    def texture(self, pixels, **sampler):
        said = {"source": self.picture(pixels)}
        if sampler:
            said["sampler"] = self._add("samplers", sampler)
        return self._add("textures", said)

    def save(self, path):
        document = {**self.json, "buffers": [{"byteLength": len(self.bytes)}]}
        text = json.dumps({key: value for key, value in document.items() if value}).encode()
        text += b" " * (-len(text) % 4)
        data = bytes(self.bytes) + b"\0" * (-len(self.bytes) % 4)
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data)) +
                         struct.pack("<I4s", len(text), b"JSON") + text +
                         struct.pack("<I4s", len(data), b"BIN\0") + data)


# ---- shapes: positions, normals, texture coordinates, indices

def sphere(radius=0.45, around=64, down=32):
    v, u = np.meshgrid(np.linspace(0, 1, down + 1), np.linspace(0, 1, around + 1), indexing="ij")
    theta, phi = v.ravel() * math.pi, u.ravel() * 2 * math.pi
    normals = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], axis=1)
    row, at = around + 1, np.arange(around)
    faces = []
    for y in range(down):
        a, b = y * row + at, (y + 1) * row + at
        faces += [np.stack([a, b, b + 1], axis=1)] * (y < down - 1) + [np.stack([a, b + 1, a + 1], axis=1)] * (y > 0)
    return radius * normals, normals, np.stack([u.ravel(), v.ravel()], axis=1), np.concatenate(faces).ravel()


def board(width=1.0, height=1.0):
    """Faces +Z."""
    x, y = width / 2, height / 2
    return (np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]]), np.tile([0.0, 0.0, 1.0], (4, 1)),
            np.array([[0, 1], [1, 1], [1, 0], [0, 0]]), np.array([0, 1, 2, 0, 2, 3]))


# ---- pictures

def letters(side=128):
    """A picture that shows where up and right are: a coloured ramp under a dark F."""
    y, x = np.mgrid[0:side, 0:side] / (side - 1)
    pixels = np.stack([60 + 180 * x, 60 + 180 * y, 200 - 120 * x * y, 255 + 0 * x], axis=2)
    ink = ((x > 0.25) & (x < 0.4) & (y > 0.15) & (y < 0.85)) | ((y > 0.15) & (y < 0.3) & (x > 0.25) & (x < 0.8)) | (
        (y > 0.45) & (y < 0.57) & (x > 0.25) & (x < 0.65))
    pixels[ink] = (30, 20, 60, 255)
    return pixels.round().astype(np.uint8)


def bumps(side=128):
    """Of a normal map: four by four round bumps."""
    y, x = np.mgrid[0:side, 0:side] / side
    dx, dy = (4 * x) % 1 - 0.5, (4 * y) % 1 - 0.5
    falls = np.clip(1 - 5 * (dx * dx + dy * dy), 0, 1)
    n = np.stack([4 * dx * falls, -4 * dy * falls, np.ones_like(x)], axis=2)
    n /= np.linalg.norm(n, axis=2, keepdims=True)
    return (255 * (0.5 + 0.5 * n)).round().astype(np.uint8)


# ---- models

PLASTIC = {"metallicFactor": 0, "roughnessFactor": 0.5}


def row_of_balls(materials, columns=3):
    """A ball for each, from the upper left."""
    model = Model()
    ball = model.mesh(sphere())
    rows = (len(materials) + columns - 1) // columns
    for at, said in enumerate(materials):
        model.place(ball, model.material(**said),
                    (at % columns - (columns - 1) / 2, (rows - 1) / 2 - at // columns, 0))
    return model


def metal_roughness():
    return row_of_balls([{"pbrMetallicRoughness": {"baseColorFactor": [*colour, 1], "metallicFactor": metal,
                                                   "roughnessFactor": rough}}
                         for metal, colour in ((0, (0.5, 0.1, 0.1)), (0, (0.8, 0.8, 0.8)), (1, (0.9, 0.6, 0.3)),
                                               (1, (0.9, 0.9, 0.9)))
                         for rough in (0.15, 0.35, 0.6, 0.8, 1.0)], columns=5)


def clearcoat():
    return row_of_balls([{"pbrMetallicRoughness": {"baseColorFactor": [*colour, 1], "metallicFactor": metal,
                                                   "roughnessFactor": 0.6},
                          "extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": coat,
                                                                     "clearcoatRoughnessFactor": rough}}}
                         for metal, colour in ((0, (0.6, 0.05, 0.05)), (1, (0.3, 0.4, 0.6)))
                         for coat, rough in ((0.5, 0.1), (1, 0.1), (1, 0.5))])


def ior():
    return row_of_balls([{"pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.3, 0.1, 1], "metallicFactor": 0,
                                                   "roughnessFactor": 0.4},
                          "extensions": {"KHR_materials_ior": {"ior": value}}}
                         for value in (1.0, 1.33, 1.5, 1.8, 2.4, 0)])


def specular():
    return row_of_balls([{"pbrMetallicRoughness": {"baseColorFactor": [0.3, 0.3, 0.35, 1], "metallicFactor": 0,
                                                   "roughnessFactor": 0.4},
                          "extensions": {"KHR_materials_specular": {"specularFactor": factor,
                                                                    "specularColorFactor": colour}}}
                         for colour in ([1, 1, 1], [4, 1, 0.2]) for factor in (0, 0.5, 1)])


def emissive_strength():
    return row_of_balls([{"pbrMetallicRoughness": {**PLASTIC, "baseColorFactor": [0.1, 0.1, 0.1, 1]},
                          "emissiveFactor": [0.5, 0.3, 0.1],
                          "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}}
                         for strength in (0, 0.5, 1, 2, 4, 16)])


def unlit():
    model = row_of_balls([{"pbrMetallicRoughness": {"baseColorFactor": [*colour, 1]},
                           "extensions": {"KHR_materials_unlit": {}}}
                          for colour in ((0.5, 0.2, 0.1), (1, 1, 1), (0.05, 0.3, 0.8))])
    picture = {"index": model.texture(letters())}
    model.place(model.mesh(board()), model.material(pbrMetallicRoughness={"baseColorTexture": picture},
                                                    extensions={"KHR_materials_unlit": {}}), (0, -1, 0))
    return model


def transmission():
    """Panes and balls before a board with a picture."""
    model = row_of_balls([{"pbrMetallicRoughness": {"baseColorFactor": [*colour, 1], "metallicFactor": 0,
                                                    "roughnessFactor": 0.05},
                           "extensions": {"KHR_materials_transmission": {"transmissionFactor": factor}}}
                          for factor in (0.5, 1.0) for colour in ((1, 1, 1), (0.9, 0.3, 0.2), (0.3, 0.3, 0.3))])
    picture = {"index": model.texture(letters())}
    model.place(model.mesh(board(3.2, 2.2)), model.material(pbrMetallicRoughness={
        **PLASTIC, "roughnessFactor": 0.9, "baseColorTexture": picture}), (0, 0, -0.8))
    return model


def specular_glossiness():
    """Its other half says the same without the extension: of that alone a reader without it takes heed."""
    return row_of_balls([{"pbrMetallicRoughness": {"baseColorFactor": [*colour, 1], "metallicFactor": 0,
                                                   "roughnessFactor": 1 - gloss},
                          "extensions": {"KHR_materials_pbrSpecularGlossiness": {
                              "diffuseFactor": [*colour, 1], "specularFactor": [0.04, 0.04, 0.04],
                              "glossinessFactor": gloss}}}
                         for colour in ((0.6, 0.2, 0.1), (0.2, 0.4, 0.6)) for gloss in (0.2, 0.5, 0.8)])


def texture_transform():
    model = Model()
    quad, picture = model.mesh(board(0.9, 0.9)), model.texture(letters())
    for at, said in enumerate(({"offset": [0.25, 0.1]}, {"rotation": 0.6}, {"scale": [2, 3]},
                               {"offset": [0.5, 0.5], "rotation": math.pi / 4, "scale": [1.5, 0.75]},
                               {"scale": [-1, 1], "offset": [1, 0]}, {"texCoord": 0, "rotation": -math.pi / 2})):
        material = model.material(doubleSided=False, pbrMetallicRoughness={**PLASTIC, "baseColorTexture": {
            "index": picture, "extensions": {"KHR_texture_transform": said}}})
        model.place(quad, material, (at % 3 - 1, 0.5 - at // 3, 0))
    model.use("KHR_texture_transform")
    return model


def lit_by(**light):
    """A floor and balls, and the file's own light above them."""
    def make():
        model = Model()
        ball, floor = model.mesh(sphere()), model.mesh(board(3, 3))
        matt = model.material(pbrMetallicRoughness={"baseColorFactor": [0.7, 0.7, 0.7, 1], "metallicFactor": 0,
                                                    "roughnessFactor": 0.9})
        shiny = model.material(pbrMetallicRoughness={"baseColorFactor": [0.9, 0.7, 0.4, 1], "metallicFactor": 1,
                                                     "roughnessFactor": 0.4})
        model.place(floor, matt, rotation=[-math.sqrt(0.5), 0, 0, math.sqrt(0.5)])
        model.place(ball, matt, (-0.6, 0.45, 0))
        model.place(ball, shiny, (0.6, 0.45, 0))
        model.use("KHR_lights_punctual")
        model.json["extensions"] = {"KHR_lights_punctual": {"lights": [light]}}
        # Downwards, and a little away from who looks.
        angle = -1.2
        model.node(translation=[0, 2, 0.5], rotation=[math.sin(angle / 2), 0, 0, math.cos(angle / 2)],
                   extensions={"KHR_lights_punctual": {"light": 0}})
        return model
    return make


def quantization():
    """The same ball with positions of 16 bits, normals of 8, texture coordinates of 16; its node makes it as large."""
    model = Model()
    positions, normals, texcoords, indices = sphere(1.0)
    attributes = {"POSITION": model.accessor((positions * 32767).round(), SHORT, True),
                  "NORMAL": model.accessor((normals * 127).round(), BYTE, True),
                  "TEXCOORD_0": model.accessor((texcoords * 65535).round(), USHORT, True)}
    model.use("KHR_mesh_quantization", required=True)
    picture = {"index": model.texture(letters())}
    material = model.material(pbrMetallicRoughness={**PLASTIC, "baseColorTexture": picture})
    model.place((attributes, model.accessor(indices, UINT)), material, scale=[0.7, 0.7, 0.7])
    return model


def picture_as(extension, encode, mime):
    """The same picture twice, in both forms: who does not read the one takes the other."""
    def make():
        model = Model()
        number = model.texture(letters())
        other = model.picture(letters(), encode, mime)
        model.json["textures"][number]["extensions"] = {extension: {"source": other}}
        model.use(extension)
        material = model.material(pbrMetallicRoughness={**PLASTIC, "baseColorTexture": {"index": number}})
        model.place(model.mesh(board(2, 2)), material)
        return model
    return make


def textures():
    """Of plain glTF: normals, occlusion, metal and roughness, emission, each from a picture."""
    model = Model()
    side = 128
    y, x = np.mgrid[0:side, 0:side] / (side - 1)
    ramp = np.stack([255 * x, 40 + 200 * y, 255 * (x > 0.5)], axis=2).round().astype(np.uint8)
    whole = {"baseColorFactor": [0.7, 0.6, 0.5, 1], **PLASTIC}
    bumpy, ramps, coloured = model.texture(bumps()), model.texture(ramp), model.texture(letters())
    quad = model.mesh(board(0.95, 0.95))
    for at, said in enumerate((
            {"pbrMetallicRoughness": whole, "normalTexture": {"index": bumpy}},
            {"pbrMetallicRoughness": whole, "normalTexture": {"index": bumpy, "scale": 0.4}},
            {"pbrMetallicRoughness": whole, "occlusionTexture": {"index": ramps}},
            {"pbrMetallicRoughness": whole, "occlusionTexture": {"index": ramps, "strength": 0.5}},
            {"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.7, 0.6, 1],
                                      "metallicRoughnessTexture": {"index": ramps}}},
            {"pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.1, 0.1, 1], **PLASTIC},
             "emissiveFactor": [0.8, 0.8, 0.8], "emissiveTexture": {"index": coloured}})):
        model.place(quad, model.material(**said), (at % 3 - 1, 0.5 - at // 3, 0))
    return model


def mirrored_board(width=0.9, height=0.9):
    """Two halves that share a picture, mirrored about the middle: its vertices are there twice."""
    x, y = width / 2, height / 2
    positions = np.array([[-x, -y, 0], [0, -y, 0], [0, y, 0], [-x, y, 0], [0, -y, 0], [x, -y, 0], [x, y, 0], [0, y, 0]])
    return (positions, np.tile([0.0, 0.0, 1.0], (8, 1)),
            np.array([[0, 1], [1, 1], [1, 0], [0, 0], [1, 1], [0, 1], [0, 0], [1, 0]]),
            np.array([0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7]))


def tangents_of(positions, normals, texcoords, indices):
    """Along u and across the normals, a vertex the mean of its faces by their angles; w: the side that -v lies on."""
    sums, sides = np.zeros(positions.shape), np.zeros(len(positions))
    for face in indices.reshape(-1, 3):
        p, uv = positions[face], texcoords[face]
        (a, b), (c, d) = uv[1] - uv[0], uv[2] - uv[0]
        area = a * d - b * c
        if area == 0:
            continue
        along = (d * (p[1] - p[0]) - b * (p[2] - p[0])) / area
        for corner, vertex in enumerate(face):
            n = normals[vertex]
            flat = along - n * n.dot(along)
            one, other = p[corner - 2] - p[corner], p[corner - 1] - p[corner]
            share = np.linalg.norm(one) * np.linalg.norm(other)
            angle = math.acos(np.clip(one.dot(other) / share, -1, 1)) if share else 0
            sums[vertex] += angle * flat / max(np.linalg.norm(flat), 1e-12)
            # On a picture whose rows go down a face that is not mirrored winds the other way than its place.
            sides[vertex] = -np.sign(area)
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    sums = np.where(lengths > 0, sums / np.maximum(lengths, 1e-12), [1.0, 0.0, 0.0])
    return np.concatenate([sums, np.where(sides == 0, 1, sides)[:, None]], axis=1)


def tangents():
    """Normal maps: a board whose halves are mirrored, a ball, a board whose picture is turned; above without TANGENT,
    where a reader makes its own (MikkTSpace), below with it."""
    model = Model()
    bumpy = model.texture(bumps())
    number = model.material(normalTexture={"index": bumpy}, pbrMetallicRoughness={
        "baseColorFactor": [0.7, 0.7, 0.7, 1], **PLASTIC, "roughnessFactor": 0.4})
    positions, normals, texcoords, indices = board(0.9, 0.9)
    c, s = math.cos(0.7), math.sin(0.7)
    turned = (positions, normals, texcoords @ np.array([[c, s], [-s, c]]), indices)
    for column, shape in enumerate((mirrored_board(), sphere(), turned)):
        for row, given in enumerate((False, True)):
            more = {"TANGENT": model.accessor(tangents_of(*shape))} if given else {}
            model.place(model.mesh(shape, **more), number, (column - 1, 0.5 - row, 0))
    return model


def shadow():
    """A ring of posts and a ball above a floor, for a lamp within that casts shadows to all sides (SHADOWED)."""
    model = Model()
    ball, matt = model.mesh(sphere(0.16)), model.material(pbrMetallicRoughness={
        "baseColorFactor": [0.7, 0.7, 0.7, 1], "metallicFactor": 0, "roughnessFactor": 0.9})
    post = model.mesh(sphere(1.0, 32, 16))
    model.place(model.mesh(board(3, 3)), matt, rotation=[-math.sqrt(0.5), 0, 0, math.sqrt(0.5)])
    for at in range(8):
        angle = math.pi * at / 4
        model.place(post, matt, (math.sin(angle), 0.3, math.cos(angle)), scale=[0.09, 0.3, 0.09])
    model.place(ball, matt, (0.35, 0.5, 0.2))
    return model


def alpha():
    """Of plain glTF: masks, blended panes one behind the other, backs of surfaces, colours of vertices."""
    model = Model()
    pixels = letters()
    y, x = np.mgrid[0:128, 0:128] / 127
    pixels[:, :, 3] = (255 * np.clip(1.5 - 2 * np.hypot(x - 0.5, y - 0.5), 0, 1)).round()
    round_picture, plain = {"index": model.texture(pixels)}, {"index": model.texture(letters())}
    quad = model.mesh(board(0.95, 0.95))
    coloured = model.mesh(board(0.95, 0.95), COLOR_0=model.accessor(
        [[1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1], [1, 1, 1, 1]]))
    turned = {"rotation": [0, 1, 0, 0]}
    for at, (mesh, said, more) in enumerate((
            (quad, {"alphaMode": "MASK", "alphaCutoff": 0.6, "pbrMetallicRoughness": {
                **PLASTIC, "baseColorTexture": round_picture}}, {}),
            (quad, {"alphaMode": "BLEND", "pbrMetallicRoughness": {
                **PLASTIC, "baseColorTexture": round_picture}}, {}),
            (quad, {"alphaMode": "OPAQUE", "pbrMetallicRoughness": {
                **PLASTIC, "baseColorTexture": round_picture}}, {}),
            (quad, {"doubleSided": True, "pbrMetallicRoughness": {**PLASTIC, "baseColorTexture": plain}}, turned),
            (coloured, {"pbrMetallicRoughness": {**PLASTIC, "baseColorFactor": [0.8, 0.8, 0.8, 1]}}, {}),
            (quad, {"alphaMode": "BLEND", "pbrMetallicRoughness": {
                **PLASTIC, "baseColorFactor": [0.2, 0.5, 0.9, 0.4]}}, {}))):
        model.place(mesh, model.material(**said), (at % 3 - 1, 0.5 - at // 3, 0), **more)
    behind = model.material(pbrMetallicRoughness={**PLASTIC, "baseColorTexture": plain})
    model.place(model.mesh(board(3, 2)), behind, (0, 0, -0.6))
    return model


OWN = {
    "metal-roughness": metal_roughness,
    "textures": textures,
    "tangents": tangents,
    "point-shadow": shadow,
    "alpha": alpha,
    "KHR_materials_clearcoat": clearcoat,
    "KHR_materials_emissive_strength": emissive_strength,
    "KHR_materials_ior": ior,
    "KHR_materials_pbrSpecularGlossiness": specular_glossiness,
    "KHR_materials_specular": specular,
    "KHR_materials_transmission": transmission,
    "KHR_materials_unlit": unlit,
    "KHR_texture_transform": texture_transform,
    "KHR_mesh_quantization": quantization,
    "MSFT_texture_dds": picture_as("MSFT_texture_dds", dds, "image/vnd-ms.dds"),
    "EXT_texture_webp": picture_as("EXT_texture_webp", webp, "image/webp"),
    "KHR_lights_punctual-directional": lit_by(type="directional", intensity=0.8, color=[1, 0.9, 0.7]),
    "KHR_lights_punctual-point": lit_by(type="point", intensity=3, color=[0.7, 0.9, 1]),
    "KHR_lights_punctual-range": lit_by(type="point", intensity=6, range=3),
    "KHR_lights_punctual-spot": lit_by(type="spot", intensity=4, spot={"innerConeAngle": 0.2, "outerConeAngle": 0.5}),
}


# Lit by a lamp of the stage that casts shadows, and by nothing else but the surroundings; where it stands in the model.
SHADOWED = {"point-shadow": {"position": (0, 0.9, 0), "intensity": 1.2}}


def write_models(folder):
    """Path by name."""
    paths = {}
    for name, make in OWN.items():
        paths[name] = folder / f"{name}.glb"
        make().save(paths[name])
    return paths
