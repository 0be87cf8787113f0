#!/usr/bin/env python3
"""Makes the pictures beside it, which gloss.tsct lays over its balls, the same every time."""
import math
import pathlib
import struct
import zlib


def write(name, width, height, of):
    """`of(u, v)`: red, green, blue, alpha, 0 to 1."""
    rows = bytearray()
    for y in range(height):
        rows.append(0)
        for x in range(width):
            rows += bytes(min(255, max(0, round(255 * value))) for value in of((x + 0.5) / width, (y + 0.5) / height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    path = pathlib.Path(__file__).parent / f"{name}.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(rows), 9)) +
                     chunk(b"IEND", b""))


def smooth(low, high, x):
    t = min(1.0, max(0.0, (x - low) / (high - low)))
    return t * t * (3 - 2 * t)


def clay(u, v):
    """A sphere map: warm light from the upper left, a cold rim, dark below."""
    x, y = 2 * u - 1, 1 - 2 * v
    r = min(1.0, math.hypot(x, y))
    z = math.sqrt(1 - r * r)
    key = max(0.0, -0.5 * x + 0.6 * y + 0.62 * z)
    rim = smooth(0.75, 1.0, r) * max(0.0, x)
    return 0.25 + 0.7 * key, 0.16 + 0.52 * key + 0.3 * rim, 0.12 + 0.38 * key + 0.7 * rim, 1.0


def studio(u, v):
    """All around: a grey room with two bright windows and a red wall behind."""
    sky = 0.75 - 0.6 * v
    window = max(smooth(0.08, 0.05, abs(u - 0.3)),
                 smooth(0.05, 0.03, abs(u - 0.62))) * smooth(0.16, 0.12, abs(v - 0.36))
    red = 0.35 * smooth(0.3, 0.45, abs(u - 0.5))
    grid = 0.15 * max(smooth(0.94, 0.98, abs(math.cos(16 * math.pi * u))),
                      smooth(0.94, 0.98, abs(math.cos(8 * math.pi * v))))
    return sky + window + red - grid, sky + window - grid, sky + window - grid, 1.0


def sticker(u, v):
    """A star that covers nothing around it."""
    x, y = 2 * u - 1, 1 - 2 * v
    angle, r = math.atan2(x, y), math.hypot(x, y)
    edge = 0.42 + 0.28 * math.cos(5 * angle)
    inside = smooth(edge + 0.02, edge - 0.02, r)
    return 0.95, 0.85, 0.2, inside


def stripes(u, v):
    dark = smooth(0.45, 0.55, abs(2 * ((4 * (u + v)) % 1.0) - 1))
    return 0.35 + 0.65 * dark, 0.5 + 0.5 * dark, 0.65 + 0.35 * dark, 1.0


write("clay", 128, 128, clay)
write("studio", 512, 256, studio)
write("sticker", 128, 128, sticker)
write("stripes", 128, 128, stripes)
