#!/usr/bin/python3
"""How our pictures of glTF models differ from those of three.js in Chromium: `looks.py [--json FILE] [--only NAME,…]
[--size N] [--formats]`.

Both draw the glTF models of the test data (TESSERA_TEST_DATA) and models of our own (looks_models.py), a square picture
each: the same camera, surroundings, sun and lamp, four samples a pixel, the same curve of tones. Ours is a whole wall,
`tessera-wall` with one tile. Animations are taken out of the models: all stand in the pose of the file.
A row for each model, over the pixels where either picture shows it: of the largest difference of red, green and blue,
in steps of 255, the median and what 95 of 100 pixels stay below; by how many steps ours is brighter on the mean; the
share of pixels that only one of the two covers.
With --formats models of other formats, of the test data and of assimp's (assimp-testmodels): up to six for each ending
that three.js reads. Their looks are each program's guess, so both draw them in one plain material: shapes, places and
normals count. Each reader has its own units and axes: each model fills the ball by its own box.
Beside FILE: FILE with the ending .md, a table, and .html, a page with the ten models that differ most: both pictures,
their difference, and the reason where looks_explained.txt has one."""
import argparse
import base64
import functools
import html
import http.server
import json
import math
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import threading

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("TESSERA_BUILD", ROOT / "build"))
sys.path[:0] = [str(BUILD / "python"), str(ROOT / "tests/python")]

import looks_models  # noqa: E402
import page_browser  # noqa: E402
from live import BIN, run_folder  # noqa: E402

from tessera._picture import decode_png, encode_png  # noqa: E402

HERE = pathlib.Path(__file__).parent
DATA = pathlib.Path(os.environ.get("TESSERA_TEST_DATA", ROOT.parent / "shared/data"))
PATIENCE = 600  # s, for one picture; machines are shared
FRAMES = 3
WORST = 10
AT_MOST = 3  # of 255: what the median shall not be beyond

# ---- models of other formats

ASSIMP = pathlib.Path("/usr/share/assimp/models")
ENDINGS = ("3ds", "3mf", "amf", "dae", "fbx", "lwo", "obj", "ply", "stl", "usda", "usdc", "usdz", "wrl")
EACH, MOST_BYTES = 6, 2_000_000
AT_MOST_ONE_SIDED = 2  # percent of the pixels: edges that fall otherwise

# ---- the stage: each model fills a ball of radius 1 about the origin

WINDOW, AWAY = 1.0, 2.0  # m: the screen's side, its distance from the eye
DISTANCE = 1.05 / math.sin(math.atan(WINDOW / 2 / AWAY))
YAW, PITCH = 30, -20  # degrees, of who looks
SUN, SUN_YAW, SUN_PITCH = 0.4, -40, -50
LAMP, LAMP_AT = 1.5, (2.0, 0.5, 2.5)
BACKGROUND = (0.18, 0.05, 0.25)  # a colour of its own, by which the model's pixels are told
SURROUNDINGS = (1024, 512)


def rotation(yaw, pitch):
    """About y, then upwards: a quaternion x y z w, and what is forwards (-Z) by it."""
    y, x = math.radians(yaw) / 2, math.radians(pitch) / 2
    forwards = (-math.sin(2 * y) * math.cos(2 * x), math.sin(2 * x), -math.cos(2 * y) * math.cos(2 * x))
    return (math.cos(y) * math.sin(x), math.sin(y) * math.cos(x), -math.sin(y) * math.sin(x),
            math.cos(y) * math.cos(x)), forwards


def radiance(x, y, z):
    """Of the surroundings, linear: a soft sky, a warm ground, two broad lights."""
    up = (0.5 + 0.5 * y)[..., None]
    sky = np.array([0.08, 0.07, 0.05]) * (1 - up) + np.array([0.16, 0.2, 0.28]) * up
    for (lx, ly, lz), colour, breadth in (((0.6, 0.64, 0.48), (1.2, 1.1, 0.9), 0.12),
                                          ((-0.8, 0.36, 0.48), (0.3, 0.45, 0.6), 0.2)):
        near = np.exp((x * lx + y * ly + z * lz - 1) / breadth)[..., None]
        sky = sky + near * np.array(colour)
    return sky


def rgbe(colours):
    """Radiance's format, rounded down: height × width × 4 (uint8)."""
    _, exponents = np.frexp(colours.max(axis=2))
    parts = colours * np.ldexp(256.0, -exponents)[..., None]
    return np.concatenate([parts, (exponents + 128)[..., None]], axis=2).astype(np.uint8)


def write_surroundings(folder):
    """env.hdr as ours lies (its middle is -Z, rows from the top), env.f32 as three's (its middle is +X, from below)."""
    width, height = SURROUNDINGS
    angle, up = np.meshgrid(2 * math.pi * ((np.arange(width) + 0.5) / width - 0.5),
                            math.pi * (0.5 - (np.arange(height) + 0.5) / height))
    level = np.cos(up)
    ours = rgbe(radiance(level * np.sin(angle), np.sin(up), -level * np.cos(angle)))
    (folder / "env.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) +
                                     ours.tobytes())
    theirs = rgbe(radiance(level * np.cos(angle), np.sin(up), level * np.sin(angle)))[::-1]
    linear = np.ones((height, width, 4), np.float32)
    linear[:, :, :3] = (theirs[:, :, :3] + 0.5) * np.ldexp(1.0, theirs[:, :, 3:].astype(int) - 136)
    (folder / "env.f32").write_bytes(linear.tobytes())


# ---- the models

def document_of(data):
    """The JSON of a .gltf or a .glb, and the chunks behind it."""
    if data[:4] != b"glTF":
        return json.loads(data), None
    end = 20 + struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20:end]), data[end:]


def bytes_of(document, rest):
    text = json.dumps(document).encode()
    if rest is None:
        return text
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON") + text + rest


def models(folder):
    """Path below the folder by name: of the test data, without their animations, then our own."""
    found = {}
    if not DATA.is_dir():
        print(f"looks: no test data at {DATA} (TESSERA_TEST_DATA): our own models alone", file=sys.stderr)
    paths = [path for ending in ("glb", "gltf") for path in DATA.rglob(f"*.{ending}")
             if "malformed" not in path.relative_to(DATA).parts]
    for folder_of in {path.parent for path in paths if path.suffix == ".gltf"}:  # with what lies beside a model
        beside = folder / "data" / folder_of.relative_to(DATA)
        shutil.copytree(folder_of, beside, dirs_exist_ok=True, copy_function=shutil.copyfile)
    for path in sorted(paths):
        below = path.relative_to(DATA)
        document, rest = document_of(path.read_bytes())
        if not str(document.get("asset", {}).get("version", "")).startswith("2."):
            print(f"looks: {below} is left out: it is not glTF 2.0, and nobody reads it", file=sys.stderr)
            continue
        document.pop("animations", None)
        copy = folder / "data" / below
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.unlink(missing_ok=True)
        copy.write_bytes(bytes_of(document, rest))
        found[below.stem if below.stem not in found else f"{below.parent.name}/{below.stem}"] = copy
    own = folder / "own"
    own.mkdir()
    found.update(looks_models.write_models(own))
    return found


def models_of_formats(folder):
    """The same, of other formats; each with its folder, as it names files beside it."""
    found = {}
    broken = {"malformed", "invalid"}
    places = [(root, path) for root in (DATA, ROOT / "tests/data", ASSIMP) if root.is_dir()
              for path in sorted(root.rglob("*")) if path.is_file() and not broken & set(path.parts)]
    for ending in ENDINGS:
        some = [(root, path) for root, path in places
                if path.suffix.lower() == f".{ending}" and path.stat().st_size <= MOST_BYTES]
        # Of many alike not the first ones alone.
        for root, path in some[::max(1, math.ceil(len(some) / EACH))]:
            name = f"{ending}/{path.stem}"
            if name in found:
                name = f"{ending}/{path.parent.name}/{path.stem}"
            beside = folder / "formats" / ending / str(len(found))
            shutil.copytree(path.parent, beside, copy_function=shutil.copyfile, ignore=large)
            found[name] = beside / path.name
    return found


def large(folder, names):
    """Of a folder: what is not copied with a model."""
    return [name for name in names if (pathlib.Path(folder) / name).is_file()
            and (pathlib.Path(folder) / name).stat().st_size > 4 * MOST_BYTES]


def box_of_ours(path, folder):
    """The box around what our importer makes of a file, as it stands in the file."""
    out = folder / "box.obj"
    for written in (folder / "box.tsct", out):
        done = subprocess.run([BIN / "tessera-convert", path, written], capture_output=True, text=True,
                              timeout=PATIENCE)
        if done.returncode:
            raise RuntimeError(done.stderr)
    if "animation {" in (folder / "box.tsct").read_text():
        raise RuntimeError("it moves: three.js shows another moment")
    places = np.array([line.split()[1:4] for line in out.read_text().splitlines() if line.startswith("v ")], float)
    return {"least": places.min(axis=0).tolist(), "greatest": places.max(axis=0).tolist(), "lights": 0}


def stage_of(box, lamp=None):
    """What both draw: how the model is placed, by the box around it; camera and lights. `lamp`: its own, which casts
    shadows, in place of the stage's."""
    least, greatest = np.array(box["least"]), np.array(box["greatest"])
    scale = 2 / max(float(np.linalg.norm(greatest - least)), 1e-12)
    turn, forwards = rotation(YAW, PITCH)
    _, sunwards = rotation(SUN_YAW, SUN_PITCH)
    position = -scale * (least + greatest) / 2
    # As bright where the model is made larger.
    own = lamp and {"position": (position + scale * np.array(lamp["position"])).tolist(), "shadows": True,
                    "intensity": lamp["intensity"] * scale * scale}
    of_stage = [{"directional": [-part for part in sunwards], "intensity": SUN},
                {"position": LAMP_AT, "intensity": LAMP}]
    return {"model": {"scale": scale, "position": position.tolist()},
            "camera": {"rotation": turn, "position": [-DISTANCE * part for part in forwards],
                       "fov": math.degrees(2 * math.atan(WINDOW / 2 / AWAY))},
            "background": BACKGROUND,
            # A model's own light is alone with the surroundings.
            "lights": [own] if own else [] if box["lights"] else of_stage}


# ---- theirs

class Handler(http.server.SimpleHTTPRequestHandler):
    """/page: this folder; /three: the package; /run: what this run has made."""

    def __init__(self, *given, folder, three, **named):
        self._folders = {"page": HERE, "three": three, "run": folder}
        super().__init__(*given, **named)

    def translate_path(self, path):
        first, _, rest = path.split("?")[0].lstrip("/").partition("/")
        folder = self._folders.get(first)
        if folder is None or ".." in rest.split("/"):
            return str(HERE / "none")
        return str(folder / rest)

    def log_message(self, *given):
        pass


class Witness:
    """three.js in Chromium, without a screen and without a GPU."""

    def __init__(self, folder, three, size):
        self._folder, self._size = folder, size
        self._server = http.server.ThreadingHTTPServer(
            ("127.0.0.1", 0), functools.partial(Handler, folder=folder, three=three))
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        self._browser = page_browser.Browser(arguments=["--use-gl=angle", "--use-angle=swiftshader",
                                                        "--enable-unsafe-swiftshader"])
        self._browser.driver.set_script_timeout(PATIENCE)
        self._browser.open(f"http://127.0.0.1:{self._server.server_port}/page/looks.html")
        self._browser.until("three.js", lambda: self._browser.run("return document.title === 'ready'"))
        self.about = self._ask("start", size, "/run/env.f32", *SURROUNDINGS)
        self.about["three"] = self._browser.run("return looks.revision")

    def __enter__(self):
        return self

    def __exit__(self, kind, value, trace):
        self._browser.__exit__(kind, value, trace)
        self._server.shutdown()

    def _ask(self, what, *given):
        said = self._browser.driver.execute_async_script(
            "const [what, given, done] = arguments; (async () => looks[what](...given))().then("
            "(found) => done({found}), (fault) => done({fault: String(fault)}));", what, list(given))
        if "fault" in said:
            raise RuntimeError(f"three.js: {said['fault']}")
        return said["found"]

    def load(self, path):
        return self._ask("load", f"/run/{path.relative_to(self._folder)}")

    def plain(self):
        self._ask("plain")

    def draw(self, stage):
        pixels = np.frombuffer(base64.b64decode(self._ask("draw", stage)), np.uint8)
        return pixels.reshape(self._size, self._size, 4)[::-1, :, :3]


# ---- ours

def vector(name, values, parts="xyz"):
    return f"{name} {{ " + " ".join(f"{part}: {value:.9g}" for part, value in zip(parts, values)) + " }"


def write_wall(folder, size):
    side, down = WINDOW / 2, -WINDOW / 2
    corners = " ".join(vector(name, (x, y, -AWAY)) for name, x, y in (
        ("lower_left", down, down), ("lower_right", side, down), ("upper_left", down, side)))
    (folder / "looks.wall").write_text(
        f'screens {{ name: "front" {corners}\n'
        f"  grid {{ columns: 1 rows: 1 tile_width_px: {size} tile_height_px: {size} }} }}\n"
        'users { name: "viewer" position { x: 0 y: 0 z: 0 } eye_separation_m: 0.065 }\n'
        'hosts { name: "all" tiles { screen: "front" column: 0 row: 0 eye: CENTER user: "viewer" } }\n'
        "samples: 4\n"
        # On a busy machine a host comes late; pictures are no slower for that.
        f"sync {{ late_frame: WAIT frame_deadline_ms: {PATIENCE * 1000} lost_after_ms: {PATIENCE * 1000} "
        f"start_deadline_ms: {PATIENCE * 1000} first_frame_deadline_ms: {PATIENCE * 1000} }}\n")


def scene_of(stage, uri, is_plain):
    camera, placed = stage["camera"], stage["model"]
    lines = ['image { name: "surroundings" uri: "env.hdr" }',
             f'node {{ name: "surroundings" environment {{ image: "surroundings" '
             f'{vector("background", stage["background"], "rgb")} }} }}',
             f'node {{ name: "view" transform {{ {vector("translation", camera["position"])} '
             f'rotation {{ {vector("quaternion", camera["rotation"], "xyzw")} }} }} '
             f"camera {{ world_units_per_metre: {DISTANCE / AWAY:.9g} }} }}"]
    for at, lamp in enumerate(stage["lights"]):
        if "directional" in lamp:
            turn = vector("quaternion", rotation(SUN_YAW, SUN_PITCH)[0], "xyzw")
            lines.append(f'node {{ name: "light {at}" transform {{ rotation {{ {turn} }} }} '
                         f'directional_light {{ intensity: {lamp["intensity"]} }} }}')
        else:
            lines.append(f'node {{ name: "light {at}" transform {{ {vector("translation", lamp["position"])} }} '
                         f'point_light {{ intensity: {lamp["intensity"]:.9g} '
                         f'shadows: {"true" if lamp.get("shadows") else "false"} }} }}')
    model = (f'node {{ name: "model" transform {{ {vector("translation", placed["position"])} '
             f'uniform_scale: {placed["scale"]:.9g} }} import {{ uri: "{uri}" }} }}')
    if is_plain:
        lines.append('material { name: "plain" base_color { r: 1 g: 1 b: 1 } roughness: 1 double_sided: true }')
        model = f'node {{ name: "plain" material_group {{ material: "plain" override: true }} {model} }}'
    lines.append(model)
    return "\n".join(lines) + "\n"


def ours_of(stage, path, folder, is_plain=False):
    scene, out = folder / "stage.tsct", folder / "out"
    shutil.rmtree(out, ignore_errors=True)
    scene.write_text(scene_of(stage, path.relative_to(folder), is_plain))
    done = subprocess.run([BIN / "tessera-wall", "--wall", folder / "looks.wall", "--scene", scene, "--frames",
                           str(FRAMES), "--output", out, "--surface", "osmesa", "--no-input", "--no-notices"],
                          capture_output=True, text=True, timeout=PATIENCE)
    if done.returncode:
        raise RuntimeError(f"tessera-wall: {done.stdout}{done.stderr}")
    return decode_png(memoryview((out / "wall.png").read_bytes()))


# ---- both

def compared(ours, theirs):
    """The row's figures, and the differences by pixel; nothing shown: no figures."""
    shown = [np.abs(picture.astype(int) - picture[0, 0].astype(int)).max(axis=2) > 2 for picture in (ours, theirs)]
    both = shown[0] | shown[1]
    signed = ours.astype(int) - theirs.astype(int)
    apart = np.abs(signed).max(axis=2)
    if not both.any():
        return {"pixels": 0}, apart
    values = apart[both]
    return {"median": float(np.median(values)), "p95": round(float(np.percentile(values, 95)), 1),
            "brighter": round(float(signed[both].mean()), 2),
            "one_sided_percent": round(100 * float((shown[0] ^ shown[1]).sum() / both.sum()), 2),
            "pixels": int(both.sum()), "at_most": AT_MOST}, apart


def pictures_of(path, witness, folder, is_plain, lamp):
    """Theirs and ours."""
    box = witness.load(path)
    if not is_plain:
        stage = stage_of(box, lamp)
        return witness.draw(stage), ours_of(stage, path, folder)
    witness.plain()
    return (witness.draw(stage_of({**box, "lights": 0})),
            ours_of(stage_of(box_of_ours(path, folder)), path, folder, True))


def difference_picture(apart):
    """Steps as colours: black is none, white 32 and more."""
    share = np.clip(apart / 32, 0, 1)[..., None]
    return (255 * np.clip(share * 3 - np.array([0, 1, 2]), 0, 1)).round().astype(np.uint8)


def table_of(rows):
    lines = ["| model | median | 95 of 100 | ours brighter by | covered by one alone |", "|---|---|---|---|---|"]
    lines += [f"| {row['row']} | {row['median']:g} | {row['p95']:g} | {row['brighter']:+g} | "
              f"{row['one_sided_percent']:g} % |" if row["pixels"] else f"| {row['row']} | shows nothing | | | |"
              for row in rows]
    return "\n".join(lines) + "\n"


def explanations():
    """Reasons by name."""
    blocks = (HERE / "looks_explained.txt").read_text().split("\n\n")[1:]
    found = {}
    for name, *lines in (block.strip().split("\n") for block in blocks):
        if name in found:
            raise ValueError(f"looks_explained.txt has two reasons for {name}")
        found[name] = " ".join(lines)
    return found


def page_of(rows, about, explained, folder):
    """The worst ones with their pictures, then all."""
    say = html.escape
    parts = ['<!DOCTYPE html><html lang="en"><meta charset="utf-8"><title>Looks beside three.js</title><style>'
             "body { font: 15px sans-serif; margin: 2em auto; max-width: 62em } img { width: 100% }"
             ".three { display: grid; grid-template-columns: repeat(3, 1fr); gap: 1em } figure { margin: 0 }"
             "td, th { padding: 0.1em 1em; text-align: right } td:first-child { text-align: left }</style>"
             f"<h1>Looks beside three.js, revision {say(str(about['three']))}</h1>"
             "<p>Differences are steps of 255, over the pixels of the model. In the third picture black is none, white "
             "32 steps and more.</p>"]
    for row in [row for row in rows if row["pixels"]][:WORST]:
        name = row["row"]
        parts.append(f"<h2>{say(name)}: median {row['median']:g}, 95 of 100 below {row['p95']:g}</h2>"
                     f"<p>{say(explained.get(name, 'Not explained.'))}</p><div class=three>")
        for what in ("ours", "theirs", "difference"):
            parts.append(f"<figure><img alt='' src='{folder}/{picture_name(name, what)}'>"
                         f"<figcaption>{what}</figcaption></figure>")
        parts.append("</div>")
    parts.append("<h2>All</h2><table><tr><th>model<th>median<th>95 of 100<th>ours brighter by<th>covered by one alone")
    parts += [f"<tr><td>{say(row['row'])}<td>{row['median']:g}<td>{row['p95']:g}<td>{row['brighter']:+g}"
              f"<td>{row['one_sided_percent']:g} %" for row in rows if row["pixels"]]
    return "".join(parts) + "</table></html>\n"


def picture_name(name, what):
    return f"{name.replace('/', '-')}-{what}.png"


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--json")
    options.add_argument("--only", default="", help="names of models, with commas between")
    options.add_argument("--formats", action="store_true", help="models of other formats, in one plain material")
    options.add_argument("--size", type=int, default=512, help="pixels of a side")
    said = options.parse_args()
    three = BUILD / "npm/node_modules/three"
    if not (three / "build/three.module.js").exists():
        options.exit(1, "looks: three.js is not in the build folder (./deploy/set-up --looks brings it)\n")
    if page_browser.WHY_NOT:
        options.exit(1, f"looks: {page_browser.WHY_NOT}\n")
    result = pathlib.Path(said.json) if said.json else None
    pictures = result.with_suffix("") if result else None
    if pictures:
        pictures.mkdir(parents=True, exist_ok=True)
    rows = []
    with run_folder(), tempfile.TemporaryDirectory(prefix="tessera-looks-") as made:
        folder = pathlib.Path(made)
        write_surroundings(folder)
        write_wall(folder, said.size)
        found = models_of_formats(folder) if said.formats else models(folder)
        chosen = [name for name in said.only.split(",") if name] or list(found)
        unknown = [name for name in chosen if name not in found]
        if unknown:
            options.error(f"no model {', '.join(unknown)}; there are {', '.join(found)}")
        with Witness(folder, three, said.size) as witness:
            about = witness.about
            for name in chosen:
                try:
                    theirs, ours = pictures_of(found[name], witness, folder, said.formats,
                                               looks_models.SHADOWED.get(name))
                except RuntimeError as fault:
                    if not said.formats:
                        raise
                    why = " ".join(str(fault).split())[:300]
                    print(f"looks: {name} is left out: {why}", file=sys.stderr, flush=True)
                    continue
                figures, apart = compared(ours, theirs)
                if said.formats and figures["pixels"]:
                    # Where a file has no normals each program has its own.
                    del figures["at_most"]
                    figures["at_most_one_sided"] = AT_MOST_ONE_SIDED
                rows.append({"row": name, **figures})
                print(json.dumps(rows[-1]), flush=True)
                if pictures:
                    for what, pixels in (("ours", ours), ("theirs", theirs), ("difference", difference_picture(apart))):
                        (pictures / picture_name(name, what)).write_bytes(encode_png(np.ascontiguousarray(pixels)))
    rows.sort(key=lambda row: (-row.get("one_sided_percent" if said.formats else "median", 0), -row.get("p95", 0)))
    print(table_of(rows), end="")
    if result:
        result.with_suffix(".md").write_text(table_of(rows))
        result.with_suffix(".html").write_text(page_of(rows, about, explanations(), pictures.name))
        result.write_text(json.dumps({"rows": rows, "about": about}, indent=1) + "\n")


if __name__ == "__main__":
    main()
