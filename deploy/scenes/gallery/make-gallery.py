#!/usr/bin/env python3
"""Writes ../gallery.tsct: a room for each exhibit, which is a .tsct of this folder, in the order of their names.

An exhibit stands in the coordinates of the shipped walls: what lies in x -1.4 to 1.4, y 0.75 to 2.3, z -1.2 to 0 is
seen. Its first line, a comment, is its title. The camera walks along the rooms: it comes to room i at 4 i seconds and
stays for three.
"""
import pathlib
import textwrap

HERE = pathlib.Path(__file__).resolve().parent
APART = 4.0  # metres from room to room
PACE = 4.0  # seconds
# A metre of the wall is so much of a room, and the middle of its screen lies at the middle of what is shown: so
# exhibits fill the picture.
SCALE = 0.82
RAISED = 1.56 - 1.5 * SCALE  # metres
WIDEST_LINE = 62  # letters of a caption's second line


def title(path):
    """The name of what is shown, and the rest of a room's first line, as lines."""
    first = path.read_text().splitlines()[0].lstrip("# ")
    name, _, rest = first.partition(":")
    return name, textwrap.wrap(rest.strip(), WIDEST_LINE)


def caption(text, height, size):
    text = text.replace('"', '\\"')
    return (f'  node {{ transform {{ translation {{ y: {height:g} z: -1.39 }} }} material: "label" text {{ text: '
            f'"{text}" font: "DejaVu Sans" size: {size:g} alignment: CENTER }} }}')


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
           '  node { material: "wall" transform { translation { x: -2 y: 1.6 z: -0.8 } } box { size { x: 0.1 y: 3.2 '
           'z: 1.3 } } }',
           '  node { material: "stone" transform { translation { y: 0.35 z: -0.5 } } box { size { x: 3.9 y: 0.7 z: '
           '1.6 } } }',
           "}",
           "",
           'node { name: "air" environment { sky { r: 0.30 g: 0.32 b: 0.36 } ground { r: 0.12 g: 0.11 b: 0.10 } '
           'background { r: 0.03 g: 0.03 b: 0.04 } '
           'gravity { y: -9.81 } } }',
           "# From the front: no wall throws its shadow into a room.",
           'node { name: "sun" transform { rotation { axis { x: -0.65 y: 0.1 } angle_deg: 40 } } directional_light { '
           'color { r: 1 g: 0.95 b: 0.88 } intensity: 1.2 shadows: true } }',
           'node { name: "fill" transform { rotation { axis { y: -1 } angle_deg: 70 } } directional_light { color { '
           'r: 0.8 g: 0.9 b: 1 } intensity: 0.25 } }',
           "",
           'node { name: "tour" transform {}',
           f"  node {{ camera {{ world_units_per_metre: {SCALE:g} }} }}",
           "  node { name: \"walk\" animation { mode: LOOP channel { target: \"/tour\" field: \"translation\""]
    times, places = [], []
    for i, _ in enumerate(exhibits):
        times += [PACE * i, PACE * i + PACE - 1]
        places += [APART * i] * 2
    out.append("    time: [" + ", ".join(f"{t:g}" for t in times) + "]")
    out.append("    value: [" + ", ".join(f"{x:g},{RAISED:g},0" for x in places) + "] } } }")
    out.append("}")
    out.append("")
    for i, path in enumerate(exhibits):
        what, lines = title(path)
        name = path.stem.split("-", 1)[1]
        out.append(f'node {{ name: "{name}" transform {{ translation {{ x: {APART * i:g} }} }}')
        out.append('  node { instance: "room" }')
        out.append(caption(what, 2.5, 0.16))
        if lines:
            out.append(caption("\\n".join(lines), 2.37, 0.095))
        out.append(f'  node {{ import {{ uri: "gallery/{path.name}" }} }}')
        out.append("}")
    out.append(f'node {{ name: "end" transform {{ translation {{ x: {APART * len(exhibits) - 2:g} y: 1.6 z: -0.8 }} '
               f'}} material: "wall" box {{ size {{ x: 0.1 y: 3.2 z: 1.3 }} }} }}')
    (HERE.parent / "gallery.tsct").write_text("\n".join(out) + "\n")

main()
