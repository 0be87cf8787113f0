#!/usr/bin/env python3
"""Writes cart.usdc and cart.usdz beside cart.usda: the same scene as a crate of version 0.8, and as a package.

The crate is written after the published structure of crate files: sections TOKENS, STRINGS, FIELDS, FIELDSETS, PATHS,
SPECS; LZ4 blocks of literals alone; integers as differences.
"""
import pathlib
import struct
import zlib
from collections import Counter

HERE = pathlib.Path(__file__).parent
INLINED, ARRAY, PACKED = 1 << 62, 1 << 63, 1 << 61
TYPES = dict(bool=1, int=3, float=8, double=9, string=10, token=11, asset=12, vec2f=20, vec3d=23, vec3f=24,
             token_list=32, string_list=33, path_list=34, tokens=41, specifier=42, variability=44, selections=45,
             samples=46, doubles=48, reference_list=35)
ATTRIBUTE, PRIM, ROOT, RELATIONSHIP, VARIANT, VARIANT_SET = 1, 6, 7, 8, 10, 11
DEF, UNIFORM = 0, 1


def blocks(data):
    """One LZ4 block of literals."""
    size = len(data)
    if size < 15:
        return bytes([0, size << 4]) + data
    return bytes([0, 0xf0]) + b"\xff" * ((size - 15) // 255) + bytes([(size - 15) % 255]) + data


def integers(numbers):
    """32 bits each, as differences."""
    numbers = [n & 0xffffffff for n in numbers]
    if not numbers:
        return struct.pack("<Q", 0)
    steps = [(b - a + 2**31) % 2**32 - 2**31 for a, b in zip([0] + numbers[:-1], numbers)]
    common = Counter(steps).most_common(1)[0][0]
    codes, rest = bytearray((len(steps) * 2 + 7) // 8), b""
    for i, step in enumerate(steps):
        code = 0 if step == common else 1 if -128 <= step < 128 else 2 if -32768 <= step < 32768 else 3
        codes[i // 4] |= code << (i % 4 * 2)
        if code:
            rest += struct.pack("<" + " bhi"[code], step)
    packed = blocks(struct.pack("<i", common) + bytes(codes) + rest)
    return struct.pack("<Q", len(packed)) + packed


class Crate:
    def __init__(self):
        self.body = bytearray(b"PXR-USDC" + bytes([0, 8, 0]) + bytes(77))
        self.tokens, self.strings, self.fields, self.sets, self.paths, self.specs = {}, {}, {}, [], {"/": 0}, []

    def token(self, word):
        return self.tokens.setdefault(word, len(self.tokens))

    def string(self, word):
        return self.strings.setdefault(self.token(word), len(self.strings))

    def path(self, path):
        return self.paths.setdefault(path, len(self.paths))

    def inlined(self, kind, bits):
        return INLINED | TYPES[kind] << 48 | bits

    def placed(self, kind, data, flags=0):
        while len(self.body) % 8:
            self.body.append(0)
        at = len(self.body)
        self.body += data
        return flags | TYPES[kind] << 48 | at

    def value(self, kind, value):
        if kind == "token":
            return self.inlined(kind, self.token(value))
        if kind == "asset":
            return self.inlined(kind, self.token(value))
        if kind == "string":
            return self.inlined(kind, self.string(value))
        if kind in ("bool", "specifier", "variability"):
            return self.inlined(kind, int(value))
        if kind in ("float", "double"):
            return self.inlined(kind, struct.unpack("<I", struct.pack("<f", value))[0])
        if kind == "vec3d":
            return self.placed(kind, struct.pack("<3d", *value))
        if kind == "vec3f":
            return self.placed(kind, struct.pack("<3f", *value))
        if kind == "token[]":
            return self.placed("token", struct.pack(f"<Q{len(value)}I", len(value), *map(self.token, value)), ARRAY)
        if kind == "int[]":
            if len(value) < 16:
                return self.placed("int", struct.pack(f"<Q{len(value)}i", len(value), *value), ARRAY)
            return self.placed("int", struct.pack("<Q", len(value)) + integers(value), ARRAY | PACKED)
        if kind in ("vec2f[]", "vec3f[]"):
            flat = [n for element in value for n in element]
            return self.placed(kind[:-2], struct.pack(f"<Q{len(flat)}f", len(value), *flat), ARRAY)
        if kind == "tokens":
            return self.placed(kind, struct.pack(f"<Q{len(value)}I", len(value), *map(self.token, value)))
        if kind == "paths":
            return self.placed("path_list", struct.pack(f"<BQ{len(value)}I", 3, len(value), *map(self.path, value)))
        if kind == "prepended strings":
            return self.placed("string_list",
                               struct.pack(f"<BQ{len(value)}I", 32, len(value), *map(self.string, value)))
        if kind == "selections":
            return self.placed(kind, struct.pack("<Q", len(value)) + b"".join(
                struct.pack("<II", self.string(a), self.string(b)) for a, b in value.items()))
        if kind == "float samples":
            times = self.placed("doubles", struct.pack(f"<Q{len(value)}d", len(value), *value))
            reps = [self.value("float", number) for number in value.values()]
            return self.placed("samples", struct.pack(f"<QQQQ{len(reps)}Q", 8, times, 8, len(reps), *reps))
        raise ValueError(kind)

    def spec(self, path, kind, **fields):
        """Fields as name=(kind, value); in the order of USD's own writer, properties behind their prim."""
        first = len(self.sets)
        for name, (value_kind, value) in fields.items():
            rep = self.value(value_kind, value)
            self.sets.append(self.fields.setdefault((self.token(name), rep), len(self.fields)))
        self.sets.append(0xffffffff)
        self.specs.append((self.path(path), first, kind))

    def tree(self):
        """Paths, depth first: their numbers, names and jumps."""
        below = {}
        for path in list(self.paths):
            while path != "/":
                parent = parent_of(path)
                known = below.setdefault(parent, [])
                if path not in known:
                    known.append(path)
                self.path(path)
                path = parent
        numbers, names, jumps = [], [], []

        def write(path, has_sibling):
            at = len(numbers)
            numbers.append(self.paths[path])
            name = path[len(parent_of(path)):].lstrip("/")
            names.append(0 if path == "/" else -self.token(name[1:]) if name.startswith(".") else self.token(name))
            jumps.append(0)
            children = below.get(path, [])
            for i, child in enumerate(children):
                write(child, i + 1 < len(children))
            jumps[at] = len(numbers) - at if children and has_sibling else -1 if children else 0 if has_sibling else -2

        write("/", False)
        return numbers, names, jumps

    def bytes(self):
        numbers, names, jumps = self.tree()
        sections = []

        def section(name, data):
            sections.append((name, len(self.body), len(data)))
            self.body.extend(data)

        text = b"".join(word.encode() + b"\0" for word in self.tokens)
        packed = blocks(text)
        section(b"TOKENS", struct.pack("<QQQ", len(self.tokens), len(text), len(packed)) + packed)
        section(b"STRINGS", struct.pack(f"<Q{len(self.strings)}I", len(self.strings), *self.strings))
        reps = blocks(b"".join(struct.pack("<Q", rep) for _, rep in self.fields))
        section(b"FIELDS", struct.pack("<Q", len(self.fields)) + integers([name for name, _ in self.fields]) +
                struct.pack("<Q", len(reps)) + reps)
        section(b"FIELDSETS", struct.pack("<Q", len(self.sets)) + integers(self.sets))
        section(b"PATHS", struct.pack("<QQ", len(self.paths), len(numbers)) + integers(numbers) + integers(names) +
                integers(jumps))
        section(b"SPECS", struct.pack("<Q", len(self.specs)) +
                b"".join(integers([spec[i] for spec in self.specs]) for i in range(3)))
        self.body[16:24] = struct.pack("<Q", len(self.body))
        self.body += struct.pack("<Q", len(sections))
        for name, at, size in sections:
            self.body += name.ljust(16, b"\0") + struct.pack("<QQ", at, size)
        return bytes(self.body)


def parent_of(path):
    if path.endswith("}"):
        return path[:path.rindex("{")]
    dot, slash, brace = path.rfind("."), path.rfind("/"), path.rfind("}")
    if dot > slash:
        return path[:dot]
    if brace > slash:
        return path[:brace + 1]
    return path[:slash] or "/"


def cart():
    crate = Crate()
    crate.token(";-)")  # names of properties are below 0: the first is none of them
    crate.token("")

    def prim(path, kind, children=(), **fields):
        if children:
            fields["primChildren"] = ("tokens", children)
        crate.spec(path, PRIM, specifier=("specifier", DEF), typeName=("token", kind), **fields)

    uniform = ("doubleSided", "subdivisionScheme", "elementType", "xformOpOrder", "axis", "info:id")

    def attribute(path, kind, **fields):
        if path.rsplit(".")[-1] in uniform:
            fields["variability"] = ("variability", UNIFORM)
        crate.spec(path, ATTRIBUTE, typeName=("token", kind), **fields)

    def connected(path, kind, target):
        attribute(path, kind, connectionPaths=("paths", [target]))

    def bound(path, material):
        crate.spec(path + ".material:binding", RELATIONSHIP, targetPaths=("paths", [material]))

    crate.spec("/", ROOT, defaultPrim=("token", "Cart"), metersPerUnit=("double", 1), upAxis=("token", "Y"),
               timeCodesPerSecond=("double", 24), startTimeCode=("double", 1), endTimeCode=("double", 25),
               primChildren=("tokens", ["Cart"]))
    prim("/Cart", "Xform", ["Floor", "Wheel", "Looks"], variantSelection=("selections", {"load": "crate"}),
         variantSetNames=("prepended strings", ["load"]))
    prim("/Cart/Floor", "Mesh", ["Corner"])
    attribute("/Cart/Floor.doubleSided", "bool", default=("bool", True))
    attribute("/Cart/Floor.faceVertexCounts", "int[]", default=("int[]", [4] * 4))
    attribute("/Cart/Floor.faceVertexIndices", "int[]",
              default=("int[]", [0, 3, 4, 1, 1, 4, 5, 2, 3, 6, 7, 4, 4, 7, 8, 5]))
    attribute("/Cart/Floor.points", "point3f[]",
              default=("vec3f[]", [(x, 0.5, z) for z in (-1, 0, 1) for x in (-1, 0, 1)]))
    attribute("/Cart/Floor.primvars:st", "texCoord2f[]", interpolation=("token", "faceVarying"),
              default=("vec2f[]", [(0, 0), (1, 0), (0.25, 0.5), (1, 1), (0, 1)]))
    attribute("/Cart/Floor.primvars:st:indices", "int[]", default=("int[]", [0, 1, 3, 4] * 3 + [0, 1, 3, 2]))
    attribute("/Cart/Floor.subdivisionScheme", "token", default=("token", "none"))
    bound("/Cart/Floor", "/Cart/Looks/Wood")
    prim("/Cart/Floor/Corner", "GeomSubset")
    attribute("/Cart/Floor/Corner.elementType", "token", default=("token", "face"))
    attribute("/Cart/Floor/Corner.indices", "int[]", default=("int[]", [3]))
    bound("/Cart/Floor/Corner", "/Cart/Looks/Steel")
    prim("/Cart/Wheel", "Xform", ["Rim"])
    attribute("/Cart/Wheel.xformOp:rotateZ", "float", timeSamples=("float samples", {1: 0, 25: 360}))
    attribute("/Cart/Wheel.xformOp:translate", "double3", default=("vec3d", (-0.75, 0.25, 0.75)))
    attribute("/Cart/Wheel.xformOpOrder", "token[]", default=("token[]", ["xformOp:translate", "xformOp:rotateZ"]))
    prim("/Cart/Wheel/Rim", "Cylinder")
    attribute("/Cart/Wheel/Rim.axis", "token", default=("token", "Z"))
    attribute("/Cart/Wheel/Rim.height", "double", default=("double", 0.125))
    attribute("/Cart/Wheel/Rim.radius", "double", default=("double", 0.25))
    bound("/Cart/Wheel/Rim", "/Cart/Looks/Steel")
    prim("/Cart/Looks", "Scope", ["Wood", "Steel"])
    for material, shaders in (("Wood", ["Surface", "Picture", "Coordinates"]), ("Steel", ["Surface"])):
        at = "/Cart/Looks/" + material
        prim(at, "Material", shaders)
        connected(at + ".outputs:surface", "token", at + "/Surface.outputs:surface")
        for shader, kind in zip(shaders, ("UsdPreviewSurface", "UsdUVTexture", "UsdPrimvarReader_float2")):
            prim(at + "/" + shader, "Shader")
            attribute(at + "/" + shader + ".info:id", "token", default=("token", kind))
    wood, steel = "/Cart/Looks/Wood/", "/Cart/Looks/Steel/"
    connected(wood + "Surface.inputs:diffuseColor", "color3f", wood + "Picture.outputs:rgb")
    attribute(wood + "Surface.inputs:roughness", "float", default=("float", 0.75))
    attribute(wood + "Picture.inputs:file", "asset", default=("asset", "checks.png"))
    connected(wood + "Picture.inputs:st", "float2", wood + "Coordinates.outputs:result")
    attribute(wood + "Picture.inputs:wrapS", "token", default=("token", "clamp"))
    attribute(wood + "Coordinates.inputs:varname", "string", default=("string", "st"))
    attribute(steel + "Surface.inputs:diffuseColor", "color3f", default=("vec3f", (0.5, 0.25, 0.125)))
    attribute(steel + "Surface.inputs:metallic", "float", default=("float", 1))
    attribute(steel + "Surface.inputs:roughness", "float", default=("float", 0.25))
    crate.spec("/Cart{load=}", VARIANT_SET)
    crate.spec("/Cart{load=crate}", VARIANT, primChildren=("tokens", ["Load"]))
    crate.spec("/Cart{load=none}", VARIANT)
    prim("/Cart{load=crate}Load", "Cube")
    attribute("/Cart{load=crate}Load.size", "double", default=("double", 0.5))
    attribute("/Cart{load=crate}Load.xformOp:translate", "double3", default=("vec3d", (0, 0.75, 0)))
    attribute("/Cart{load=crate}Load.xformOpOrder", "token[]", default=("token[]", ["xformOp:translate"]))
    return crate.bytes()


def package(files):
    """A zip of stored files, each at a multiple of 64 bytes."""
    out, entries = b"", b""
    for name, data in files.items():
        head = struct.pack("<HHHHHIII", 20, 0, 0, 0, 0x21, zlib.crc32(data), len(data), len(data))
        pad = -(len(out) + 30 + len(name) + 4) % 64
        extra = struct.pack("<HH", 0x1986, pad) + bytes(pad)
        entries += (b"PK\x01\x02" + struct.pack("<H", 20) + head +
                    struct.pack("<HHHHHII", len(name), 0, 0, 0, 0, 0, len(out)) + name.encode())
        out += b"PK\x03\x04" + head + struct.pack("<HH", len(name), len(extra)) + name.encode() + extra + data
    end = struct.pack("<HHHHIIH", 0, 0, len(files), len(files), len(entries), len(out), 0)
    return out + entries + b"PK\x05\x06" + end


if __name__ == "__main__":
    (HERE / "cart.usdc").write_bytes(cart())
    (HERE / "cart.usdz").write_bytes(package({"cart.usdc": cart(), "checks.png": (HERE / "checks.png").read_bytes()}))
