#!/usr/bin/env python3
"""Makes the pictures beside it, which materials.tsct takes: 256 x 256 pixels each, the same every time."""
import math
import pathlib
import struct
import zlib

SIDE = 256


def write(name, of):
    """`of(u, v)`: red, green, blue, alpha, 0 to 1."""
    rows = bytearray()
    for y in range(SIDE):
        rows.append(0)
        for x in range(SIDE):
            rows += bytes(min(255, max(0, round(255 * value))) for value in of((x + 0.5) / SIDE, (y + 0.5) / SIDE))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", SIDE, SIDE, 8, 6, 0, 0, 0)
    path = pathlib.Path(__file__).parent / f"{name}.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(rows), 9)) +
                     chunk(b"IEND", b""))


def smooth(low, high, x):
    t = min(1.0, max(0.0, (x - low) / (high - low)))
    return t * t * (3 - 2 * t)


def noise(u, v, cells):
    """Smooth, repeating, 0 to 1."""
    def corner(i, j):
        n = (i % cells) * 374761393 + (j % cells) * 668265263 + cells * 974711
        n = (n ^ (n >> 13)) * 1274126177 & 0xFFFFFFFF
        return ((n ^ (n >> 16)) & 0xFFFF) / 0xFFFF
    x, y = u * cells, v * cells
    i, j = math.floor(x), math.floor(y)
    s, t = smooth(0, 1, x - i), smooth(0, 1, y - j)
    top = corner(i, j) * (1 - s) + corner(i + 1, j) * s
    return top * (1 - t) + (corner(i, j + 1) * (1 - s) + corner(i + 1, j + 1) * s) * t


def rough_noise(u, v):
    return sum(noise(u, v, 4 << k) / (2 << k) for k in range(5))


def tile_height(u, v):
    """Tiles in rows, each second one shifted, with round edges."""
    y = (v * 6) % 1
    x = (u * 4 + (0.5 if int(v * 6) % 2 else 0)) % 1
    edge = min(min(x, 1 - x) * 1.5, min(y, 1 - y))
    return smooth(0.02, 0.14, edge)


def tiles_normal(u, v):
    e = 0.5 / SIDE
    du = (tile_height(u + e, v) - tile_height(u - e, v)) / (2 * e)
    dv = (tile_height(u, v + e) - tile_height(u, v - e)) / (2 * e)
    x, y = -0.035 * du, 0.035 * dv  # green points against v
    size = math.sqrt(x * x + y * y + 1)
    return (0.5 + 0.5 * x / size, 0.5 + 0.5 * y / size, 0.5 + 0.5 / size, 1)


def tiles_occlusion(u, v):
    return (0.25 + 0.75 * tile_height(u, v), 0, 0, 1)


def tiles_color(u, v):
    row, column = int(v * 6), int(u * 4 + (0.5 if int(v * 6) % 2 else 0)) % 4
    tone = 0.75 + 0.25 * noise((column * 0.31 + row * 0.17) % 1, (row * 0.23) % 1, 8)
    clay = tile_height(u, v)
    return tuple(clay * c * tone + (1 - clay) * 0.45 for c in (0.78, 0.42, 0.30)) + (1,)


def worn(u, v):
    """Paint that has come off: where it is gone there is smooth metal (blue) below."""
    bare = smooth(0.44, 0.5, rough_noise(u, v))
    return (0, 0.85 - 0.6 * bare, bare, 1)


def worn_color(u, v):
    bare = smooth(0.44, 0.5, rough_noise(u, v))
    return tuple(a * (1 - bare) + b * bare for a, b in zip((0.10, 0.42, 0.47), (0.88, 0.80, 0.62))) + (1,)


def lattice(u, v):
    bars = min(abs(math.sin(math.pi * 8 * (u + v))), abs(math.sin(math.pi * 8 * (u - v))))
    return (0.88, 0.68, 0.30, 1 - smooth(0.30, 0.36, bars))


def windows(u, v):
    x, y = u * 12 % 1, v * 8 % 1
    lit = noise((int(u * 12) * 0.37) % 1, (int(v * 8) * 0.29) % 1, 16) > 0.45
    inside = smooth(0.18, 0.22, min(x, 1 - x)) * smooth(0.22, 0.28, min(y, 1 - y))
    glow = inside if lit else 0.0
    return (glow, 0.78 * glow, 0.42 * glow, 1)


def leaded(u, v):
    """Panes of coloured glass, and lead between them."""
    ring = (v * 5) % 1
    wedge = (u * 10 + (0.5 if int(v * 5) % 2 else 0)) % 1
    lead = 1 - smooth(0.05, 0.08, min(min(ring, 1 - ring), min(wedge, 1 - wedge)))
    hue = (int(u * 10 + (0.5 if int(v * 5) % 2 else 0)) * 0.37 + int(v * 5) * 0.21) % 1
    color = [0.55 + 0.45 * math.cos(2 * math.pi * (hue + shift)) for shift in (0, 0.33, 0.67)]
    return tuple((1 - lead) * c + lead * 0.05 for c in color) + (0.35 + 0.65 * lead,)


for name, of in (("tiles-normal", tiles_normal), ("tiles-occlusion", tiles_occlusion), ("tiles-color", tiles_color),
                 ("worn", worn), ("worn-color", worn_color), ("lattice", lattice), ("windows", windows),
                 ("leaded", leaded)):
    write(name, of)
