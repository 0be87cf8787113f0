#!/usr/bin/env python3
"""Writes film.avi, a ball that bounces around once in 3 s (36 pictures, motion JPEG), and film.png, its first picture.

Needs PIL. The container is Microsoft's AVI 1.0: a header, the pictures as chunks `00dc`, and an index of them.
"""
import io
import math
import pathlib
import struct

from PIL import Image, ImageDraw

HERE = pathlib.Path(__file__).resolve().parent
WIDTH, HEIGHT, FRAMES, RATE = 160, 90, 36, 12

def picture(i):
    t = i / FRAMES
    image = Image.new("RGB", (4 * WIDTH, 4 * HEIGHT))
    draw = ImageDraw.Draw(image)
    for x in range(0, 4 * WIDTH, 8):
        draw.rectangle((x, 0, x + 7, 4 * HEIGHT), fill=(40 + 60 * x // (4 * WIDTH), 60, 110 - 50 * x // (4 * WIDTH)))
    draw.rectangle((0, 312, 4 * WIDTH, 4 * HEIGHT), fill=(58, 46, 38))
    bounce = abs(math.sin(3 * math.tau * t / 2))
    x, y = 320 - 210 * math.cos(math.tau * t), 270 - 190 * bounce
    draw.ellipse((x - 60 + 30 * bounce, 322, x + 60 - 30 * bounce, 342), fill=(34, 27, 22))
    draw.ellipse((x - 42, y - 42, x + 42, y + 42), fill=(235, 120, 40))
    draw.ellipse((x - 26, y - 30, x - 2, y - 10), fill=(255, 205, 150))
    draw.arc((560, 24, 616, 80), -90, -90 + max(1, 360 * t), fill=(240, 235, 220), width=10)
    return image.resize((WIDTH, HEIGHT), Image.LANCZOS)

def chunk(name, data):
    return name + struct.pack("<I", len(data)) + data + b"\0" * (len(data) % 2)

def jpeg(image):
    out = io.BytesIO()
    image.save(out, "JPEG", quality=80)
    return out.getvalue()

def main():
    pictures = [jpeg(picture(i)) for i in range(FRAMES)]
    largest = max(map(len, pictures))
    avih = struct.pack("<14I", 1000000 // RATE, largest * RATE, 0, 0x10, FRAMES, 0, 1, largest, WIDTH, HEIGHT, 0, 0, 0,
                       0)
    strh = b"vidsMJPG" + struct.pack("<IHHIIIIIIiI4H", 0, 0, 0, 0, 1, RATE, 0, FRAMES, largest, -1, 0, 0, 0, WIDTH,
                                     HEIGHT)
    strf = struct.pack("<IiiHH4sIiiII", 40, WIDTH, HEIGHT, 1, 24, b"MJPG", WIDTH * HEIGHT * 3, 0, 0, 0, 0)
    hdrl = b"hdrl" + chunk(b"avih", avih) + chunk(b"LIST", b"strl" + chunk(b"strh", strh) + chunk(b"strf", strf))
    movi, index = b"movi", b""
    for data in pictures:
        index += b"00dc" + struct.pack("<III", 0x10, len(movi), len(data))
        movi += chunk(b"00dc", data)
    (HERE / "film.avi").write_bytes(chunk(b"RIFF",
                                          b"AVI " + chunk(b"LIST", hdrl) + chunk(b"LIST", movi) + chunk(
                                              b"idx1", index)))
    picture(0).save(HERE / "film.png")

main()
