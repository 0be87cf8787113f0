#!/usr/bin/env python3
"""Writes ../techniques.tsct: one pair of models, a knob that a hand leads over a hill and into it, looked at in nine
ways side by side. What stands beside each, the gap as the hand begins, its error and what a question takes, is measured
by tessera-collide on the same pair:

    deploy/scenes/techniques/make-techniques.py out/bin/tessera-collide > deploy/scenes/techniques.tsct
    deploy/scenes/techniques/make-techniques.py --models FOLDER    # hill.obj, knob.obj, knob-control.obj, knob.ply,
    poses.txt
"""
import json
import math
import os
import subprocess
import sys
import tempfile

RADIUS = 0.1
POINT_RADIUS = 0.007
# The hand: seconds, and where it stands.
PATH = [(0, (0, 0.09, 0)), (1.5, (0.03, 0.0, 0.02)), (2.5, (-0.04, -0.03, 0)), (4, (0, 0.09, 0))]
START = (0.0, 0.16, 0.0)  # of the knob over the hill, the hand at nothing


def sphere_grid(n):
    """A cube of n × n faces a side, as quadrilaterals seen from outside, blown up to a bumpy ball."""
    numbers, points, faces = {}, [], []

    def vertex(p):
        if p not in numbers:
            numbers[p] = len(points)
            d = [math.tan(math.pi / 4 * (2 * x / n - 1)) for x in p]
            length = math.sqrt(sum(x * x for x in d))
            d = [x / length for x in d]
            bumps = 1 + 0.22 * math.sin(3.1 * d[0] + 1) * math.sin(2.7 * d[1]) + 0.16 * math.cos(3.3 * d[2] + 2 * d[0])
            points.append([1.12 * RADIUS * bumps * x for x in d])
        return numbers[p]

    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, n):
            for i in range(n):
                for j in range(n):
                    corners = []
                    for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        p = [0, 0, 0]
                        p[axis], p[u], p[v] = side, i + a, j + b
                        corners.append(vertex(tuple(p)))
                    faces.append(corners if side else corners[::-1])
    return points, faces


def mean(points):
    return [sum(p[k] for p in points) / len(points) for k in range(3)]


def refined(points, faces):
    """Catmull and Clark, of a closed surface."""
    centres = [mean([points[v] for v in f]) for f in faces]
    edges, around = {}, [([], []) for _ in points]
    for f, face in enumerate(faces):
        for i, v in enumerate(face):
            edges.setdefault(tuple(sorted((v, face[(i + 1) % 4]))), []).append(f)
            around[v][0].append(f)
    for a, b in edges:
        around[a][1].append(b)
        around[b][1].append(a)
    out = []
    for v, (touching, ends) in enumerate(around):
        n = len(touching)
        q, r = mean([centres[f] for f in touching]), mean(
            [[(points[v][k] + points[e][k]) / 2 for k in range(3)] for e in ends])
        out.append([(q[k] + 2 * r[k] + (n - 3) * points[v][k]) / n for k in range(3)])
    number = {}
    for (a, b), (f, g) in edges.items():
        number[a, b] = len(out)
        out.append(mean([points[a], points[b], centres[f], centres[g]]))
    first = len(out)
    quads = []
    for f, face in enumerate(faces):
        for i, v in enumerate(face):
            after, before = face[(i + 1) % 4], face[i - 1]
            quads.append([v, number[tuple(sorted((v, after)))], first + f, number[tuple(sorted((before, v)))]])
    return out + centres, quads


def limit(points, faces):
    """Where vertices tend to."""
    near = [(set(), set()) for _ in points]
    for face in faces:
        for i, v in enumerate(face):
            near[v][0].update((face[(i + 1) % 4], face[i - 1]))
            near[v][1].add(face[(i + 2) % 4])
    out = []
    for v, (edges, across) in enumerate(near):
        n = len(edges)
        out.append([(n * n * points[v][k] + 4 * sum(points[e][k]
                                                    for e in edges) + sum(points[d][k] for d in across)) / (
                                                        n * (n + 5)) for k in range(3)])
    return out


def hill(columns=48, rows=32):
    points, faces = [], []
    for j in range(rows + 1):
        for i in range(columns + 1):
            x, z = 0.44 * (i / columns - 0.5), 0.3 * (j / rows - 0.5)
            points.append([x, 0.05 * math.cos(9 * x) * math.cos(8 * z) + 0.008 * math.sin(50 * x
                                                                                          + 1) * math.cos(45 * z), z])
    for j in range(rows):
        for i in range(columns):
            a = j * (columns + 1) + i
            faces += [[a, a + columns + 1, a + 1], [a + 1, a + columns + 1, a + columns + 2]]
    return points, faces


def triangles(faces):
    return [t for f in faces for t in ([f] if len(f) == 3 else [[f[0], f[1], f[2]], [f[0], f[2], f[3]]])]


def number(x):
    return f"{x:.5g}"


def obj(points, faces):
    return "".join("v " + " ".join(map(number, p)) + "\n" for p in points) + "".join(
        "f " + " ".join(str(v + 1) for v in f) + "\n" for f in faces)


def ply(points):
    return (f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\nproperty float "
            f"z\nend_header\n" +
            "".join(" ".join(map(number, p)) + "\n" for p in points))


def poses(count=400):
    """Along the hand's path, evenly in time."""
    lines = []
    for k in range(count):
        t = PATH[-1][0] * k / (count - 1)
        i = max(i for i in range(len(PATH) - 1) if PATH[i][0] <= t)
        (t0, a), (t1, b) = PATH[i], PATH[i + 1]
        s = (t - t0) / (t1 - t0)
        lines.append(" ".join(number(START[c] + a[c] + s * (b[c] - a[c])) for c in range(3)) + " 1 0 0 0\n")
    return "".join(lines)


CONTROL = sphere_grid(4)
MESH = CONTROL
for _ in range(2):
    MESH = refined(*MESH)
MESH = (limit(*MESH), triangles(MESH[1]))
HILL = hill()

# Name, what the knob is, its collision_object, the hill's, and the words of tessera-collide.
STALLS = [
    ("triangles", "mesh", "shape: TRIANGLES", "", []),
    ("sphere levels", "mesh", "level: 5", "", ["--level-b", "5"]),
    ("distance field", "mesh", "shape: DISTANCE_FIELD error: 1", "", ["--as-b", "distance-field", "--error", "1"]),
    ("spherical field", "mesh", "shape: SPHERICAL", "", ["--as-b", "spherical"]),
    ("spherical Bézier", "mesh", "shape: SPHERICAL_BEZIER", "", ["--as-b", "spherical-bezier"]),
    ("freeform", "smooth", "shape: FREEFORM error: 0.1", "", ["--as-b", "subdivision", "--tolerance", "1e-4"]),
    ("height field", "mesh", "shape: TRIANGLES", "shape: HEIGHTFIELD", ["--as-a", "heightfield"]),
    ("points", "points", "shape: POINTS", "", ["--as-b", "points", "--radius", number(POINT_RADIUS)]),
    ("hull", "mesh", "shape: HULL", "", ["--as-b", "hull"]),
]


def write_models(folder):
    for name, text in (("hill.obj", obj(*HILL)), ("knob.obj", obj(*MESH)), ("knob-control.obj", obj(*CONTROL)),
                       ("knob.ply", ply(MESH[0])),
                        ("poses.txt", poses())):
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write(text)


def measured(program, folder, words):
    """The gap as the hand begins, its error, and the median of what yes or no and a distance take, in µs: the best of
    three runs."""
    knob = "knob-control.obj" if "subdivision" in words else "knob.ply" if "points" in words else "knob.obj"
    said = {}
    for query in ("any", "distance"):
        runs = []
        for _ in range(3):
            out = subprocess.run([program, "hill.obj", knob, "--poses", "poses.txt", "--query", query, "--json",
                                  "--time", *words],
                                 cwd=folder, check=True, capture_output=True, text=True).stdout.splitlines()
            runs.append(json.loads(out[-1])["median_us"])
        said[query] = min(runs)
        said["answer"] = json.loads(out[0])
    answer = said["answer"]
    return answer["distance"], answer.get("error", 0), said["any"], said["distance"]


def micro(us):
    return f"{us:.1f} µs" if us < 100 else f"{us / 1000:.2f} ms"


def mesh(name, points, faces):
    xyz = ", ".join(number(x) for p in points for x in p)
    index = ", ".join(str(v) for f in faces for v in f)
    return f'mesh {{ name: "{name}"\n  position: [{xyz}]\n  index: [{index}] }}\n'


def label(name, x, y, size, text, material):
    return (f'node {{ name: "{name}" transform {{ translation {{ x: {number(x)} y: {number(y)} z: -0.325 }} }}\n'
            f'  material: "{material}" text {{ text: "{text}" font: "DejaVu Sans" size: {size} line_spacing: 1.3 }} '
            f'}}\n')


def scene(numbers):
    knob = {
        "mesh": 'geometry { mesh: "knob" }',
        "points": 'geometry { mesh: "knob points" }',
        "smooth": "subdivision_surface {\n    points: ["
        + ", ".join(number(x) for p in CONTROL[0] for x in p) + "]\n    face_vertices: [" +
                  ", ".join(str(v) for f in CONTROL[1] for v in f) + "] }",
    }
    text = """# One pair of models, looked at in nine ways: a hand leads nine equal knobs over nine equal hills and \
into them. The line between
# the nearest points is a ruler, balls mark where they touch; `tessera-ctl contacts --distances` tells the numbers as \
they are now, and
# `tessera-ctl move /hand 0 -0.02 0 --by` moves the hand (the motion stands still then).
#
# Beside each pair: the gap as the hand begins, its error, and the median over the hand's path of what yes or no and a \
distance take.
# These were measured by tessera-collide on the same pair, one thread (techniques/make-techniques.py, which writes \
this file, does it):
#     tessera-collide hill.obj knob.obj --poses poses.txt --query distance --time --as-b distance-field
# Spherical Bézier patches only reject, so distances are those of triangles, and yes or no costs the look at the \
patches besides.

material { name: "wall"  base_color { r: 0.72 g: 0.74 b: 0.76 } roughness: 0.9 }
material { name: "hill"  base_color { r: 0.30 g: 0.45 b: 0.22 } roughness: 0.8 double_sided: true }
material { name: "knob"  base_color { r: 0.75 g: 0.35 b: 0.08 } roughness: 0.4 }
material { name: "ink"   base_color { r: 0.03 g: 0.04 b: 0.06 } roughness: 0.8 }
material { name: "title" base_color { r: 0.45 g: 0.05 b: 0.04 } roughness: 0.8 }

# From a little above.
node { name: "camera" transform { translation { y: 0.093 z: 0.357 } rotation { axis { x: -1 } angle_deg: 14 } } camera \
{} }
node { name: "sun" transform { rotation { axis { x: -0.9 y: -0.5 z: 0.1 } angle_deg: 40 } } directional_light { \
intensity: 0.75 } }
node { name: "sky" environment { sky { r: 0.26 g: 0.28 b: 0.31 } ground { r: 0.16 g: 0.15 b: 0.14 } background { r: \
0.2 g: 0.22 b: 0.25 } } }
node { name: "wall" material: "wall" transform { translation { y: 1.5 z: -0.36 } } box { size { x: 4.4 y: 2.6 z: 0.04 \
} }
  node { collision_object { layers: 0 } } }

"""
    text += mesh("hill", *HILL) + mesh("knob", *MESH)
    text += (f'mesh {{ name: "knob points" primitive: POINTS point_radius: {number(POINT_RADIUS)}\n  position: [' +
             ", ".join(number(x) for p in MESH[0] for x in p) + "] }\n\n")
    hills, knobs, labels, rules = "", "", "", ""
    for i, (name, kind, own, ground, _) in enumerate(STALLS):
        column, row = i % 3, i // 3
        x, y = 1.03 * (column - 1) + 0.02, 2.1 - 0.6 * row
        key = name.replace("é", "e")
        object_ = f"\n    node {{ collision_object {{ {own} }} }}"
        hills += (f'  node {{ name: "{key}" transform {{ translation {{ x: {number(x - 0.27)} y: {number(y - 0.17)} '
                  f'z: -0.1 }} }}\n'
                  f'    node {{ material: "hill" geometry {{ mesh: "hill" }} }}\n    node {{ collision_object {{ '
                  f'kind: STATIC {ground} }} }} }}\n')
        knobs += (f'  node {{ name: "{key}" transform {{ translation {{ x: {number(x - 0.27 + START[0])} y: '
                  f'{number(y - 0.17 + START[1])} z: {number(START[2] - 0.1)} }} }}\n'
                  f'    node {{ material: "knob" {knob[kind]} }}{object_} }}\n')
        gap, error, any_, distance = numbers[i]
        labels += label(f"name of {key}", x + 0.05, y + 0.12, 0.062, name, "title")
        exact = {"points": "exact, of the balls", "hull": "exact, of the hull"}.get(name, "exact")
        says = f"gap {1000 * gap:.2f} mm\\n" + (f"error {1000 * error:.2g} mm" if error > 0
                                                else exact) + f"\\nyes or no {micro(any_)}\\ndistance {micro(distance)}"
        labels += label(f"of {key}", x + 0.05, y + 0.03, 0.046, says, "ink")
        rules += (f'  node {{ interest {{ object: "/hand/{key}" against: "/hills/{key}" mode: DISTANCE threshold: 0.3 '
                  f'response: REPORT show_points: true show_normals: true }} }}\n'
                  f'  node {{ interest {{ object: "/hand/{key}" against: "/hills/{key}" response: REPORT most_faces: '
                  f'100 show_points: true }} }}\n')
    keys = " ".join(f"key {{ time: {t} transform {{ translation {{ x: {p[0]} y: {p[1]} z: {p[2]} }} }} }}"
                    for t, p in PATH)
    text += f'node {{ name: "hills"\n{hills}}}\n'
    text += (f'node {{ name: "hand" transform {{ translation {{ y: {PATH[0][1][1]} }} }}\n{knobs}  node {{ name: '
             f'"motion" motion {{ mode: LOOP {keys} }} }}\n}}\n')
    return text + labels + f'node {{ name: "rules"\n{rules}}}\n'


def main():
    if len(sys.argv) == 3 and sys.argv[1] == "--models":
        write_models(sys.argv[2])
        return
    program = os.path.abspath(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        write_models(folder)
        numbers = [measured(program, folder, words) for *_, words in STALLS]
    sys.stdout.write(scene(numbers))


if __name__ == "__main__":
    main()
