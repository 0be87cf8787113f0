"""Pictures of what a benchmark has found (tests/bench/plot.py): each row is in them, and nothing lies over another."""
import importlib.util
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree

from live import ROOT
from page_browser import WHY_NOT, Browser

PLOT = ROOT / "tests/bench/plot.py"
KEPT = sorted((ROOT / "tests/data/bench").glob("*.json"))
SVG = "{http://www.w3.org/2000/svg}"
LONG = "a name of many words that goes on and on, as those of rows with a limit and a remark do, and then some"

# As SceneTable and CollisionTable write them, with all that they can say at once; the figures are made up.
TABLE = {"cases": [
    {"case": "first pair: any", "peer": "FCL OBB", "ours": 12.0, "theirs": 120.0, "unit": "µs", "ratio": 0.1,
     "at_most": 0.5, "aim": 0.2, "remark": ""},
    {"case": "first pair: all", "peer": "FCL OBB", "ours": 300.0, "theirs": 100.0, "unit": "µs", "ratio": 3.0,
     "at_most": 1.2, "aim": 0.8, "remark": LONG},
    {"case": f"second pair: {LONG}", "peer": LONG, "ours": 1.0, "theirs": 1e6, "unit": "bytes of memory", "ratio": 1e-6,
     "at_most": 0, "aim": 0, "remark": ""},
    {"case": "second pair: " + "m" * 120, "peer": "Bullet", "ours": 5e7, "theirs": 0, "unit": "bytes of memory",
     "ratio": 0, "at_most": 0, "aim": 0, "remark": "no peer has it"}],
    "skipped": ["OpenSceneGraph is not installed"]}
HOSTILE = {"rows": [
    {"row": "</text><script>alert(1)</script>&amp;\"'", "beside": "]]><!--", "p50_ms": 1},
    {"row": "\u202eturned\u0000\u001b[31m\n line\ud800", "p50_ms": 2, "a<b>&c_ms": 3},
    {"row": "名前は長い" * 40, "p50_ms": float("nan"), "most_ms": float("inf"), "least_ms": -5},
    {"row": "𝔘" * 90, "bytes": 10 ** 400, "list_ms": [], "words": "some", "nested": {"deep": {"er": {"p99_us": 7}}}},
    {"row": "", "same": True, "nothing": None},
    {}]}

# Of each text as the browser sets it: left, top, right, bottom; without what a line has above and below its letters.
BOXES = """
return [...document.querySelectorAll('text')].map((node) => [node.getBBox(), node.textContent])
  .map(([box, text]) => [box.x, box.y + 0.15 * box.height, box.x + box.width, box.y + 0.85 * box.height, text]);
"""
COLOURS = """
return Object.fromEntries([...document.querySelectorAll('text, rect')].map((node) =>
  [node.getAttribute('class') ?? 'text', getComputedStyle(node).fill.match(/[0-9.]+/g).map(Number)]));
"""


def light_of(colour):
    parts = [part / 3294.6 if part <= 10 else ((part / 255 + 0.055) / 1.055) ** 2.4 for part in colour]
    return 0.2126 * parts[0] + 0.7152 * parts[1] + 0.0722 * parts[2]


def picture_of(said, name="bench"):
    with tempfile.TemporaryDirectory() as folder:
        source = pathlib.Path(folder, f"{name}.json")
        source.write_bytes(said if isinstance(said, bytes) else json.dumps(said).encode())
        ran = subprocess.run([sys.executable, PLOT, source], capture_output=True, text=True)
        made = source.with_suffix(".svg")
        return ran, made.read_text("utf-8") if made.exists() else None


def plotter():
    spec = importlib.util.spec_from_file_location("plot", PLOT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def texts(svg):
    return [each.text or "" for each in ElementTree.fromstring(svg).iter(f"{SVG}text")]


def run_together(texts):
    """Words alone: a long name stands on several lines, which may be cut within a word."""
    return re.sub(r"\s", "", "".join(texts))


def boxes(svg, width_of):
    """Of each text, by the plotter's own widths: left, top, right, bottom."""
    for each in ElementTree.fromstring(svg).iter(f"{SVG}text"):
        size = {"title": 18, "head": 14}.get(each.get("class"), 12)
        long = width_of(each.text or "", size)
        left = float(each.get("x")) - (long / 2 if each.get("text-anchor") == "middle" else 0)
        bottom = float(each.get("y"))
        yield left, bottom - 0.8 * size, left + long, bottom + 0.2 * size, each.text


def overlaps(found):
    found = sorted(found, key=lambda box: box[1])
    for at, (left, top, right, bottom, text) in enumerate(found):
        for other in found[at + 1:]:
            if other[1] >= bottom - 0.5:
                break
            if left < other[2] - 0.5 and other[0] < right - 0.5:
                yield text, other[4]


class Plot(unittest.TestCase):
    def all_shapes(self):
        self.assertGreaterEqual(len(KEPT), 4)
        return {**{path.stem: json.loads(path.read_text()) for path in KEPT}, "table": TABLE, "hostile": HOSTILE}

    def drawn(self, said, name="bench"):
        ran, svg = picture_of(said, name)
        self.assertEqual((ran.returncode, ran.stderr), (0, ""))
        return svg

    def test_each_row_is_in_it(self):
        for name, said in self.all_shapes().items():
            if name == "hostile":
                continue
            words = run_together(texts(self.drawn(said, name)))
            for row in said if isinstance(said, list) else said.get("cases", said.get("rows")):
                called = str(row.get("case", row.get("row", f"nodes {row.get('nodes', 0):,}"))).split(": ")
                with self.subTest(name, row=called):
                    for part in (*called, str(row.get("peer", "")), str(row.get("remark", ""))):
                        self.assertIn(run_together(part), words)

    def test_figures_are_told_too(self):
        said = texts(self.drawn(TABLE))
        self.assertIn("0.1 ×; 12 / 120 µs", said)
        self.assertIn("limit 1.2, missed; aim 0.8", said)
        self.assertIn("limit 0.5; aim 0.2", said)
        self.assertIn("50,000,000 bytes of memory", said)
        self.assertIn("Left out: OpenSceneGraph is not installed", said)
        said = texts(self.drawn([{"row": "a", "frame_ms": {"p99": 3, "p50": 2}, "read_mib_s": 5, "core_share": 0.5,
                                  "moves_per_s": 7, "limit_ms": 2.5}]))
        for words in ("In ms", "p50 2, p99 3 ms", "limit 2.5, missed", "In MiB/s", "5 MiB/s", "Shares", "0.5",
                      "7 a second"):
            self.assertIn(words, said)

    def test_ratios_lie_on_both_sides_of_one(self):
        svg = self.drawn(TABLE)
        one, = [float(each.get("x1")) for each in ElementTree.fromstring(svg).iter(f"{SVG}line")
                if each.get("class") == "one"]
        bars = [(float(each.get("x")), float(each.get("width")), each.get("class"))
                for each in ElementTree.fromstring(svg).iter(f"{SVG}rect") if each.get("class") != "ground"][:3]
        self.assertAlmostEqual(bars[0][0] + bars[0][1], one, delta=0.2)  # 0.1: left of it
        self.assertAlmostEqual(bars[1][0], one, delta=0.2)  # 3: right of it, and above its limit
        self.assertEqual([kind for _, _, kind in bars], ["bar", "bar over", "bar"])
        decade = bars[0][1]
        self.assertAlmostEqual(bars[1][1] / decade, math.log10(3), delta=0.02)
        self.assertAlmostEqual(bars[2][1] / decade, 6, delta=0.02)

    def test_no_text_lies_over_another(self):
        width_of = plotter().width_of
        for name, said in self.all_shapes().items():
            with self.subTest(name):
                svg = self.drawn(said, name)
                found = list(boxes(svg, width_of))
                self.assertEqual(list(overlaps(found)), [])
                width, height = map(float, re.search(r'viewBox="0 0 (\d+) (\d+)"', svg).groups())
                outside = [box for box in found if min(box[:2]) < 0 or box[2] > width or box[3] > height]
                self.assertEqual(outside, [])

    @unittest.skipIf(WHY_NOT, WHY_NOT)
    def test_in_a_browser_neither_and_it_is_read_by_day_and_night(self):
        with tempfile.TemporaryDirectory() as folder, Browser(1100, 900) as browser:
            for name, said in self.all_shapes().items():
                path = pathlib.Path(folder, f"{name}.svg")
                path.write_text(self.drawn(said, name), "utf-8")
                browser.open(path.as_uri())
                with self.subTest(name):
                    found = browser.run(BOXES)
                    self.assertGreater(len(found), 5)
                    self.assertEqual(list(overlaps(map(tuple, found))), [])
                    self.assertEqual([box for box in found if box[0] < 0 or box[2] > 1040], [])
            browser.open(pathlib.Path(folder, "table.svg").as_uri())
            grounds = set()
            for scheme in ("light", "dark"):
                browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {
                    "features": [{"name": "prefers-color-scheme", "value": scheme}]})
                colours = browser.run(COLOURS)
                ground = light_of(colours["ground"])
                grounds.add(ground > 0.5)
                for kind, colour in colours.items():
                    if kind != "ground":
                        bright, dim = sorted((ground, light_of(colour)), reverse=True)
                        self.assertGreater((bright + 0.05) / (dim + 0.05), 3 if "bar" in kind else 4.5, (scheme, kind))
            self.assertEqual(grounds, {True, False})

    def test_hostile_names_are_text(self):
        svg = self.drawn(HOSTILE)
        root = ElementTree.fromstring(svg)  # well-formed
        self.assertLessEqual({each.tag for each in root.iter()},
                             {SVG + tag for tag in ("svg", "title", "style", "text", "line", "rect", "circle")})
        said = run_together(texts(svg))
        for words in ("</text><script>alert(1)</script>&amp;\"'", "]]><!--", "notanumber", "beyondallnumbers",
                      "same:yes", "arowthatsaysnothing"):
            self.assertIn(words, said)
        self.assertNotIn("\u202e", svg)

    def test_what_is_no_result_is_refused(self):
        for given, why in ((b"", "it is not JSON"), (b"\xff\xfe\x00", "it is not JSON"),
                           (b'{"cases": [', "it is not JSON"), (b"[" * 100_000, "it is not JSON"),
                           (b"[" + b"9" * 5000 + b"]", "it is not JSON"),
                           ({}, "it holds no rows"), ([], "it holds no row at all"), ({"cases": 7}, "it holds no rows"),
                           ({"rows": [1]}, "it holds no rows"), ("text", "it holds no rows"),
                           ([{f"a{at}_ms": 1 for at in range(6000)}], "it holds more than 5000 lines"),
                           (b" " * ((16 << 20) + 1), "it is larger than 16 MiB")):
            with self.subTest(why):
                ran, svg = picture_of(given)
                self.assertEqual((ran.returncode, ran.stdout, svg), (1, "", None))
                self.assertRegex(ran.stderr, rf"^plot\.py: .*bench\.json: {why}.*\n$")
        ran = subprocess.run([sys.executable, PLOT, "/nowhere/at.json"], capture_output=True, text=True)
        self.assertEqual((ran.returncode, ran.stderr), (1, "plot.py: /nowhere/at.json: No such file or directory\n"))

    def test_numbers_beyond_all_ranges_are_words_alone(self):
        for given in ([{"row": "a", "x_ms": 1e308, "y_ms": -1e308, "z_ms": 3}], [{"row": "a", "x_ms": 5e-324}],
                      [{"row": "a", "x_ms": 2, "ratio": 1e308}], [{"row": "a", "x_ms": 2, "at_most": [1, 2]}]):
            with self.subTest(given):
                ran, svg = picture_of(given)
                self.assertEqual((ran.returncode, ran.stderr), (0, ""))
                self.assertIn("a", run_together(texts(svg)))

    def test_each_benchmark_leaves_what_it_draws(self):
        """A line for each benchmark there is none; but each must leave a file."""
        listed = (ROOT / "tests/bench/CMakeLists.txt").read_text()
        called = re.findall(r"^ *tessera_bench\(([a-z_]+) (\w+)\.cpp", listed, re.M)
        self.assertGreater(len(called), 25)
        silent = [name for name, source in called
                  if not re.search(r'--json|CaseFile', (ROOT / f"tests/bench/{source}.cpp").read_text())]
        self.assertEqual(silent, [])


if __name__ == "__main__":
    unittest.main()
