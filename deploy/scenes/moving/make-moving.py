#!/usr/bin/env python3
"""Writes ../moving.tsct: what key frames can move. A worm of 50 joints in one skin, a ball that becomes a star, a lamp
and a material that change colour, and a crane that a wall stops.

    deploy/scenes/moving/make-moving.py > deploy/scenes/moving.tsct
"""
import math

JOINTS, STEP, SIDES = 50, 0.1, 12


def number(x):
    text = f"{x:.5g}"
    return "0" if text in ("-0", "0") else text


def numbers(name, values, each=24):
    """A repeated field in lines that can be read."""
    rows = [", ".join(number(v) for v in values[i:i + each]) for i in range(0, len(values), each)]
    return f"{name}: [" + ",\n    ".join(rows) + "]"


def worm_mesh():
    """A tube along +X that is thicker in front; the k-th ring stands at joint k."""
    position, normal, index, joint, weight = [], [], [], [], []
    for ring in range(JOINTS + 1):
        x = ring * STEP
        along = ring / JOINTS
        radius = 0.24 * math.sqrt(max(1e-4, math.sin(math.pi * (0.03 + 0.94 * along) ** 0.7)))
        radius *= 1 + 0.08 * (ring % 2)
        for side in range(SIDES):
            angle = 2 * math.pi * side / SIDES
            position += [x, radius * math.cos(angle), radius * math.sin(angle)]
            normal += [0, math.cos(angle), math.sin(angle)]
            if ring == 0 or ring >= JOINTS:
                joint += [min(ring, JOINTS - 1), 0, 0, 0]
                weight += [1, 0, 0, 0]
            else:  # half of what is behind a joint, half of what is in front
                joint += [ring - 1, ring, 0, 0]
                weight += [0.5, 0.5, 0, 0]
    for ring in range(JOINTS):
        for side in range(SIDES):
            a, b = ring * SIDES + side, ring * SIDES + (side + 1) % SIDES
            index += [a, a + SIDES, b + SIDES, a, b + SIDES, b]
    for end, order in ((0, 1), (JOINTS, -1)):
        first = end * SIDES
        for side in range(1, SIDES - 1):
            corners = [first, first + side, first + side + 1]
            index += corners[::order]
    return position, normal, index, joint, weight


def bend(joint, time):
    """Degrees about Z and Y: a wave that runs along the worm in two seconds."""
    phase = 2 * math.pi * (time / 2 - joint / 25)
    z, y = 7 * math.sin(phase), 4 * math.sin(phase + 1.3)
    if joint == 0:  # so that it heads along X in the mean, whenever
        z, y = z + 7 * 25 / (2 * math.pi) * math.cos(phase), y + 4 * 25 / (2 * math.pi) * math.cos(phase + 1.3)
    return z, y


def quaternion(z_deg, y_deg):
    z, y = math.radians(z_deg) / 2, math.radians(y_deg) / 2
    # about Z, then about Y
    return (math.cos(y) * math.cos(z), math.sin(y) * math.sin(z), math.sin(y) * math.cos(z), math.cos(y) * math.sin(z))


def joints(k, indent):
    pad = "  " * min(indent, 8)
    q = quaternion(*bend(k, 0))
    place = (f"translation {{ x: {number(STEP if k else 0)} }} rotation {{ quaternion {{ w: {number(q[0])} x: "
             f"{number(q[1])} y: {number(q[2])} z: {number(q[3])} }} }}")
    below = joints(k + 1, indent + 1) if k + 1 < JOINTS else ""
    return f'{pad}node {{ name: "joint {k}" transform {{ {place} }}\n{below}{pad}}}\n'


def path(k):
    return "/worm/" + "/".join(f"joint {i}" for i in range(k + 1))


def ball(rings=16, around=24):
    """A ball, and two targets: a box, a star."""
    position, normal, index, box, star = [], [], [], [], []
    for r in range(rings + 1):
        for s in range(around + 1):
            up, turn = math.pi * r / rings, 2 * math.pi * s / around
            n = (math.sin(up) * math.cos(turn), math.cos(up), math.sin(up) * math.sin(turn))
            most = max(abs(c) for c in n)
            spike = 0.55 * math.cos(6 * turn) * math.sin(up) ** 2 * math.sin(up)
            position += [0.6 * c for c in n]
            normal += n
            box += [0.55 * c / most - 0.6 * c for c in n]
            star += [spike * c for c in n]
    for r in range(rings):
        for s in range(around):
            a, b = r * (around + 1) + s, (r + 1) * (around + 1) + s
            index += [a, a + 1, b, a + 1, b + 1, b]
    return position, normal, index, box + star


def main():
    position, normal, index, joint, weight = worm_mesh()
    print("# A worm of 50 joints in one skin, a ball that becomes a box and a star, a lamp and a material that change "
          "their colours, and a crane")
    print("# that a wall stops: what key frames move. `tessera-ctl … animations` lists them; play, pause, seek, "
          "speed. Written by moving/make-moving.py.")
    print()
    print('material { name: "worm"  base_color { r: 0.75 g: 0.32 b: 0.22 } roughness: 0.45 }')
    print('material { name: "chameleon" base_color { r: 0.15 g: 0.5 b: 0.2 } roughness: 0.35 }')
    print('material { name: "iron"  base_color { r: 0.5 g: 0.5 b: 0.52 } metallic: 0.7 roughness: 0.4 }')
    print('material { name: "brick" base_color { r: 0.45 g: 0.2 b: 0.14 } roughness: 0.9 }')
    print('material { name: "floor" base_color { r: 0.4 g: 0.4 b: 0.36 } roughness: 1 }')
    print()
    print('mesh { name: "worm"')
    print("  " + numbers("position", position))
    print("  " + numbers("normal", normal))
    print("  " + numbers("index", index, 36) + " }")
    shape = ball()
    print('mesh { name: "ball"')
    print("  " + numbers("position", shape[0]))
    print("  " + numbers("normal", shape[1]))
    print("  " + numbers("index", shape[2], 36) + " }")
    print()
    print('node { name: "air" environment { sky { r: 0.32 g: 0.35 b: 0.4 } ground { r: 0.16 g: 0.15 b: 0.13 } '
          'background { r: 0.55 g: 0.62 b: 0.7 } } }')
    print('node { name: "sun" transform { rotation { axis { x: -0.8 y: 0.5 z: 0.1 } angle_deg: 55 } } '
          'directional_light { color { r: 1 g: 0.96 b: 0.9 } intensity: 0.9 shadows: true } }')
    print('node { name: "camera" transform { translation { x: 0 y: -0.2 z: 2.6 } } camera { world_units_per_metre: '
          '1.7 } }')
    print('node { name: "floor" material: "floor" transform { translation { y: -0.05 } } box { size { x: 14 y: 0.1 z: '
          '9 } } }')
    print()
    print('node { name: "worm" transform { translation { x: -2.4 y: 0.85 z: 0.6 } }')
    print(joints(0, 1), end="")
    print("}")
    print('node { name: "skin" skin { mesh: "worm" material: "worm"')
    print("  " + ",\n    ".join(f'joint: "{path(k)}"' for k in range(JOINTS)).replace(",\n", "\n"))
    print("  " + numbers("joint_index", joint, 48))
    print("  " + numbers("joint_weight", weight, 48))
    binds = [v for k in range(JOINTS) for v in (1, 0, 0, -k * STEP, 0, 1, 0, 0, 0, 0, 1, 0)]
    print("  " + numbers("inverse_bind", binds) + " } }")
    print()
    print('node { name: "changeling" transform { translation { x: -1.6 y: 1.9 z: -0.6 } } material: "chameleon"')
    print('  skin { mesh: "ball" weight: [0.35, 0.5]')
    print("  " + numbers("morph_position", shape[3]) + " } }")
    print('node { name: "lamp" transform { translation { x: 0.4 y: 1.5 z: 1.4 } }')
    print('  point_light { color { r: 1 g: 0.5 b: 0.2 } intensity: 0.6 range: 6 } }')
    print('node { name: "crane" transform { translation { x: 0.2 y: 1.9 z: -1 } } material: "iron"')
    print('  node { name: "hook" box { size { x: 0.4 y: 0.5 z: 0.5 } } }')
    print('  node { name: "rope" transform { translation { y: 0.9 } } cylinder { radius: 0.03 height: 1.4 } } }')
    print('node { name: "wall" transform { translation { x: 2.4 y: 1.1 z: -1 } } material: "brick" node { name: '
          '"bricks" box { size { x: 0.3 y: 2.2 z: 2 } } } }')
    print('node { name: "stop" interest { object: "/crane" against: "/wall" } }')
    print()
    print('node { name: "crawl" animation {')
    times = [i / 4 for i in range(9)]
    for k in range(JOINTS):
        values = [v for t in times for v in quaternion(*bend(k, t))]
        print(f'  channel {{ target: "{path(k)}" field: "rotation" {numbers("time", times)} '
              f'{numbers("value", values, 40)} }}')
    print("} }")
    print('node { name: "change" animation { mode: PING_PONG')
    print('  channel { target: "/changeling" field: "weights" interpolation: SPLINE time: [0, 1, 2] value: [0, 0, '
          '0.35, 0.5, 0, 0,  0, 0, 1, 0, 0, 0,  0, 0, 0, 1, 0, 0] }')
    print('  channel { material: "chameleon" field: "baseColor" time: [0, 1, 2] value: [0.15, 0.5, 0.2, 1,  0.6, 0.5, '
          '0.1, 1,  0.5, 0.1, 0.4, 1] } } }')
    print('node { name: "glow" animation { channel { target: "/lamp" field: "color" time: [0, 0.7, 1.4, 2.1] value: '
          '[1, 0.5, 0.2,  0.2, 0.6, 1,  0.4, 1, 0.3,  1, 0.5, 0.2] }')
    print('  channel { target: "/lamp" field: "intensity" interpolation: STEP time: [0, 1.05] value: [0.6, 1.0] } } }')
    print('node { name: "swing" animation { mode: ONCE channel { target: "/crane" field: "translation" time: [0, 3] '
          'value: [0.2, 1.9, -1,  4, 1.9, -1] } } }')


main()
