#!/usr/bin/env python3
"""Writes kinds.dxf (each kind of entity on a layer of its own), in text and in binary, plan.dxf (a floor plan with
blocks, dimensions, letters and hatches), of R12 and later, and beside kinds.dxf what ezdxf says of each layer.

Needs Debian's python3-ezdxf. What it writes is kept: tests read the files.
"""
import math
import pathlib

import ezdxf
from ezdxf import disassemble, path
from ezdxf.math import BoundingBox, Vec3

HERE = pathlib.Path(__file__).parent


def kinds(version):
    """One layer per kind; those of later versions where there are such."""
    doc = ezdxf.new(version)
    doc.header["$INSUNITS"] = 6
    space = doc.modelspace()

    def on(layer, color=7):
        if layer not in doc.layers:
            doc.layers.add(layer, color=color)
        return {"layer": layer}

    tilted = (1, 2, 3)
    space.add_line((1, 2, 3), (4, 6, 3), on("line", 1))
    space.add_line((0, 0, 0), (3, 0, 0), on("wall") | {"thickness": 2})
    space.add_point((7, 8, 9), on("point"))
    space.add_circle((5, 5, 1), 2, on("circle"))
    space.add_circle((5, 5, 1), 2, on("tilted circle") | {"extrusion": tilted})
    space.add_circle((0, 0, 0), 1, on("tube") | {"thickness": 3})
    space.add_arc((1, 1), 3, 300, 60, dxfattribs=on("arc"))
    space.add_arc((1, 1, 4), 3, 20, 200, dxfattribs=on("tilted arc") | {"extrusion": (0, 0, -1)})
    space.add_trace([(0, 0), (2, 0), (0, 1), (2, 1)], on("trace"))
    space.add_solid([(0, 0), (2, 0), (0, 3), (2, 3)], on("solid") | {"thickness": 1})
    space.add_3dface([(0, 0, 0), (2, 0, 1), (2, 2, 1), (0, 2, 0)], on("face"))
    space.add_3dface([(0, 0, 0), (2, 0, 1), (2, 2, 1)], on("triangle"))
    space.add_polyline2d([(0, 0, 1), (2, 0, -0.5), (2, 2, 0)], format="xyb", close=True, dxfattribs=on("bulges"))
    space.add_polyline3d([(0, 0, 0), (1, 1, 1), (2, 0, 3)], dxfattribs=on("polyline"))
    grid = space.add_polymesh((3, 4), on("grid"))
    for m in range(3):
        for n in range(4):
            grid.set_mesh_vertex((m, n), (m, n, m * m))
    cube = space.add_polyface(on("polyface"))
    cube.append_faces([[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 0, 0), (1, 0, 0), (0, 0, 2)]])
    block = doc.blocks.new("BENT", base_point=(1, 1))
    block.add_line((1, 1), (3, 1), {"layer": "0"})
    block.add_circle((1, 1), 1, {"layer": "0"})
    space.add_blockref("BENT", (10, 20), on("insert") | {"xscale": -2, "yscale": 2, "zscale": 2, "rotation": 30})
    space.add_blockref("BENT", (10, 20, 3), on("rows") | {"column_count": 3, "row_count": 2, "column_spacing": 5,
                                                           "row_spacing": 7, "rotation": 90, "extrusion": (0, 0, -1)})
    outer = doc.blocks.new("OUTER")
    outer.add_blockref("BENT", (2, 0), {"layer": "0", "rotation": 45})
    space.add_blockref("OUTER", (0, 0), on("nested") | {"xscale": 3, "yscale": 3, "zscale": 3})
    if version != "R12":
        space.add_ellipse((1, 2, 3), (3, 1, 0), 0.5, 0.5, 4, on("ellipse"))
        space.add_lwpolyline([(0, 0, 0), (4, 0, 1), (4, 4, 0)], "xyb", dxfattribs=on("light") | {"elevation": 2,
                                                                                              "closed": True})
        space.add_lwpolyline([(0, 0, 0.3), (4, 0, 0)], "xyb", dxfattribs=on("light tilted") | {"extrusion": tilted})
        space.add_open_spline([(0, 0, 0), (1, 3, 0), (3, -3, 1), (5, 0, 1), (6, 2, 0)], dxfattribs=on("spline"))
        space.add_rational_spline([(1, 0, 0), (1, 1, 0), (0, 1, 0)], [1, math.sqrt(0.5), 1], 2,
                                  dxfattribs=on("rational"))
        mesh = space.add_mesh(on("mesh"))
        with mesh.edit_data() as data:
            data.vertices = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (1, 0.5, 0), (0, 2, 0), (0, 0, 2)]
            data.faces = [[0, 1, 2, 3, 4], [0, 1, 5]]
        hatch = space.add_hatch(3, on("hatch"))
        hatch.paths.add_polyline_path([(0, 0), (6, 0), (6, 6), (0, 6)], is_closed=True)
        edges = hatch.paths.add_edge_path()
        edges.add_arc((3, 3), 2, 0, 360)
        hatch.paths.add_polyline_path([(2.5, 2.5), (3.5, 2.5), (3.5, 3.5), (2.5, 3.5)], is_closed=True)
        hatch = space.add_hatch(4, on("half"))
        edges = hatch.paths.add_edge_path()
        edges.add_line((0, 0), (4, 0))
        edges.add_ellipse((2, 0), (2, 0), 0.5, 0, 180)
    return doc


def newell(corners):
    normal = Vec3()
    for a, b in zip(corners, corners[1:] + corners[:1]):
        normal += a.cross(b)
    return normal.magnitude / 2


# What has a thickness, which ezdxf leaves out: the areas of its walls and lids.
THICK = {"wall": 3 * 2, "tube": 2 * math.pi * 3, "solid": 2 * 6 + 10 * 1}


def measured(doc):
    """Of each layer: length of lines, area of faces, bounds."""
    sums = {}
    for top in doc.modelspace():
        layer = top.dxf.layer
        entry = sums.setdefault(layer, [0.0, 0.0, BoundingBox()])
        parts = list(disassemble.recursive_decompose([top]))
        for primitive in disassemble.to_primitives(parts, max_flattening_distance=1e-4):
            kind = primitive.entity.dxftype()
            if kind == "HATCH":
                continue
            if primitive.mesh is not None:
                mesh = primitive.mesh
                entry[1] += sum(newell([Vec3(mesh.vertices[i]) for i in face]) for face in mesh.faces)
                entry[2].extend(mesh.vertices)
                continue
            vertices = list(primitive.vertices())
            entry[2].extend(vertices)
            if kind in ("SOLID", "TRACE", "3DFACE"):
                entry[1] += newell(vertices)
            elif kind != "POINT":
                entry[0] += sum(a.distance(b) for a, b in zip(vertices, vertices[1:]))
        if top.dxftype() == "HATCH":
            rings = [list(ring.flattening(1e-4)) for ring in path.from_hatch(top)]
            for sign, ring in enumerate(sorted(rings, key=newell, reverse=True)):  # each within the one before
                entry[1] += newell(ring) * (-1) ** sign
                entry[2].extend(ring)
        if layer in THICK:
            entry[0], entry[1] = 0, THICK[layer]
            entry[2].extend([Vec3(v) + Vec3(0, 0, top.dxf.thickness) for v in (entry[2].extmin, entry[2].extmax)])
    text = ""
    for layer in sorted(sums):
        length, flat, box = sums[layer]
        text += "%s;%.6f;%.6f;%s\n" % (layer, length, flat,
                                       ";".join("%.6f" % x for x in (*box.extmin, *box.extmax)))
    return text


def plan(version):
    doc = ezdxf.new(version, setup=True)
    doc.header["$INSUNITS"] = 4
    space = doc.modelspace()
    for name, color in (("WALLS", 7), ("DOORS", 30), ("FURNITURE", 3), ("DIMENSIONS", 2), ("TEXT", 4), ("FLOOR", 9),
                        ("HIDDEN", 1), ("FROZEN", 6)):
        doc.layers.add(name, color=color)
    doc.layers.get("HIDDEN").off()
    doc.layers.get("FROZEN").freeze()

    def rectangle(x, y, w, h, layer, **more):
        space.add_polyline2d([(x, y), (x + w, y), (x + w, y + h), (x, y + h)],
                             dxfattribs={"layer": layer, **more}, close=True)

    rectangle(0, 0, 9000, 6000, "WALLS")
    rectangle(240, 240, 8520, 5520, "WALLS")
    for x in (5000, 5120):
        space.add_line((x, 240), (x, 5760), {"layer": "WALLS"})
    door = doc.blocks.new("DOOR", base_point=(0, 0))
    door.add_line((0, 0), (0, 900), {"layer": "0"})
    door.add_arc((0, 0), 900, 0, 90, {"layer": "0", "color": 0})
    for x, y, turn in ((1200, 240, 0), (5060, 2000, 90), (7000, 5760, 180)):
        space.add_blockref("DOOR", (x, y), {"layer": "DOORS", "rotation": turn})
    chair = doc.blocks.new("CHAIR")
    chair.add_polyline2d([(-220, -220), (220, -220), (220, 220), (-220, 220)], dxfattribs={"layer": "0"}, close=True)
    chair.add_polyline2d([(-220, 180), (220, 180)], dxfattribs={"layer": "0", "color": 1})
    chair.add_attdef("NUMBER", (0, 0), dxfattribs={"height": 120, "layer": "0"})
    for i in range(6):
        ref = space.add_blockref("CHAIR", (1000 + 600 * (i % 3), 3000 + 1400 * (i // 3)),
                                 {"layer": "FURNITURE", "rotation": 180 if i < 3 else 0})
        ref.add_attrib("NUMBER", str(i + 1), (940 + 600 * (i % 3), 2940 + 1400 * (i // 3)),
                       {"height": 120, "layer": "TEXT"})
    space.add_circle((7000, 3000), 700, {"layer": "FURNITURE"})
    space.add_text("Saal %%c 7 m²", dxfattribs={"layer": "TEXT", "height": 300}).set_placement((1600, 5000))
    space.add_text("Küche 24 %%d", dxfattribs={"layer": "TEXT", "height": 250, "rotation": 90}).set_placement(
        (8600, 3000), align=ezdxf.enums.TextEntityAlignment.MIDDLE_CENTER)
    space.add_line((0, 0), (9000, 6000), {"layer": "HIDDEN"})
    space.add_line((0, 6000), (9000, 0), {"layer": "FROZEN"})
    if version != "R12":
        space.add_mtext("{\\fArial|b1;Tisch}\\Pf\\S1/2; 1,40 m", {"layer": "TEXT", "char_height": 160,
                                                             "attachment_point": 5, "insert": (7000, 3000)})
        hatch = space.add_hatch(9, {"layer": "FLOOR"})
        hatch.paths.add_polyline_path([(0, 0), (9000, 0), (9000, 6000), (0, 6000)], is_closed=True)
        hatch.paths.add_polyline_path([(240, 240), (8760, 240), (8760, 5760), (240, 5760)], is_closed=True)
        hatch = space.add_hatch(7, {"layer": "FLOOR"})
        hatch.set_pattern_fill("ANSI31", scale=20)
        hatch.paths.add_polyline_path([(5120, 240), (8760, 240), (8760, 1200), (5120, 1200)], is_closed=True)
    for base, p1, p2, angle in (((0, -600), (0, 0), (9000, 0), 0), ((-600, 0), (0, 0), (0, 6000), 90)):
        space.add_linear_dim(base=base, p1=p1, p2=p2, angle=angle, dimstyle="EZDXF",
                             override={"dimtxt": 220, "dimasz": 180, "dimexe": 80, "dimexo": 60, "dimgap": 60,
                                       "dimlfac": 1, "dimdec": 0},
                             dxfattribs={"layer": "DIMENSIONS"}).render()
    return doc


if __name__ == "__main__":
    for version, name in (("R12", "kinds-r12"), ("R2010", "kinds")):
        doc = kinds(version)
        doc.saveas(HERE / (name + ".dxf"))
        (HERE / (name + ".csv")).write_text(measured(doc))
    kinds("R2000").saveas(HERE / "kinds-binary.dxf", fmt="bin")
    kinds("R12").saveas(HERE / "kinds-r12-binary.dxf", fmt="bin")
    plan("R12").saveas(HERE / "plan-r12.dxf")
    plan("R2018").saveas(HERE / "plan.dxf")
