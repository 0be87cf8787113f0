#!/usr/bin/env python3
"""Writes ../bent.tsct: columns, rings and balls that lattices of control points bend. Units are metres, y is up."""
import math
import os

HEAD = """# A court of bodies that lattices bend: each node's `lattice` makes its core a Deformation, and what travels \
of it when it is bent
# anew is its control points. Written by bent/make-bent.py. Units are metres.

image { name: "noon" uri: "lights/noon.hdr" }
"""
COLORS = {"coral": (0.78, 0.27, 0.20), "sand": (0.72, 0.60, 0.42), "teal": (0.10, 0.45, 0.46),
          "ink": (0.13, 0.18, 0.33),
          "moss": (0.33, 0.42, 0.16), "plum": (0.42, 0.16, 0.31), "chalk": (0.46, 0.44, 0.41)}
out = [HEAD]
for name, (r, g, b) in COLORS.items():
    out.append(f'material {{ name: "{name}" base_color {{ r: {r} g: {g} b: {b} }} roughness: 0.45 }}')


def column(name, rings, around):
    """A rounded square, 0.44 m wide and 2 m high, closed at both ends."""
    position, normal, index = [], [], []
    for ring in range(rings + 1):
        for i in range(around):
            a = 2 * math.pi * i / around
            c, s = math.cos(a), math.sin(a)
            r = 0.22 / (abs(c) ** 6 + abs(s) ** 6) ** (1 / 6)
            n = [math.copysign(abs(c) ** 5, c), 0, math.copysign(abs(s) ** 5, s)]
            length = math.hypot(n[0], n[2])
            position += [r * c, 2 * ring / rings, r * s]
            normal += [n[0] / length, 0, n[2] / length]
    for ring in range(rings):
        for i in range(around):
            a, b = ring * around + i, ring * around + (i + 1) % around
            index += [a, a + around, b, b, a + around, b + around]
    for ring, up in ((0, -1), (rings, 1)):
        first = len(position) // 3
        for i in range(around):
            position += position[3 * (ring * around + i):3 * (ring * around + i) + 3]
            normal += [0, up, 0]
        for i in range(1, around - 1):
            index += [first, first + i + 1, first + i] if up > 0 else [first, first + i, first + i + 1]
    text = lambda numbers: " ".join(f"{n:.5g}," for n in numbers).rstrip(",")
    out.append(f'mesh {{ name: "{name}"\n  position: [{text(position)}]\n  normal: [{text(normal)}]\n  index: '
               f'[{text(index)}] }}')


def lattice(counts, lower, upper, where):
    points = []
    for k in range(counts[2]):
        for j in range(counts[1]):
            for i in range(counts[0]):
                at = [lower[a] + (upper[a] - lower[a]) * n / (counts[a] - 1) for a, n in enumerate((i, j, k))]
                x, y, z = where(*at)
                points.append(f"point {{ x: {x:.4g} y: {y:.4g} z: {z:.4g} }}")
    rows = [" ".join(points[i:i + 6]) for i in range(0, len(points), 6)]
    box = " ".join(f"{side} {{ x: {v[0]} y: {v[1]} z: {v[2]} }}" for side, v in (("lower", lower), ("upper", upper)))
    return f"lattice {{ points_x: {counts[0]} points_y: {counts[1]} points_z: {counts[2]} {box}\n    " + "\n    ".join(
        rows) + " }"


def twist(turns, taper=0.0, lean=0.0):
    def where(x, y, z):
        a, s = 2 * math.pi * turns * y / 2, 1 - taper * y / 2
        return s * (x * math.cos(a) - z * math.sin(a)) + lean * math.sin(math.pi * y / 2), y, s * (
            x * math.sin(a) + z * math.cos(a))
    return where


def swell(by, squash):
    def where(x, y, z):
        s = 1 + by * math.cos(2.2 * y)
        return s * x, squash * y, s * z
    return where


column("column", 48, 40)
out.append("""
node { name: "air" environment { image: "noon" strength: 0.55 turn_deg: 40 background { r: 0.45 g: 0.55 b: 0.68 } \
show_image: true } }
node { name: "sun" transform { rotation { axis { x: -0.8 y: -0.45 z: 0.1 } angle_deg: 55 } } directional_light { color \
{ r: 1 g: 0.95 b: 0.86 } intensity: 0.8 shadows: true } }
node { name: "camera" transform { translation { x: 0.1 y: 1.35 z: 4.5 } rotation { axis { x: 1 } angle_deg: -13 } } \
camera { world_units_per_metre: 1 } }
node { name: "floor" transform { translation { y: -0.05 } } material: "chalk" box { size { x: 14 y: 0.1 z: 12 } } }
""")
bodies = ["\nnode { name: \"court\" transform { }"]
colors = ["coral", "sand", "teal", "ink", "moss", "plum", "sand"]
for n in range(7):
    x, turns = round(-3.3 + 1.1 * n, 3), 0.5 * (n - 3) / 3
    bodies.append(f'  node {{ name: "column {n}" transform {{ translation {{ x: {x:.3g} z: -1.6 }} }} material: '
                  f'"{colors[n]}" geometry {{ mesh: "column" }}\n    '
                  + lattice((2, 8, 2), (-0.23, 0, -0.23), (0.23, 2, 0.23),
                            twist(turns, 0.45, 0.25 * math.sin(1.7 * n))) + " }")
box = ((-0.45, -0.45, -0.45), (0.45, 0.45, 0.45))
for n in range(4):
    x = -2.4 + 1.6 * n
    bodies.append(f'  node {{ name: "ball {n}" transform {{ translation {{ x: {x:.3g} y: '
                  f'{0.45 * (0.6 + 0.25 * n):.3g} z: 0.2 }} }} material: "{colors[(n + 2) % 7]}" sphere {{ radius: '
                  f'0.45 segments: 48 }}\n    '
                  + lattice((4, 4, 4), *box, swell(0.4 - 0.2 * n, 0.6 + 0.25 * n)) + " }")
ring = ((-0.6, -0.13, -0.6), (0.6, 0.13, 0.6))
for n in range(3):
    x = -1.9 + 1.9 * n
    wave = lambda h: lambda px, py, pz: (px, py + h * math.cos(3 * math.atan2(pz, px)) * math.hypot(px, pz), pz)
    bodies.append(f'  node {{ name: "ring {n}" transform {{ translation {{ x: {x:.3g} y: 0.3 z: 1.6 }} }} material: '
                  f'"{colors[(n + 4) % 7]}"\n'
                  f'    torus {{ ring_radius: 0.45 pipe_radius: 0.12 ring_segments: 96 pipe_segments: 24 }}\n    '
                  + lattice((7, 2, 7), *ring, wave(0.12 + 0.12 * n)) + " }")
bodies.append("}\n\n# ---------------------------------------------------------------- who is bent or led into "
              "another is told of\n"
              + "\n".join(f'node {{ interest {{ object: "court/ring {n}" against: "court/ball {m}" response: REPORT '
                          f'}} }}' for n in range(3) for m in range(4)) + "\n")
out += bodies
with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "bent.tsct"), "w") as file:
    file.write("\n".join(out))
