#!/usr/bin/env python3
"""Writes ../turbine.tsct: a turbine of NURBS. Blades are cubic in both directions, what is round is rational and exact.

Units: metres. The axis is z, the wind comes from +z."""
import math
import os

R2 = math.sqrt(0.5)
CIRCLE = [(1, 0, 1), (1, 1, R2), (0, 1, 1), (-1, 1, R2), (-1, 0, 1), (-1, -1, R2), (0, -1, 1), (1, -1, R2), (1, 0, 1)]
CIRCLE_KNOTS = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]


def number(x):
    return f"{x:.5g}" if abs(x) > 1e-12 else "0"


def surface(points, degree_u, degree_v, count_u, weights=(), knot_u=(), knot_v=(), loops="", tolerance=0.0005):
    text = f"nurbs_surface {{ degree_u: {degree_u} degree_v: {degree_v} count_u: {count_u} tolerance: {tolerance}"
    if knot_u:
        text += f" knot_u: [{', '.join(map(str, knot_u))}]"
    if knot_v:
        text += f" knot_v: [{', '.join(map(str, knot_v))}]"
    if weights:
        text += f" weight: [{', '.join(f'{w:.17g}' for w in weights)}]"
    text += "\n    " + " ".join(f"point {{ x: {number(x)} y: {number(y)} z: {number(z)} }}" for x, y, z in points)
    return text + loops + " }"


def blade(root, tip, chord, twist, sweep):
    """Sections of a wing from root to tip, the last one without thickness: the blade is closed there."""
    # Round the section, from its trailing edge over its back to its nose and along its belly.
    section = [(1, 0.0), (0.75, 0.055), (0.4, 0.13), (0.08, 0.12), (-0.02, 0.03), (-0.02, -0.035), (0.1, -0.07),
               (0.45, -0.02), (0.8, 0.005), (1, 0.0)]
    stations = [0, 0.15, 0.35, 0.55, 0.75, 0.92, 0.99, 1, 1]
    points = []
    for k, s in enumerate(stations):
        radius = root + (tip - root) * s
        width = chord[0] + (chord[1] - chord[0]) * s
        if s > 0.9:
            width *= 1 - 0.35 * (s - 0.9) / 0.1
        turn = math.radians(twist[0] + (twist[1] - twist[0]) * s ** 0.8)
        thick = 0 if k == len(stations) - 1 else 1.25 - 0.6 * s
        for x, y in section:
            a, b = (x - 0.35) * width + sweep * s * s, y * thick * width
            points.append((a * math.cos(turn) - b * math.sin(turn), radius, a * math.sin(turn) + b * math.cos(turn)))
    return surface(points, 3, 3, len(section))


def revolved(profile, degree, loops="", knot_v=()):
    """Around z; the profile: radius and z."""
    points, weights = [], []
    for r, z in profile:
        for x, y, w in CIRCLE:
            points.append((x * r, y * r, z))
            weights.append(w)
    return surface(points, 2, degree, 9, weights, CIRCLE_KNOTS, knot_v, loops, 0.002)


def window(u, v, ru, rv):
    points = " ".join(f"point {{ x: {number(u + ru * x)} y: {number(v + rv * y)} }}" for x, y, _ in CIRCLE)
    weights = ", ".join(f"{w:.17g}" for _, _, w in CIRCLE)
    return (f"\n    loop {{ hole: true curve {{ degree: 2 knot: [{', '.join(map(str, CIRCLE_KNOTS))}] weight: "
            f"[{weights}] {points} }} }}")


def ring(name, count, phase, instance, material):
    nodes = []
    for k in range(count):
        angle = phase + 360 * k / count
        nodes.append(f'    node {{ name: "{name}[{k}]" transform {{ rotation {{ axis {{ z: 1 }} angle_deg: '
                     f'{number(angle)} }} }} material: "{material}" instance: "{instance}" }}')
    return "\n".join(nodes)


def main():
    hull = [(0.0, 0.62), (0.16, 0.62), (0.30, 0.42), (0.36, 0.15), (0.37, -0.12), (0.37, -0.2)]
    tail = [(0.37, -0.24), (0.37, -0.5), (0.33, -0.85), (0.2, -1.25), (0.05, -1.45), (0.0, -1.5)]
    # The casing's section, from its inner back over the lip to its outer back.
    casing = [(1.20, -1.0), (1.19, -0.6), (1.18, -0.2), (1.18, 0.15), (1.20, 0.42), (1.30, 0.5), (1.42, 0.42),
              (1.44, 0.1), (1.42, -0.4), (1.34, -0.8), (1.205, -1.02)]
    windows = "".join(window(0.5 + k, 0.62, 0.16, 0.05) for k in range(4)) + "".join(
        window(0.5 + k, 0.115, 0.16, 0.05) for k in range(4))
    text = f"""# A turbine of NURBS: nine blades turn past seven vanes and past a probe, and how near they come is \
drawn in every frame: both
# ends, and between them a ruler with a large tick per tenth of a metre and small ones per hundredth (per hundredth and
# thousandth where it is shorter than a tenth). `tessera-ctl contacts --distances` tells the numbers.
# Written by turbine/make-turbine.py. Blades are bicubic, hub and casing surfaces of revolution, exact; the casing is \
trimmed by circles.

material {{ name: "titanium" base_color {{ r: 0.62 g: 0.64 b: 0.68 }} metallic: 0.75 roughness: 0.32 double_sided: \
true }}
material {{ name: "vane" base_color {{ r: 0.78 g: 0.50 b: 0.22 }} metallic: 0.6 roughness: 0.36 double_sided: true }}
material {{ name: "hub" base_color {{ r: 0.55 g: 0.07 b: 0.04 }} roughness: 0.3 double_sided: true }}
material {{ name: "casing" base_color {{ r: 0.10 g: 0.20 b: 0.30 }} metallic: 0.2 roughness: 0.4 double_sided: true }}
material {{ name: "probe" base_color {{ r: 0.02 g: 0.02 b: 0.02 }} roughness: 0.5 }}
material {{ name: "floor" base_color {{ r: 0.24 g: 0.22 b: 0.20 }} roughness: 0.7 }}
material {{ name: "wall" base_color {{ r: 0.20 g: 0.23 b: 0.26 }} roughness: 0.9 }}

definition {{ name: "blade" node {{ name: "blade" {blade(0.3, 1.15, (0.36, 0.30), (28, 62), 0.06)} }} }}
definition {{ name: "vane" node {{ name: "vane" {blade(0.3, 1.17, (0.34, 0.34), (-62, -75), 0.0)} }} }}

node {{ name: "air" environment {{ sky {{ r: 0.42 g: 0.47 b: 0.55 }} ground {{ r: 0.20 g: 0.18 b: 0.16 }} background \
{{ r: 0.24 g: 0.28 b: 0.34 }} }} }}
node {{ name: "sun" transform {{ rotation {{ axis {{ x: -0.8 y: -0.5 z: 0.1 }} angle_deg: 50 }} }} directional_light \
{{ color {{ r: 1 g: 0.95 b: 0.86 }} intensity: 1.1 shadows: true }} }}
node {{ name: "lamp" transform {{ translation {{ x: -2 y: 1.5 z: 3 }} }} point_light {{ color {{ r: 0.8 g: 0.9 b: 1 }} \
intensity: 5 range: 12 }} }}
node {{ name: "floor" material: "floor" transform {{ translation {{ y: -1.8 }} }} box {{ size {{ x: 30 y: 0.2 z: 20 }} \
}} }}
node {{ name: "wall" material: "wall" transform {{ translation {{ y: 1 z: -3 }} }} box {{ size {{ x: 30 y: 10 z: 0.2 \
}} }} }}
node {{ name: "camera" transform {{ translation {{ x: 0.12 y: -2.45 z: 0.2 }} rotation {{ axis {{ y: 1 }} angle_deg: \
30 }} }} camera {{ world_units_per_metre: 1.6 }} }}

node {{ name: "turbine"
  node {{ name: "rotor" transform {{}}
    node {{ name: "hub" material: "hub" {revolved(hull, 3)} }}
    node {{ name: "blades"
{ring("blade", 9, 0, "blade", "titanium")} }}
    node {{ collision_object {{ shape: TRIANGLES }} }}
    node {{ motion {{ mode: LOOP key {{ time: 0 }} key {{ time: 4 transform {{ rotation {{ axis {{ z: 1 }} angle_deg: \
120 }} }} }}
      key {{ time: 8 transform {{ rotation {{ axis {{ z: 1 }} angle_deg: 240 }} }} }} key {{ time: 12 transform {{ \
rotation {{ axis {{ z: 1 }} angle_deg: 360 }} }} }} }} }} }}
  node {{ name: "stator" transform {{ translation {{ z: -0.42 }} }}
    node {{ name: "tail" material: "hub" transform {{ translation {{ z: 0.2 }} }} {revolved(tail, 3)} }}
    node {{ name: "vanes"
{ring("vane", 7, 0, "vane", "vane")} }}
    node {{ collision_object {{ kind: STATIC }} }} }}
  node {{ name: "casing" transform {{}} material: "casing"
    node {{ name: "shell" {revolved(casing, 3, windows)} }}
    node {{ name: "foot" transform {{ translation {{ x: -0.7 y: -1.45 z: -0.3 }} }} repeat {{ count: 2 step {{ x: 1.4 \
}} }} box {{ size {{ x: 0.25 y: 0.5 z: 0.5 }} }} }}
    node {{ collision_object {{ kind: STATIC }} }} }}
  node {{ name: "probe" material: "probe" transform {{ translation {{ x: 0.78 y: -0.2 z: 0.72 }} }}
    node {{ name: "stand" transform {{ translation {{ y: -0.7 }} }} cylinder {{ radius: 0.022 height: 1.4 segments: 24 \
}} }}
    node {{ name: "arm" transform {{ translation {{ z: -0.12 }} rotation {{ axis {{ x: 1 }} angle_deg: 90 }} }} \
cylinder {{ radius: 0.016 height: 0.25 segments: 24 }} }}
    node {{ name: "tip" transform {{ translation {{ z: -0.25 }} }} sphere {{ radius: 0.035 segments: 32 }} }}
    node {{ collision_object {{ kind: STATIC }} }} }}
  node {{ name: "clearance" interest {{ object: "rotor/blades" against: "stator/vanes" mode: DISTANCE threshold: 0.5 \
response: REPORT show_points: true show_normals: true }} }}
  node {{ name: "gap" interest {{ object: "rotor/blades" against: "probe" mode: DISTANCE threshold: 1 response: REPORT \
show_points: true show_normals: true }} }}
  node {{ name: "tips" interest {{ object: "rotor" against: "casing" response: STOP }} }} }}
"""
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "turbine.tsct"), "w") as file:
        file.write(text)


main()
