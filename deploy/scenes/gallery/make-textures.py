#!/usr/bin/env python3
"""Writes what rooms 1d, 41 and 42 show, the same every time: a line, a solid and a cube, each as one PNM file whose
pictures lie below each other; a card in each of the blocks that graphics cards read, and one of floats; a field of each
kind of number."""
import math
import pathlib
import struct

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
    bend = sum(math.sin(math.tau * (f * p[i] + 0.3 * i) + 3 * math.sin(math.tau * f * p[(i + 1) % 3])) / f
               for i in range(3) for f in (1, 2))
    vein = abs(math.sin(math.pi * (p[0] + p[1] + p[2]) * 2 + bend)) ** 0.6
    return 0.25 + 0.6 * vein, 0.2 + 0.62 * vein, 0.22 + 0.55 * vein


FACE = 32
# +x, -x, +y, -y, +z, -z
FACES = [(0.8, 0.25, 0.2), (0.2, 0.55, 0.3), (0.55, 0.7, 0.95), (0.3, 0.25, 0.2), (0.95, 0.8, 0.35), (0.45, 0.3, 0.65)]


def faces(x, y):
    """A colour for each, a lighter disc in its middle, a dark rim."""
    face, v = divmod(y, FACE)
    if min(x, v, FACE - 1 - x, FACE - 1 - v) < 1:
        return 0.05, 0.05, 0.06
    disc = math.hypot(x - FACE / 2 + 0.5, v - FACE / 2 + 0.5) < 0.3 * FACE
    return [part + (0.9 - part) * 0.7 * disc for part in FACES[face]]


WIDE, HIGH = 8, 4  # blocks of a card


def color(x, y):
    """Of a block: darker to the left, of another hue from row to row."""
    share = (x + 1) / WIDE
    return [share * part for part in ((0.9, 0.3, 0.2), (0.85, 0.7, 0.25), (0.3, 0.7, 0.4), (0.35, 0.5, 0.95))[y]]


def bc1(rgb):
    """All sixteen pixels of a block are the first of its two colours."""
    r, g, b = (round(part * most) for part, most in zip(rgb, (31, 63, 31)))
    return struct.pack("<HHI", r << 11 | g << 5 | b, 0, 0)


def bc4(part):
    return struct.pack("<BB6x", round(255 * part), 0)


def bits(*fields):
    """Sixteen bytes of (number, width), the lowest bits first."""
    block, at = 0, 0
    for number, width in fields:
        block |= number << at
        at += width
    return block.to_bytes(16, "little")


def bc6h(rgb):
    """Mode 11: two colours of ten bits, which stand for halves; both the same."""
    def ten(part):
        half = struct.unpack("<H", struct.pack("<e", part))[0]
        return min(1023, half * 64 // 31 >> 6)
    ends = [(ten(part), 10) for part in rgb]
    return bits((0b00011, 5), *ends, *ends)


def bc7(rgb):
    """Mode 6: two colours of seven bits and one that they share, both the same."""
    ends = [(round(127 * part), 7) for part in (*rgb, 1.0) for _ in range(2)]
    return bits((1 << 6, 7), *ends, (1, 1), (1, 1))


def dds(name, dxgi, block):
    head = struct.pack("<4s7I44x8I5I", b"DDS ", 124, 0x81007, 4 * HIGH, 4 * WIDE, 16 * WIDE * HIGH, 0, 0, 32, 4,
                       int.from_bytes(b"DX10", "little"), 0, 0, 0, 0, 0, 0x1000, 0, 0, 0, 0)
    data = b"".join(block(color(x, y)) for y in range(HIGH) for x in range(WIDE))
    (HERE / f"{name}.dds").write_bytes(head + struct.pack("<5I", dxgi, 3, 0, 1, 0) + data)


def rgbe(name):
    """Radiance's, not packed."""
    def pixel(rgb):
        share, exponent = math.frexp(max(rgb))
        return bytes(min(255, int(part * 256 / 2**exponent)) for part in rgb) + bytes([exponent + 128])
    data = b"".join(pixel([part**2.2 for part in color(x, y)]) for y in range(HIGH) for x in range(WIDE - 1))
    (HERE / f"{name}.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (HIGH, WIDE - 1) + data)


def field(name, kind, letter, scale):
    """A gyroid in a ball, of this many numbers a side."""
    side = 24
    def at(x, y, z):
        p = [2 * math.pi * (q + 0.5) / side for q in (x, y, z)]
        gyroid = sum(math.sin(2 * p[i]) * math.cos(2 * p[(i + 1) % 3]) for i in range(3))
        return min(1.0, max(0.0, 0.5 + 0.25 * gyroid)) if math.dist(p, [math.pi] * 3) < 0.92 * math.pi else 0.0
    numbers = [at(x, y, z) * scale for z in range(side) for y in range(side) for x in range(side)]
    (HERE / f"{name}.raw").write_bytes(struct.pack(f"<{len(numbers)}{letter}",
                                                   *(numbers if letter == "f" else map(round, numbers))))
    (HERE / f"{name}.mhd").write_text(f"ObjectType = Image\nNDims = 3\nDimSize = {side} {side} {side}\nElementSpacing "
                                      f"= {1 / side:.6g} {1 / side:.6g} "
                                      f"{1 / side:.6g}\nOffset = -0.48 -0.48 -0.48\nElementType = "
                                      f"{kind}\nElementByteOrderMSB = False\nElementDataFile = {name}.raw\n")


write("spectrum", 16, 1, spectrum)
write("marble", SIDE, SIDE * SIDE, marble)
write("faces", FACE, 6 * FACE, faces)
for name, dxgi, block in (("bc2", 75, lambda rgb: b"\xff" * 8 + bc1(rgb)), ("bc3", 78, lambda rgb: bc4(1) + bc1(rgb)),
                          ("bc4", 80, lambda rgb: bc4(rgb[0])),
                          ("bc5", 83, lambda rgb: bc4(rgb[0]) + bc4(rgb[1])),
                          ("bc6h", 95, lambda rgb: bc6h([part**2.2 for part in rgb])), ("bc7", 99, bc7)):
    dds(name, dxgi, block)
rgbe("rgbe")
for name, kind, letter, scale in (("gyroid-ushort", "MET_USHORT", "H", 60000),
                                  ("gyroid-short", "MET_SHORT", "h", 30000), ("gyroid-float", "MET_FLOAT", "f", 1)):
    field(name, kind, letter, scale)
