#!/usr/bin/env python3
"""Writes knot.mhd and knot.raw: a scalar field around a trefoil knot, 64 x 64 x 40 bytes: python3
deploy/scenes/volume/make-field.py"""
import math
import os

here = os.path.dirname(os.path.abspath(__file__))
NX, NY, NZ, SPACING = 64, 64, 40, 0.02
places = []
for i in range(400):
    t = 2 * math.pi * i / 400
    places.append(((math.sin(t) + 2 * math.sin(2 * t)) * 0.17, (math.cos(t) - 2 * math.cos(2 * t)) * 0.17,
                   -math.sin(3 * t) * 0.2))
field = bytearray()
for z in range(NZ):
    for y in range(NY):
        for x in range(NX):
            p = [(i - (n - 1) / 2) * SPACING for i, n in ((x, NX), (y, NY), (z, NZ))]
            near = min((a - p[0]) ** 2 + (b - p[1]) ** 2 + (c - p[2]) ** 2 for a, b, c in places)
            field.append(round(255 * math.exp(-near / (2 * 0.07 ** 2))))
with open(os.path.join(here, 'knot.raw'), 'wb') as raw:
    raw.write(field)
with open(os.path.join(here, 'knot.mhd'), 'w') as header:
    header.write('ObjectType = Image\nNDims = 3\nDimSize = %d %d %d\nElementSpacing = %g %g %g\n' % (
        NX, NY, NZ, SPACING, SPACING, SPACING))
    header.write('Offset = %g %g %g\n' % tuple(-(n - 1) / 2 * SPACING for n in (NX, NY, NZ)))
    header.write('ElementType = MET_UCHAR\nElementByteOrderMSB = False\nElementDataFile = knot.raw\n')
