#!/usr/bin/env python3
"""Writes ../subdivision.tsct: animals, a creased machine part and pebbles, each a control mesh of a few dozen points;
and ../rearing.tsct, where the animals rear up against the machine part while all of them are led by tessera-deform.

    deploy/scenes/subdivision/make-subdivision.py > deploy/scenes/subdivision.tsct
    deploy/scenes/subdivision/make-subdivision.py rearing > deploy/scenes/rearing.tsct
"""
import math
import sys


def voxels(xs, ys, zs, cells):
    """The surface of some cells of a grid whose planes stand where xs, ys, zs say: points and quadrilaterals, seen from
    outside."""
    numbers, points, faces = {}, [], []

    def vertex(i, j, k):
        if (i, j, k) not in numbers:
            numbers[i, j, k] = len(points)
            points.append((xs[i], ys[j], zs[k]))
        return numbers[i, j, k]

    solid = set(cells)
    for i, j, k in sorted(solid):
        for axis in range(3):
            for side in (0, 1):
                next_ = [i, j, k]
                next_[axis] += 1 if side else -1
                if tuple(next_) in solid:
                    continue
                u, v = (axis + 1) % 3, (axis + 2) % 3
                corners = []
                for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                    at = [i, j, k]
                    at[axis] += side
                    at[u] += a
                    at[v] += b
                    corners.append(vertex(*at))
                faces.append(corners if side else corners[::-1])
    return points, faces


def animal():
    xs = [-2.1, -1.45, -1.2, -0.7, 0.35, 0.8, 1.15, 1.75]
    ys = [0, 0.18, 0.75, 0.95, 1.5, 1.75, 2.1, 2.45]
    zs = [-0.62, -0.3, -0.12, 0.12, 0.3, 0.62]
    cells = set()
    for i in range(1, 6):  # trunk
        for k in range(0, 5):
            cells |= {(i, 3, k)}
            if 1 <= i <= 5:
                cells |= {(i, 2, k)}
    for i in (1, 4):  # legs and paws
        for k in (0, 4):
            cells |= {(i, 1, k), (i, 0, k), (i + 1, 0, k)}
    cells |= {(5, 4, k) for k in (1, 2, 3)}  # neck
    cells |= {(i, 5, k) for i in (5, 6) for k in (1, 2, 3)}  # head
    cells |= {(6, 4, k) for k in (1, 2, 3)}
    cells |= {(5, 6, 1), (5, 6, 3)}  # ears
    cells |= {(0, 3, 2)}  # tail
    points, faces = voxels(xs, ys, zs, cells)
    return [(x + (0.15 if x < -2 else 0), y + (0.55 if x < -2 else 0), z) for x, y, z in points], faces


def flange(segments=8):
    """A revolved profile, from the bore outwards around: its rims are creases."""
    profile = [(0.45, 0), (1.3, 0), (1.3, 0.28), (0.8, 0.34), (0.7, 0.9), (0.45, 0.9)]
    sharp = {0: 10, 1: 10, 2: 2.5, 3: 0, 4: 3, 5: 10}
    points, faces, creases = [], [], []
    for s in range(segments):
        angle = 2 * math.pi * s / segments
        points += [(r * math.cos(angle), y, -r * math.sin(angle)) for r, y in profile]
    n = len(profile)
    for s in range(segments):
        t = (s + 1) % segments
        for p in range(n):
            q = (p + 1) % n
            faces.append([s * n + p, t * n + p, t * n + q, s * n + q])
            if sharp[p]:
                creases.append((s * n + p, t * n + p, sharp[p]))
    return points, faces, creases


def pebble():
    g = (1 + math.sqrt(5)) / 2
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g),
              (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
             (7, 1, 8),
             (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7),
             (9, 8, 1)]
    return [(0.19 * x, 0.12 * y, 0.16 * z) for x, y, z in points], faces


def lines(name, numbers, per_line, indent):
    text = [f"{n:g}" for n in numbers]
    rows = [", ".join(text[i:i + per_line]) for i in range(0, len(text), per_line)]
    return f"{indent}{name}: [" + (",\n" + indent + "  ").join(rows) + "]\n"


def surface(points, faces, extra="", creases=(), indent="      "):
    out = indent[2:] + "subdivision_surface {\n"
    out += lines("points", [round(c, 4) for p in points for c in p], 18, indent)
    out += lines("face_vertices", [v for f in faces for v in f], 28, indent)
    if creases:
        out += lines("creases", [v for a, b, _ in creases for v in (a, b)], 28, indent)
        out += lines("crease_sharpness", [s for _, _, s in creases], 28, indent)
    return out + (indent + extra + "\n" if extra else "") + indent[2:] + "}\n"


def subdivision():
    print("""# Animals, a creased machine part and pebbles: what stands here are their control meshes, what is seen \
and touched the smooth
# surfaces that these mean. Written by subdivision/make-subdivision.py.
#
# The flange comes down over the first animal's head and stops where it touches; the pebbles are free bodies.
# Pull at a control point, and picture and collision follow: tessera-ctl set /garden/animal/surface points@158 0.8 3 \
-0.3

material { name: "fur"     base_color { r: 0.55 g: 0.30 b: 0.12 } roughness: 0.75 }
material { name: "slate"   base_color { r: 0.20 g: 0.24 b: 0.32 } roughness: 0.6 }
material { name: "steel"   base_color { r: 0.62 g: 0.64 b: 0.66 } metallic: 0.8 roughness: 0.3 }
material { name: "stone"   base_color { r: 0.58 g: 0.55 b: 0.50 } roughness: 0.9 }
material { name: "lawn"    base_color { r: 0.22 g: 0.34 b: 0.14 } roughness: 1 }
material { name: "paving"  base_color { r: 0.46 g: 0.43 b: 0.40 } roughness: 0.9 }

node { name: "air" environment { sky { r: 0.26 g: 0.30 b: 0.36 } ground { r: 0.16 g: 0.15 b: 0.11 } background { r: \
0.55 g: 0.66 b: 0.78 }
  gravity { y: -9.81 } } }
node { name: "sun" transform { rotation { axis { x: -0.8 y: -0.6 z: 0.1 } angle_deg: 58 } }
  directional_light { color { r: 1 g: 0.95 b: 0.86 } intensity: 1.1 shadows: true } }
node { name: "camera" transform { translation { x: 0.3 y: 2.2 z: 6.6 } rotation { axis { x: -1 } angle_deg: 12 } }
  camera { world_units_per_metre: 1.5 } }

node {
  name: "garden"
  node { name: "lawn" material: "lawn" transform { translation { y: -0.2 } } box { size { x: 30 y: 0.2 z: 20 } } }
  node { name: "paving" material: "paving" transform { translation { y: -0.1 } } box { size { x: 9 y: 0.2 z: 5 } } }
""")
    points, faces = animal()
    print("  node {\n    name: \"animal\"\n    transform { translation { x: -1.6 } rotation { axis { y: 1 } "
          "angle_deg: 20 } }\n    node {\n      name: \"surface\"\n      material: \"fur\"")
    print(surface(points, faces, indent="        ") + "    }\n    node { collision_object { kind: DEFORMING } }\n  }")
    print("  node {\n    name: \"young one\"\n    transform { translation { x: 1.7 z: 1.2 } rotation { axis { y: 1 } "
          "angle_deg: 205 } uniform_scale: 0.55 }\n    node {\n      name: \"surface\"\n      material: \"slate\"")
    print(surface(points, faces, indent="        ") + "    }\n    node { collision_object { kind: DEFORMING } }\n  }")
    points, faces, creases = flange()
    print("""  node {
    name: "flange"
    transform { translation { x: -0.6 y: 4.2 z: -0.45 } }
    node {
      name: "surface"
      material: "steel\"""")
    print(surface(points, faces, creases=creases, indent="        ") + """    }
    node { collision_object {} }
    node { motion { key { time: 0 transform { translation { x: -0.6 y: 4.2 z: -0.45 } } }
                    key { time: 2 transform { translation { x: -0.6 y: 1 z: -0.45 } } } } }
    node { interest { object: "flange" mode: DYNAMIC response: STOP show_points: true } }
  }""")
    points, faces = pebble()
    print("""  node { name: "pebbles"
    node { name: "row" transform { translation { x: 0.9 y: 2.6 z: -0.6 } } repeat { count: 5 step { x: 0.35 y: 0.45 z: \
0.25 } }
      node { name: "pebble" transform { rotation { axis { x: 1 y: 2 z: 1 } angle_deg: 40 } } material: "stone"
        node { name: "surface\"""")
    print(surface(points, faces, extra="scheme: LOOP level: 2", indent="          ") + """        }
        node { collision_object { shape: HULL mass: 2 restitution: 0.3 } } } }
    node { interest { object: "pebbles" response: BOUNCE mode: DYNAMIC } } }
}""")



def rearing():
    print("""# Two animals rear up against a creased flange that hangs between them, and all three deform: their \
control meshes are led by
#
#     tessera-deform bend-x:0..28:4:/ring/animal bend-x:0..28:4:/ring/other swell-y:-8..16:3:/ring/flange
#
# (`./deploy/run-wall --deform` runs it beside the wall). What touches is marked: a ball per point, a bright triangle \
per face.
# Nothing is stopped. Written by subdivision/make-subdivision.py.

material { name: "fur"     base_color { r: 0.55 g: 0.30 b: 0.12 } roughness: 0.75 }
material { name: "slate"   base_color { r: 0.20 g: 0.24 b: 0.32 } roughness: 0.6 }
material { name: "steel"   base_color { r: 0.62 g: 0.64 b: 0.66 } metallic: 0.8 roughness: 0.3 }
material { name: "sand"    base_color { r: 0.52 g: 0.44 b: 0.31 } roughness: 1 }

node { name: "air" environment { sky { r: 0.30 g: 0.33 b: 0.38 } ground { r: 0.18 g: 0.16 b: 0.12 } background { r: \
0.60 g: 0.66 b: 0.72 } } }
node { name: "sun" transform { rotation { axis { x: -0.8 y: -0.6 z: 0.1 } angle_deg: 58 } }
  directional_light { color { r: 1 g: 0.95 b: 0.86 } intensity: 1.1 shadows: true } }
node { name: "camera" transform { translation { x: 0 y: 0.9 z: 4.3 } rotation { axis { x: -1 } angle_deg: 6 } }
  camera { world_units_per_metre: 1.15 } }

node {
  name: "ring"
  node { name: "sand" material: "sand" transform { translation { y: -0.1 } } cylinder { radius: 14 height: 0.2 \
segments: 96 } }
""")
    points, faces = animal()
    for name, fur, place in (("animal", "fur", "translation { x: -2.05 }"),
                             ("other", "slate", "translation { x: 2.05 } rotation { axis { y: 1 } angle_deg: 180 }")):
        print(f'  node {{\n    name: "{name}"\n    transform {{ {place} }}\n    node {{\n      name: "surface"\n      '
              f'material: "{fur}"')
        print(surface(points, faces,
                      indent="        ") + "    }\n    node { collision_object { kind: DEFORMING } }\n  }")
    points, faces, creases = flange()
    print("""  node {
    name: "flange"
    transform { translation { y: 2.52 } }
    node {
      name: "surface"
      material: "steel\"""")
    print(surface(points, faces, creases=creases, indent="        ") + """    }
    node { collision_object { kind: DEFORMING } }
  }
  node { name: "left" interest { object: "animal" against: "flange" response: REPORT show_points: true show_faces: \
true } }
  node { name: "right" interest { object: "other" against: "flange" response: REPORT show_points: true show_faces: \
true } }
  node { name: "both" interest { object: "animal" against: "other" response: REPORT show_points: true show_faces: true \
} }
}""")


rearing() if sys.argv[1:] == ["rearing"] else subdivision()
