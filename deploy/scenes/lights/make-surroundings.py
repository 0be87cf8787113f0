#!/usr/bin/env python3
"""Writes evening.hdr, a sky after sunset over a dark plain, with a glow in the west and a few lit windows around; and
noon.hdr, a clear sky with clouds over a grey haze."""
import math
import os

WIDTH, HEIGHT = 512, 256


def evening(x, y):
    round_, up = (x + 0.5) / WIDTH * 2 * math.pi - math.pi, 1 - 2 * (y + 0.5) / HEIGHT  # 0: along -Z; 1 up, -1 down
    if up < 0:
        ground = 0.03 + 0.05 * math.exp(up * 9)
        return (ground, 0.9 * ground, 0.85 * ground)
    glow = math.exp(-((round_ - 0.5) / 0.9) ** 2) * math.exp(-up * 5)
    night = (0.05 + 0.10 * (1 - up), 0.08 + 0.13 * (1 - up), 0.20 + 0.18 * (1 - up))
    color = [n + g * glow for n, g in zip(night, (2.4, 0.85, 0.25))]
    # Windows of houses below the skyline.
    house = 0.05 + 0.04 * math.sin(7 * round_) + 0.03 * math.sin(17 * round_ + 1)
    if up < house:
        lit = (int(x / 3) * 7 + int(y / 3) * 13) % 11 == 0 and x % 3 >= 1 and y % 3 >= 1
        return (4.0, 2.6, 1.1) if lit else (0.02, 0.02, 0.03)
    return tuple(color)


def noon(x, y):
    round_, up = (x + 0.5) / WIDTH * 2 * math.pi - math.pi, 1 - 2 * (y + 0.5) / HEIGHT
    if up < 0:
        return (0.42 + 0.2 * math.exp(up * 20), 0.43 + 0.22 * math.exp(up * 20), 0.44 + 0.26 * math.exp(up * 20))
    haze = math.exp(-up * 4.5)
    color = [clear + (pale - clear) * haze for clear, pale in zip((0.16, 0.34, 0.78), (0.78, 0.86, 0.95))]
    # Clouds: waves of several lengths, which come together towards the horizon as on a ceiling.
    far = 1 / (up + 0.18)
    u, v = far * math.cos(round_), far * math.sin(round_)
    height = sum(math.sin(k * u + 2.1 * k + math.sin(k * v)) * math.sin(0.8 * k * v + k) / k
                 for k in (1, 2, 3.3, 5.1, 8.7))
    cloud = min(1.0, max(0.0, 1.3 * height - 0.55)) * min(1, 6 * up)
    return tuple(c + (1.05 - c) * 0.85 * cloud for c in color)


def softened(radiance, x, y):
    """The mean around a pixel, in a tent two pixels wide: edges that a screen may show larger than they are here."""
    sums, weights = [0.0, 0.0, 0.0], 0.0
    for i in range(-3, 4):
        for j in range(-3, 4):
            weight = (4 - abs(i)) * (4 - abs(j))
            color = radiance((x + i / 2) % WIDTH, min(max(y + j / 2, 0), HEIGHT - 1))
            weights += weight
            sums = [total + weight * c for total, c in zip(sums, color)]
    return [total / weights for total in sums]


def rgbe(color):
    mantissa, exponent = math.frexp(max(color) * 256 / 255.5)
    return [min(255, round(c * 2.0 ** (8 - exponent))) for c in color] + [exponent + 128]


def runs(row):
    """Radiance's runs: more than two alike as 128 + count, value; others as count, values."""
    out, at = bytearray(), 0
    while at < len(row):
        same = 1
        while at + same < len(row) and same < 127 and row[at + same] == row[at]:
            same += 1
        if same > 2:
            out += bytes([128 + same, row[at]])
            at += same
            continue
        end = at + 1
        while end < len(row) and end - at < 127 and not row[end:end + 3] == row[end:end + 1] * 3:
            end += 1
        out += bytes([end - at]) + bytes(row[at:end])
        at = end
    return out


def main():
    for name, radiance in (("evening", evening), ("noon", noon)):
        out = bytearray(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {HEIGHT} +X {WIDTH}\n".encode())
        for y in range(HEIGHT):
            row = [rgbe(softened(radiance, x, y)) for x in range(WIDTH)]
            out += bytes([2, 2, WIDTH >> 8, WIDTH & 255])
            for channel in range(4):
                out += runs([pixel[channel] for pixel in row])
        with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), name + ".hdr"), "wb") as file:
            file.write(out)


main()
