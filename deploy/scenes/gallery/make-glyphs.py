#!/usr/bin/env python3
"""Writes 64-glyphs.tsct: python3 deploy/scenes/gallery/make-glyphs.py"""
import math
import pathlib
import random

random.seed(3)


def numbers(values):
    return "[" + ",".join(f"{value:.4g}" for value in values) + "]"


def node(x, material, fields):
    return (f'node {{ transform {{ translation {{ x: {x:g} y: 1.45 z: -0.5 }} }} material: "{material}"\n'
            f"  glyphs {{ {' '.join(f'{name}: {value}' for name, value in fields.items())} }} }}")


def vortex():
    """Arrows that go around an axis, the faster the nearer."""
    places, vectors, speeds = [], [], []
    for k in range(7):
        for ring in range(1, 6):
            for i in range(5 * ring):
                angle, radius = 2 * math.pi * (i + 0.3 * k) / (5 * ring), 0.085 * ring
                speed = 1.2 / (0.6 + ring * 0.35)
                places += [radius * math.cos(angle), 0.2 * (k - 3), radius * math.sin(angle)]
                vectors += [-speed * math.sin(angle), 0.45, speed * math.cos(angle)]
                speeds.append(speed)
    return {"positions": numbers(places), "vectors": numbers(vectors), "scalars": numbers(speeds), "size": 0.14,
            "low": 0.5, "high": 1.2, "transfer": "[0x2850DCFF, 0x3CC88CFF, 0xFADC3CFF, 0xE63C28FF]"}


def bars():
    """Boxes as high as what was measured."""
    places, heights = [], []
    for x in range(7):
        for z in range(7):
            places += [0.1 * (x - 3), -0.55, 0.1 * (z - 3)]
            heights.append(0.3 + 7 * math.exp(-((x - 2) ** 2 + (z - 4) ** 2) / 5))
    # From 0 up, not around 0: a mesh of one's own.
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (0, 1) for z in (-0.5, 0.5)]
    faces = "[0,1,3,0,3,2,4,6,7,4,7,5,0,4,5,0,5,1,2,3,7,2,7,6,0,2,6,0,6,4,1,5,7,1,7,3]"
    return {"positions": numbers(places), "scalars": numbers(heights), "shape": "MESH",
            "shape_positions": numbers(v for corner in corners for v in corner), "shape_indices": faces,
            "size": 0.085, "length_by": "SCALAR", "width_by": "NOTHING", "low": 0, "high": 8,
            "transfer": "[0x3C465AFF, 0xF0B446FF]"}


def ball_of(shape, count, extra):
    """Shapes on a sphere that point outwards."""
    places, vectors = [], []
    for i in range(count):
        y = 1 - 2 * (i + 0.5) / count
        angle, r = i * math.pi * (3 - math.sqrt(5)), math.sqrt(1 - y * y)
        normal = [r * math.cos(angle), y, r * math.sin(angle)]
        places += [0.27 * v for v in normal]
        vectors += [v * (0.6 + 0.5 * y) for v in normal]
    return {"positions": numbers(places), "vectors": numbers(vectors), "shape": shape, **extra}


def main():
    balls = ball_of("BALL", 120, {
        "scalars": numbers(0.4 + random.random() for _ in range(120)), "width_by": "SCALAR",
        "length_by": "SCALAR", "color_by": "VECTOR", "size": 0.06, "low": 0.1, "high": 1.1,
        "transfer": "[0xE6E6F0FF, 0xC8285AFF]"})
    boxes = ball_of("BOX", 150, {
        "color_by": "NOTHING", "length_by": "NOTHING", "width_by": "VECTOR", "size": 0.07,
        "colors": "[" + ",".join(f"0x{random.randrange(60, 256):02X}{random.randrange(60, 256):02X}5AFF"
                                 for _ in range(150)) + "]"})
    lines = ["# Glyphs: arrows of a flow, bars of a mesh of one's own, balls and boxes by vector and scalar",
             'material { name: "paint" base_color { r: 0.9 g: 0.9 b: 0.9 } roughness: 0.35 }',
             node(-0.85, "paint", vortex()), node(0, "paint", bars()),
             node(0.62, "paint", balls).replace("y: 1.45", "y: 1.9"),
             node(0.85, "paint", boxes).replace("y: 1.45", "y: 1.15")]
    (pathlib.Path(__file__).parent / "64-glyphs.tsct").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
