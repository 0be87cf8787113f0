#!/usr/bin/env python3
"""Writes ../city.tsct: streets between 16 x 16 blocks of houses, with trees, lamps and cars: 13,000 things, of which
few can be seen from a street at a time. Units are metres, a block is 24 of them, y is up."""
import os
import random

random.seed(7)
BLOCKS = 8  # in each direction from the middle
PITCH = 24

HEAD = """# A city of 16 by 16 blocks on a clear morning, and somebody who walks down one of its streets: what is to \
be culled is behind houses.
# Written by city/make-city.py. Units are metres.

image { name: "noon" uri: "lights/noon.hdr" }

# ---------------------------------------------------------------- materials
"""
MATERIALS = {
    "asphalt": "base_color { r: 0.085 g: 0.088 b: 0.095 } roughness: 0.9",
    "pavement": "base_color { r: 0.36 g: 0.35 b: 0.33 } roughness: 0.9",
    "line": "base_color { r: 0.75 g: 0.74 b: 0.70 } roughness: 0.8",
    "brick": "base_color { r: 0.40 g: 0.17 b: 0.11 } roughness: 0.85",
    "sand": "base_color { r: 0.62 g: 0.53 b: 0.39 } roughness: 0.85",
    "chalk": "base_color { r: 0.72 g: 0.70 b: 0.65 } roughness: 0.8",
    "slate": "base_color { r: 0.22 g: 0.25 b: 0.29 } roughness: 0.7",
    "ochre": "base_color { r: 0.62 g: 0.37 b: 0.13 } roughness: 0.85",
    "rose": "base_color { r: 0.60 g: 0.36 b: 0.32 } roughness: 0.85",
    "pane": "base_color { r: 0.05 g: 0.075 b: 0.10 } metallic: 0.3 roughness: 0.12",
    "cornice": "base_color { r: 0.55 g: 0.53 b: 0.49 } roughness: 0.8",
    "tin": "base_color { r: 0.45 g: 0.47 b: 0.49 } metallic: 0.8 roughness: 0.45",
    "bark": "base_color { r: 0.17 g: 0.11 b: 0.07 } roughness: 0.95",
    "leaves": "base_color { r: 0.10 g: 0.26 b: 0.06 } roughness: 0.9",
    "lime": "base_color { r: 0.22 g: 0.36 b: 0.07 } roughness: 0.9",
    "iron": "base_color { r: 0.06 g: 0.07 b: 0.075 } roughness: 0.5",
    "opal": "base_color { r: 0.9 g: 0.88 b: 0.8 } roughness: 0.3",
    "tyre": "base_color { r: 0.03 g: 0.03 b: 0.03 } roughness: 0.9",
    "red": "base_color { r: 0.55 g: 0.04 b: 0.03 } roughness: 0.25 clearcoat: 1",
    "blue": "base_color { r: 0.04 g: 0.13 b: 0.38 } roughness: 0.25 clearcoat: 1",
    "white": "base_color { r: 0.80 g: 0.80 b: 0.78 } roughness: 0.25 clearcoat: 1",
    "green": "base_color { r: 0.05 g: 0.24 b: 0.14 } roughness: 0.25 clearcoat: 1",
    "awning": "base_color { r: 0.62 g: 0.10 b: 0.08 } roughness: 0.9 double_sided: true",
}
WALLS = ["brick", "sand", "chalk", "slate", "ochre", "rose"]


def at(x=0.0, y=0.0, z=0.0, turn=0):
    rotation = f" rotation {{ axis {{ y: 1 }} angle_deg: {turn} }}" if turn else ""
    return f"transform {{ translation {{ x: {x:g} y: {y:g} z: {z:g} }}{rotation} }}"


def box(x, y, z):
    return f"box {{ size {{ x: {x:g} y: {y:g} z: {z:g} }} }}"


def house(floors):
    """16 by 16 with a shop below, windows in rows on four sides, a cornice and something on the roof."""
    top = 4.2 + 3.1 * floors
    lines = [
        f'  node {{ {at(y=top / 2)} {box(16, top, 16)} }}',
        f'  node {{ material: "pane" {at(y=1.9)} {box(16.12, 2.6, 14.6)} }}',
        f'  node {{ material: "pane" {at(y=1.9)} {box(14.6, 2.6, 16.12)} }}',
        f'  node {{ material: "cornice" {at(y=4.0)} {box(16.5, 0.3, 16.5)} }}',
        f'  node {{ material: "cornice" {at(y=top)} {box(16.8, 0.5, 16.8)} }}',
        f'  node {{ material: "awning" transform {{ translation {{ y: 3.5 z: 8.7 }} rotation {{ axis {{ x: 1 }} '
        f'angle_deg: 24 }} }} {box(9, 0.06, 1.7)} }}',
        f'  node {{ {at(x=-3.5, y=top + 1.3, z=2)} {box(4, 2.6, 4)} }}',
        f'  node {{ material: "tin" {at(x=4, y=top + 1.4, z=-3)} cylinder {{ radius: 1.5 height: 2.4 segments: 20 }} '
        f'}}',
    ]
    # Two bands of windows per floor, so that corners stay walls, and pillars before them.
    for name, size in (("bands", (16.12, 1.8, 13.4)), ("other bands", (13.4, 1.8, 16.12))):
        lines.append(f'  node {{ name: "{name}" material: "pane" {at(y=6.1)} repeat {{ count: {floors} step {{ y: 3.1 '
                     f'}} }} {box(*size)} }}')
    for name, size, step in (("pillars", (0.5, top - 4.4, 16.3), "x"), ("other pillars", (16.3, top - 4.4, 0.5), "z")):
        lines.append(f'  node {{ name: "{name}" {at(**{step: -4.5}, y=(top + 4.2) / 2)} repeat {{ count: 4 step {{ '
                     f'{step}: 3 }} }} {box(*size)} }}')
    return f'definition {{\n  name: "house of {floors}"\n' + "\n".join(lines) + "\n}\n"


def block(number, rng):
    """What stands on the pavement around a house: its sides are streets, so that each block has two of them."""
    lines = [f'  node {{ material: "pavement" {at(y=0.07)} {box(19, 0.14, 19)} }}']
    for side in range(4):
        trees = rng.choice([2, 3])
        lines.append(f'  node {{ transform {{ rotation {{ axis {{ y: 1 }} angle_deg: {90 * side} }} }}')
        for i in range(trees):
            x, tall = -7.5 + 15 * (i + rng.uniform(0.3, 0.7)) / trees, rng.uniform(2.6, 3.8)
            crown = rng.choice(["leaves", "lime"])
            lines += [
                f'    node {{ material: "bark" {at(x, tall / 2, 9.1)} cylinder {{ radius: 0.13 height: {tall:.2f} '
                f'segments: 10 }} }}',
                f'    node {{ material: "{crown}" transform {{ translation {{ x: {x:.2f} y: {tall + 0.9:.2f} z: 9.1 '
                f'}} scale {{ x: 1 y: {rng.uniform(1, 1.4):.2f} z: 1 }} }} sphere {{ radius: '
                f'{rng.uniform(1.0, 1.35):.2f} segments: 28 }} }}',
            ]
        lamp = rng.uniform(-8, 8)
        lines += [
            f'    node {{ material: "iron" {at(lamp, 2.3, 9.3)} cylinder {{ radius: 0.06 height: 4.6 segments: 10 }} '
            f'}}',
            f'    node {{ material: "opal" {at(lamp, 4.75, 9.3)} sphere {{ radius: 0.24 segments: 14 }} }}',
        ]
        for _ in range(rng.choice([0, 1, 1, 2])):
            x = rng.uniform(-6, 6)
            lines.append(f'    node {{ material: "{rng.choice(["red", "blue", "white", "green"])}" {at(x, 0, 10.6)} '
                         f'instance: "car" }}')
        lines.append("  }")
    return f'definition {{\n  name: "block {number}"\n' + "\n".join(lines) + "\n}\n"


CAR = """definition {
  name: "car"
  node { transform { translation { y: 0.55 } } box { size { x: 4.1 y: 0.55 z: 1.7 } } }
  node { transform { translation { x: -0.2 y: 1.05 } } box { size { x: 2.1 y: 0.5 z: 1.5 } } }
  node { material: "pane" transform { translation { x: -0.2 y: 1.06 } } box { size { x: 2.16 y: 0.34 z: 1.54 } } }
  node { material: "tyre" transform { translation { x: -1.3 y: 0.33 z: -0.78 } rotation { axis { x: 1 } angle_deg: 90 \
} } repeat { count: 2 step { z: 1.56 } } cylinder { radius: 0.33 height: 0.2 segments: 18 } }
  node { material: "tyre" transform { translation { x: 1.3 y: 0.33 z: -0.78 } rotation { axis { x: 1 } angle_deg: 90 } \
} repeat { count: 2 step { z: 1.56 } } cylinder { radius: 0.33 height: 0.2 segments: 18 } }
}
"""


def city():
    text = HEAD
    for name, looks in MATERIALS.items():
        text += f'material {{ name: "{name}" {looks} }}\n'
    text += "\n# ---------------------------------------------------------------- what stands in many places\n" + CAR
    floors = [3, 4, 5, 6, 7, 9, 11]
    text += "".join(house(n) for n in floors)
    text += "".join(block(i, random) for i in range(6))
    text += "\n# ---------------------------------------------------------------- the city\n"
    size = 2 * BLOCKS * PITCH
    text += f'node {{ name: "ground" material: "asphalt" {at(y=-0.1)} {box(size, 0.2, size)} }}\n'
    text += f'node {{ name: "lines" material: "line"\n'
    for turn in (0, 90):
        text += f'  node {{ transform {{ rotation {{ axis {{ y: 1 }} angle_deg: {turn} }} }}\n'
        text += (f'    node {{ {at(x=-PITCH * (BLOCKS - 1), y=0.005)} repeat {{ count: {2 * BLOCKS - 1} step {{ x: '
                 f'{PITCH} }} }}\n'
                 f'      node {{ {at(z=-size / 2 + 8)} repeat {{ count: {2 * BLOCKS} step {{ z: {PITCH} }} }} '
                 f'{box(0.14, 0.02, 8)} }} }} }}\n')
    text += "}\n"
    text += 'node { name: "blocks"\n'
    for i in range(-BLOCKS, BLOCKS):
        for k in range(-BLOCKS, BLOCKS):
            far = max(abs(i + 0.5), abs(k + 0.5))
            tall = random.choice(floors if far < 5 else floors[:4])
            place = at(PITCH * i + PITCH / 2, 0, PITCH * k + PITCH / 2, random.choice([0, 90, 180, 270]))
            text += (f'  node {{ name: "block" {place} node {{ instance: "block {random.randrange(6)}" }} '
                     f'node {{ material: "{random.choice(WALLS)}" instance: "house of {tall}" }} }}\n')
    text += "}\n"
    text += """
# ---------------------------------------------------------------- light
node { name: "air" environment { image: "noon" strength: 0.55 show_image: true background { } } }
node { name: "sun" transform { rotation { axis { y: 1 } angle_deg: 21 } } node { transform { rotation { axis { x: 1 } \
angle_deg: -47 } } directional_light { color { r: 1 g: 0.93 b: 0.80 } intensity: 2.2 shadows: true } } }

# ---------------------------------------------------------------- who walks there
node { name: "walker"
  transform { translation { x: 0 y: 0.1 z: 130 } }
  motion { mode: PING_PONG
    key { time: 0 transform { translation { x: 0 y: 0.1 z: 130 } rotation { axis { y: 1 } angle_deg: 4 } } }
    key { time: 4 transform { translation { x: 1.2 y: 0.1 z: 122 } rotation { axis { y: 1 } angle_deg: -9 } } }
    key { time: 9 transform { translation { x: -1.2 y: 0.1 z: 110 } rotation { axis { y: 1 } angle_deg: 10 } } }
  }
  node { name: "camera" transform { translation { y: 1 } rotation { axis { x: 1 } angle_deg: 5 } } camera { \
world_units_per_metre: 1 } }
}
"""
    return text


if __name__ == "__main__":
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "city.tsct"), "w",
              encoding="utf-8") as file:
        file.write(city())
