#!/usr/bin/env python3
"""Writes ../gallery.tsct: a room for each exhibit, which is a .tsct of this folder, in the order of their names.

An exhibit stands in the coordinates of the shipped walls: what lies in x -1.4 to 1.4, y 0.75 to 2.3, z -1.2 to 0 is
seen. Its first line, a comment, is its title. The camera walks along the rooms: it comes to room i at 4 i seconds and
stays for three.
"""
import pathlib

HERE = pathlib.Path(__file__).resolve().parent
APART = 4.0  # metres from room to room
PACE = 4.0  # seconds

def title(path):
    first = path.read_text().splitlines()[0]
    return first.lstrip("# ").split(":")[0], first.lstrip("# ")

def main():
    exhibits = sorted(HERE.glob("*.tsct"))
    out = ["# A room for each thing that a scene can show: gallery/make-gallery.py writes this file, each room's "
           "content is a file beside it.",
           "# The camera walks along them; `tessera-ctl … seek /tour 12` leads it to room 3.",
           "",
           'material { name: "wall"  base_color { r: 0.13 g: 0.15 b: 0.19 } roughness: 0.95 }',
           'material { name: "stone" base_color { r: 0.09 g: 0.09 b: 0.10 } roughness: 0.8 }',
           'material { name: "label" base_color { r: 0.95 g: 0.93 b: 0.88 } unlit: true }',
           "",
           'definition { name: "room"',
           '  node { material: "wall" transform { translation { y: 1.6 z: -1.45 } } box { size { x: 4 y: 3.2 z: 0.1 } '
           '} }',
           '  node { material: "wall" transform { translation { x: -2 y: 1.6 z: -0.5 } } box { size { x: 0.1 y: 3.2 '
           'z: 2 } } }',
           '  node { material: "stone" transform { translation { y: 0.35 z: -0.5 } } box { size { x: 3.9 y: 0.7 z: '
           '1.6 } } }',
           "}",
           "",
           'node { name: "air" environment { sky { r: 0.30 g: 0.32 b: 0.36 } ground { r: 0.12 g: 0.11 b: 0.10 } '
           'background { r: 0.03 g: 0.03 b: 0.04 } } }',
           'node { name: "sun" transform { rotation { axis { x: -0.85 y: 0.5 } angle_deg: 42 } } directional_light { '
           'color { r: 1 g: 0.95 b: 0.88 } intensity: 1.2 shadows: true } }',
           "",
           'node { name: "tour" transform {}',
           "  node { camera {} }",
           "  node { name: \"walk\" animation { mode: LOOP channel { target: \"/tour\" field: \"translation\""]
    times, places = [], []
    for i, _ in enumerate(exhibits):
        times += [PACE * i, PACE * i + PACE - 1]
        places += [APART * i] * 2
    out.append("    time: [" + ", ".join(f"{t:g}" for t in times) + "]")
    out.append("    value: [" + ", ".join(f"{x:g},0,0" for x in places) + "] } } }")
    out.append("}")
    out.append("")
    for i, path in enumerate(exhibits):
        short, whole = title(path)
        name = path.stem.split("-", 1)[1]
        out.append(f'node {{ name: "{name}" transform {{ translation {{ x: {APART * i:g} }} }}')
        out.append('  node { instance: "room" }')
        out.append(f'  node {{ transform {{ translation {{ y: 2.56 z: -1.39 }} }} material: "label" text {{ text: '
                   f'"{whole}" font: "DejaVu Sans" size: 0.085 alignment: CENTER }} }}')
        out.append(f'  node {{ import {{ uri: "gallery/{path.name}" }} }}')
        out.append("}")
    out.append(f'node {{ name: "end" transform {{ translation {{ x: {APART * len(exhibits) - 2:g} y: 1.6 z: -0.5 }} '
               f'}} material: "wall" box {{ size {{ x: 0.1 y: 3.2 z: 2 }} }} }}')
    (HERE.parent / "gallery.tsct").write_text("\n".join(out) + "\n")

main()
