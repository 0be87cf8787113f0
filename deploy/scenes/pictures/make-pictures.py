#!/usr/bin/env python3
"""Writes the pictures of ../pictures.tsct, each in the format whose name it shows, byte by byte; and sky.ktx2, a cube
of all around."""
import math
import os
import struct

WIDTH, HEIGHT = 64, 32
LETTERS = {
    "A": "01110 10001 10001 11111 10001 10001 10001", "B": "11110 10001 11110 10001 10001 10001 11110",
    "C": "01111 10000 10000 10000 10000 10000 01111", "D": "11110 10001 10001 10001 10001 10001 11110",
    "F": "11111 10000 11110 10000 10000 10000 10000", "G": "01111 10000 10000 10011 10001 10001 01111",
    "I": "01110 00100 00100 00100 00100 00100 01110", "K": "10001 10010 10100 11000 10100 10010 10001",
    "M": "10001 11011 10101 10101 10001 10001 10001", "N": "10001 11001 10101 10011 10001 10001 10001",
    "P": "11110 10001 10001 11110 10000 10000 10000", "S": "01111 10000 10000 01110 00001 00001 11110",
    "T": "11111 00100 00100 00100 00100 00100 00100", "X": "10001 01010 00100 00100 00100 01010 10001",
    "2": "01110 10001 00001 00110 01000 10000 11111", "6": "01110 10000 11110 10001 10001 10001 01110",
    "1": "00100 01100 00100 00100 00100 00100 01110",
}


def card(name, color):
    """Rows of (r, g, b): a frame, a slope of grey below, the name in white on a colour, a red mark in the upper left
    corner."""
    rows = [[color] * WIDTH for _ in range(HEIGHT)]
    for y in range(HEIGHT):
        for x in range(WIDTH):
            if x < 2 or y < 2 or x >= WIDTH - 2 or y >= HEIGHT - 2:
                rows[y][x] = (32, 32, 32)
            elif y >= HEIGHT - 7:
                rows[y][x] = ((x - 2) // 4 * 17,) * 3
            elif x < 7 and y < 7:
                rows[y][x] = (224, 0, 0)
    left = (WIDTH - 12 * len(name) + 2) // 2
    for i, letter in enumerate(name):
        for y, line in enumerate(LETTERS[letter].split()):
            for x, dot in enumerate(line):
                if dot == "1":
                    for k in range(4):
                        rows[7 + 2 * y + k // 2][left + 12 * i + 2 * x + k % 2] = (255, 255, 255)
    return rows


def joined(rows, order=(0, 1, 2)):
    return bytes(pixel[c] for row in rows for pixel in row for c in order)


def bmp(rows):
    return b"BM" + struct.pack("<IIIIiiHHIIIIII", 54 + 3 * WIDTH * HEIGHT, 0, 54, 40, WIDTH, HEIGHT, 1, 24, 0, 0, 0, 0,
                               0, 0) + joined(rows[::-1], (2, 1, 0))


def tga(rows):
    return struct.pack("<BBBHHBHHHHBB", 0, 0, 2, 0, 0, 0, 0, 0, WIDTH, HEIGHT, 24, 0x20) + joined(rows, (2, 1, 0))


def gif(rows):
    """With 256 colours, and codes of nine bits: what clears the dictionary comes before it would make them longer."""
    palette = sorted({pixel for row in rows for pixel in row})
    out = b"GIF89a" + struct.pack("<HHBBB", WIDTH, HEIGHT, 0xF7, 0,
                                  0) + b"".join(bytes(c) for c in palette + [(0, 0, 0)] * (256 - len(palette)))
    codes = []
    for i, pixel in enumerate(p for row in rows for p in row):
        codes += ([256] if i % 200 == 0 else []) + [palette.index(pixel)]
    bits = sum(code << 9 * i for i, code in enumerate(codes + [257]))
    data = bits.to_bytes((9 * len(codes) + 9 + 7) // 8, "little")
    parts = b"".join(bytes([len(data[i:i + 255])]) + data[i:i + 255] for i in range(0, len(data), 255))
    return out + b"," + struct.pack("<HHHHB", 0, 0, WIDTH, HEIGHT, 0) + b"\x08" + parts + b"\0;"


def pic(rows):
    return b"\x53\x80\xf6\x34" + bytes(84) + b"PICT" + struct.pack(
        ">HHfHH", WIDTH, HEIGHT, 1, 3, 0) + b"\0\x08\0\xe0" + joined(rows)


def ppm(rows):
    return b"P6\n# sixteen bits\n%d %d\n65535\n" % (WIDTH, HEIGHT) + b"".join(bytes([v, v]) for v in joined(rows))


def sgi(rows):
    out = struct.pack(">HBBHHHH", 474, 0, 1, 3, WIDTH, HEIGHT, 3).ljust(512, b"\0")
    return out + b"".join(bytes(pixel[c] for row in rows[::-1] for pixel in row) for c in range(3))


def tiff(rows):
    data = joined(rows)
    tags = [(256, 3, 1, WIDTH), (257, 3, 1, HEIGHT), (258, 3, 1, 8), (259, 3, 1, 1), (262, 3, 1, 2), (273, 4, 1, 8),
            (277, 3, 1, 3), (278, 3, 1, HEIGHT), (279, 4, 1, len(data))]
    return b"II*\0" + struct.pack("<I",
                                  8 + len(data)) + data + struct.pack("<H", len(tags)) + b"".join(
                                      struct.pack("<HHII", *tag) for tag in tags) + bytes(4)


def five(pixel):
    return (pixel[0] * 31 + 127) // 255 << 11 | (pixel[1] * 63 + 127) // 255 << 5 | (pixel[2] * 31 + 127) // 255


def blocks(rows):
    """bc1: the darkest and the brightest pixel of each block, and what is nearest of the four colours that they
    make."""
    out = b""
    for y in range(0, len(rows), 4):
        for x in range(0, len(rows[0]), 4):
            block = [rows[y + i // 4][x + i % 4] for i in range(16)]
            ends = sorted((five(min(block, key=sum)), five(max(block, key=sum))), reverse=True)
            full = [(255 * (e >> 11) / 31, 255 * (e >> 5 & 63) / 63, 255 * (e & 31) / 31) for e in ends]
            colors = full + [tuple((2 * a + b) / 3 for a, b in zip(*full)),
                             tuple((a + 2 * b) / 3 for a, b in zip(*full))]
            if ends[0] == ends[1]:
                colors = colors[:1]
            best = [min(range(len(colors)), key=lambda k: sum((a - b) ** 2 for a, b in zip(colors[k], pixel)))
                    for pixel in block]
            out += struct.pack("<HHI", *ends, sum(k << 2 * i for i, k in enumerate(best)))
    return out


def halved(rows):
    return [[tuple(sum(rows[2 * y + k // 2][2 * x + k % 2][c] for k in range(4)) // 4 for c in range(3))
             for x in range(len(rows[0]) // 2)] for y in range(len(rows) // 2)]


def dds(rows):
    levels = [rows, halved(rows), halved(halved(rows)), halved(halved(halved(rows)))]
    head = struct.pack("<IIIIIII", 124, 0x21007, HEIGHT, WIDTH, 0, 0,
                       len(levels)) + bytes(44) + struct.pack("<II4sIIIII", 32, 4, b"DXT1", 0, 0, 0, 0, 0)
    return b"DDS " + head + struct.pack("<IIIII", 0x401008, 0, 0, 0, 0) + b"".join(blocks(level) for level in levels)


def ktx2(faces, side, levels=1, form=37):
    descriptor = struct.pack("<II", 28, 0) + bytes(20)
    begin = 80 + 24
    data = b"".join(faces)
    head = b"\xabKTX 20\xbb\r\n\x1a\n" + struct.pack("<IIIIIIIII", form, 1, side[0], side[1], 0, 0, len(faces), levels,
                                                     0)
    return head + struct.pack("<IIIIQQ", begin, len(descriptor), 0, 0, 0,
                              0) + struct.pack("<QQQ", begin + len(descriptor), len(data),
                                               len(data)) + descriptor + data


def sky(side=64):
    """Blue above, sand below, a warm half along -Z; a red mark along +X, a green one along -X, so that it can be seen
    how the faces lie."""
    faces = []
    for face in range(6):
        out = bytearray()
        for y in range(side):
            for x in range(side):
                s, t = 2 * (x + 0.5) / side - 1, 2 * (y + 0.5) / side - 1
                d = [(1, -t, -s), (-1, -t, s), (s, 1, t), (s, -1, -t), (s, -t, 1), (-s, -t, -1)][face]
                size = math.sqrt(sum(v * v for v in d))
                dx, dy, dz = (v / size for v in d)
                up, warm = max(0.0, dy), max(0.0, -dz) * (1 - abs(dy))
                color = ((0.62 - 0.4 * up + 0.3 * warm, 0.68 - 0.3 * up + 0.1 * warm, 0.75 + 0.1 * up - 0.25 * warm)
                         if dy > 0 else (0.45, 0.40, 0.33))
                color = (0.8, 0.1, 0.05) if dx > 0.93 else (0.1, 0.6, 0.1) if dx < -0.93 else color
                out += bytes(min(255, max(0, round(255 * c))) for c in color) + b"\xff"
        faces.append(bytes(out))
    return faces


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    makers = {"bmp": bmp, "tga": tga, "gif": gif, "pic": pic, "ppm": ppm, "sgi": sgi, "tif": tiff, "dds": dds,
              "ktx2": lambda rows: ktx2([blocks(rows)], (WIDTH, HEIGHT), 1, 131)}
    names = {"ppm": "PNM16", "tif": "TIFF", "ktx2": "KTX2"}
    for i, (kind, make) in enumerate(makers.items()):
        rows = card(names.get(kind, kind.upper()), [(40, 90, 160), (150, 80, 40), (50, 120, 60)][i % 3])
        with open(os.path.join(here, "card." + kind), "wb") as file:
            file.write(make(rows))
    with open(os.path.join(here, "sky.ktx2"), "wb") as file:
        file.write(ktx2(sky(), (64, 64)))


main()
