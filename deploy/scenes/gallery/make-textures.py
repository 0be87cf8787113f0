#!/usr/bin/env python3
"""Writes the pictures of 41-texture-shapes.tsct beside it, the same every time: a line, a solid and a cube, each as one PNM file whose pictures lie
below each other."""
import math
import pathlib

HERE = pathlib.Path(__file__).resolve().parent


def write(name, width, height, of):
    """`of(x, y)`: red, green, blue, 0 to 1."""
    data = bytes(min(255, max(0, round(255 * part))) for y in range(height) for x in range(width) for part in of(x, y))
    (HERE / f"{name}.ppm").write_bytes(b"P6\n%d %d\n255\n" % (width, height) + data)


def spectrum(x, _):
    """Once through all hues, in 16 steps."""
    hue = x / 16
    return [0.5 + 0.45 * math.cos(2 * math.pi * (hue - shift / 3)) for shift in range(3)]


SIDE = 32


def marble(x, y):
    """Veins through a block of stone; y counts its layers, too."""
    p = [x / SIDE, y % SIDE / SIDE, y // SIDE / SIDE]
    bend = sum(math.sin(math.tau * (f * p[i] + 0.3 * i) + 3 * math.sin(math.tau * f * p[(i + 1) % 3])) / f for i in range(3) for f in (1, 2))
    vein = abs(math.sin(math.pi * (p[0] + p[1] + p[2]) * 2 + bend)) ** 0.6
    return 0.25 + 0.6 * vein, 0.2 + 0.62 * vein, 0.22 + 0.55 * vein


FACE = 32
FACES = [(0.8, 0.25, 0.2), (0.2, 0.55, 0.3), (0.55, 0.7, 0.95), (0.3, 0.25, 0.2), (0.95, 0.8, 0.35), (0.45, 0.3, 0.65)]  # +x, -x, +y, -y, +z, -z


def faces(x, y):
    """A colour for each, a lighter disc in its middle, a dark rim."""
    face, v = divmod(y, FACE)
    if min(x, v, FACE - 1 - x, FACE - 1 - v) < 1:
        return 0.05, 0.05, 0.06
    disc = math.hypot(x - FACE / 2 + 0.5, v - FACE / 2 + 0.5) < 0.3 * FACE
    return [part + (0.9 - part) * 0.7 * disc for part in FACES[face]]


write("spectrum", 16, 1, spectrum)
write("marble", SIDE, SIDE * SIDE, marble)
write("faces", FACE, 6 * FACE, faces)
