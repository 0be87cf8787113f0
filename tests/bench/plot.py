#!/usr/bin/python3
"""Draws what a benchmark has found: `plot.py NAME.json [NAME.svg]`. `./deploy/run-bench` calls it.

It knows no benchmark by name; it reads what their files have in common:
  {"cases": [...]}, {"rows": [...]} or a list: an object for each row. `case` or `row` is its name; `peer`, `beside` and
  other words say more of it. `ratio` (or `times_…`) is drawn on a logarithmic scale about the line of 1 ×, with
  `at_most`, `aim` or `at_least` as its limits.
  Every other number is drawn with the numbers of its unit; its key ends with the unit: `p99_ms`, `read_MiB`. Numbers
  that differ in `p50`, `p99`, `most`, … alone share a line, and a `limit_ms` is the limit of its row.
No library beyond Python's own: a picture is some lines of text, and a benchmark's machine needs nothing more for it."""
import json
import math
import pathlib
import sys
import unicodedata
from xml.sax.saxutils import escape

LARGEST = 16 << 20  # bytes of a file
MOST_LINES = 5000
WIDTH, LEFT, PLOT, GAP = 1040, 380, 300, 18  # px: the picture, names, marks, between
RIGHT = WIDTH - LEFT - PLOT - 3 * GAP - GAP  # figures in words
LINE, STEP = 16, 6  # px: a line of text, between rows
FONT = 12

# Wide enough for DejaVu Sans, the widest of the usual fonts: in shares of the size, by character.
NARROW = set("iIjl.,:;|!'`()[]{}/\\ ftr-")
BROAD = set("mwMW@%—×")


def width_of(text, size=FONT):
    wide = 0.0
    for letter in text:
        if unicodedata.combining(letter):
            continue
        if letter in NARROW:
            wide += 0.42
        elif ord(letter) > 0xFFFF:
            wide += 1.3
        elif letter in BROAD or unicodedata.east_asian_width(letter) in "WF":
            wide += 1.02
        elif letter.isupper() or ord(letter) > 0x2000:
            wide += 0.8
        else:
            wide += 0.66
    return wide * size


def wrapped(text, room, size=FONT):
    """Lines of at most so many pixels; what has no space is cut anywhere."""
    lines, now = [], ""
    for word in text.split(" "):
        joined = f"{now} {word}" if now else word
        if width_of(joined, size) <= room:
            now = joined
            continue
        if now:
            lines.append(now)
        while width_of(word, size) > room:
            fits = 1
            while width_of(word[:fits + 1], size) <= room:
                fits += 1
            lines.append(word[:fits])
            word = word[fits:]
        now = word
    return [*lines, now] if now or not lines else lines


# --- What the file says -----------------------------------------------------------------------------------------------

class Refused(Exception):
    """A sentence that says what is wrong with a file."""


UNITS = {"ns": "ns", "us": "µs", "ms": "ms", "s": "s", "mm": "mm", "mib": "MiB", "kb": "kB", "mb": "MB",
         "bytes": "bytes", "px": "px", "share": "share", "percent": "%"}
STATISTICS = ("least", "min", "p50", "median", "mean", "rms", "p99", "most", "max", "longest", "worst")
LIMITS = ("at_most", "atMost", "aim", "at_least")


class Line:
    """One row of a chart: marks are (what, value) in the order of the file. `figure`: which of its row's figures."""

    def __init__(self, group, name, beside="", figure=""):
        self.group, self.name, self.beside, self.figure = group, name, beside, figure
        self.marks, self.limits, self.words = [], [], ""


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def finite(value):
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


def plain(text):
    """Of names: what XML cannot hold, or what would turn the text around, becomes a mark that can be seen."""
    def shown(letter):
        return " " if letter.isspace() else "\ufffd" if unicodedata.category(letter)[0] == "C" else letter

    return "".join(map(shown, str(text))).strip()


def unit_of(words):
    """Takes the unit away from a key's words: the unit, and what is left."""
    small = [word.lower() for word in words]
    for end in (["s"], ["per", "s"]):
        if small[-len(end):] == end and small[:-len(end)] and small[-len(end) - 1] in ("mib", "kb", "mb", "bytes"):
            return UNITS[small[-len(end) - 1]] + "/s", words[:-len(end) - 1]
    if small[-2:] == ["per", "s"]:
        return "a second", words[:-2]
    if small and small[-1] in UNITS:
        return UNITS[small[-1]], words[:-1]
    if len(small) > 1 and small[0] in UNITS:
        return UNITS[small[0]], words[1:]
    return "", words


def leaves(value, path=()):
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, (*path, *plain(key).replace("-", "_").split("_")))
    else:
        yield path, value


def number(value):
    if not finite(value):
        return "not a number" if value != value else "beyond all numbers"
    value = float(value)
    if value == 0:
        return "0"
    if abs(value) >= 1e9 or abs(value) < 1e-3:
        return f"{value:.3g}"
    if abs(value) >= 1000:
        return f"{value:,.0f}"
    return f"{value:.3g}"


def rows_of(said):
    rows = said if isinstance(said, list) else said.get("cases", said.get("rows")) if isinstance(said, dict) else None
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise Refused('it holds no rows: a list, or {"cases": […]} or {"rows": […]}, of objects was expected')
    if not rows:
        raise Refused("it holds no row at all")
    return rows


def name_of(row):
    """The group, the name, and the keys that have been used for them."""
    used = {"case", "row", "peer", "beside", "unit", "remark"}
    name = row.get("case", row.get("row"))
    if name is None:
        first = next(iter(row), None)
        if first is None:
            return "", "a row that says nothing", used
        used.add(first)
        value = row[first]
        name = f"{first.replace('_', ' ')} {f'{value:,}' if is_number(value) else value}"
    group, colon, rest = plain(name).partition(": ")
    return (group, rest, used) if colon and rest else ("", plain(name), used)


class Charts:
    """The lines of a file, by unit; ratios come first, under "×"."""

    def __init__(self, said):
        self.lines = {}
        for row in rows_of(said):
            self.read(row)
        if sum(map(len, self.lines.values())) > MOST_LINES:
            raise Refused(f"it holds more than {MOST_LINES} lines to draw")

    def line(self, unit, group, name, beside="", figure=""):
        made = Line(group, name, beside, figure)
        self.lines.setdefault(unit, []).append(made)
        return made

    def read(self, row):
        group, name, used = name_of(row)
        beside = plain(row.get("peer", row.get("beside", "")) or "")
        remark = plain(row.get("remark", "") or "")
        if "peer" in row and is_number(row.get("ours")):
            self.read_case(row, group, name, beside, remark)
            return
        said = [plain(f"{' '.join(path)}: {'yes' if value is True else 'no' if value is False else value}")
                for path, value in leaves({key: value for key, value in row.items() if key not in used})
                if not is_number(value) and not isinstance(value, list) and value is not None]
        beside = ", ".join(filter(None, [beside, *said, remark]))
        found, limits = {}, {}
        for path, value in leaves({key: value for key, value in row.items() if key not in used}):
            values = [each for each in value if is_number(each)] if isinstance(value, list) else [value]
            if not values or not all(map(is_number, values)):
                continue
            if "_".join(path) in LIMITS and is_number(value):
                limits.setdefault("×", []).append(("_".join(path), value))
                continue
            statistic = next((word for word in path if word in STATISTICS), "")
            words = [word for word in path if word != statistic]
            if words[:1] in (["ratio"], ["times"]):
                unit, words = "×", ["beside", *words[1:]] if words[0] == "times" else words[1:]
            else:
                unit, words = unit_of(words)
            if words == ["limit"] and is_number(value):
                limits.setdefault(unit, []).append(("at_most", value))
                continue
            rest = " ".join(words)
            line = found.get((unit, rest))
            if line is None:
                line = found[unit, rest] = self.line(unit, group, name, beside, rest)
            line.marks += [(statistic, each) for each in values]
        for unit, given in limits.items():
            for (of, _), line in found.items():
                if of == unit:
                    line.limits += given
        for line in found.values():
            line.marks.sort(key=lambda mark: STATISTICS.index(mark[0]) if mark[0] else 0)
        if not found:
            self.line("words", group, name, beside)

    def read_case(self, row, group, name, beside, remark):
        """A row of ours beside theirs; where there are no theirs, a figure of its own."""
        unit, ours, theirs, ratio = plain(row.get("unit", "")), row["ours"], row.get("theirs"), row.get("ratio")
        unit = "µs" if unit == "us" else unit
        if not is_number(theirs) or not is_number(ratio) or not (finite(ratio) and ratio > 0):
            line = self.line(unit or "", group, name, ", ".join(filter(None, [beside, remark])))
            line.marks.append(("", ours))
            return
        line = self.line("×", group, name, beside)
        line.marks.append(("", ratio))
        line.limits = [(key, row[key]) for key in LIMITS if is_number(row.get(key)) and row[key] > 0]
        line.words = f"{number(ours)} / {number(theirs)} {unit}".strip()
        if remark:
            line.words += f"; {remark}"


# --- The picture ------------------------------------------------------------------------------------------------------

def placed(value):
    """Beyond, ranges are no numbers any more."""
    return finite(value) and (value == 0 or 1e-300 < abs(value) < 1e300)


class Scale:
    """From values to pixels: logarithmic for ratios and wide ranges, else from 0."""

    def __init__(self, values, ratio):
        values = [float(value) for value in values if placed(value)]
        above = [value for value in values if value > 0]
        self.log = ratio or bool(above) and min(values) >= 0 and max(above) > 50 * sorted(above)[len(above) // 4]
        if self.log:
            above = above or [1.0]
            self.low, self.high = math.log10(min(above)), math.log10(max(above))
            if ratio:
                near = 0.32 if self.high - self.low < 0.6 and max(self.high, -self.low) < 0.6 else 0.0  # 0.5 to 2
                self.low, self.high = min(self.low, -near), max(self.high, near)
            short = max(0.0, 0.5 - (self.high - self.low)) / 2
            edge = 0.04 * (self.high - self.low) + 0.02
            self.low, self.high = self.low - short - edge, self.high + short + edge
        else:
            self.low, self.high = min([0.0, *values]), max([0.0, *values]) or 1.0
            self.high += 0.03 * (self.high - self.low)

    def at(self, value):
        """None: it has no place, as a 0 has none among logarithms."""
        if not placed(value) or self.log and value <= 0:
            return None
        value = math.log10(value) if self.log else float(value)
        return LEFT + 2 * GAP + PLOT * (value - self.low) / (self.high - self.low)

    def ticks(self):
        if not self.log:
            decade = 10.0 ** math.floor(math.log10((self.high - self.low) / 6))
            for step in (decade * by for by in (1, 2, 5, 10, 20, 50)):
                found = [at * step for at in range(math.ceil(self.low / step), math.floor(self.high / step) + 1)]
                if len(found) <= 6 and all(width_of(number(each)) + 12 < PLOT * step / (self.high - self.low)
                                           for each in found):
                    return found
            return []
        for factors, every in (((1, 2, 5), 1), ((1,), 1), ((1,), 2), ((1,), 3), ((1,), 5), ((1,), 20), ((1,), 100)):
            found = [factor * 10.0 ** decade for decade in range(math.floor(self.low), math.ceil(self.high) + 1)
                     if decade % every == 0 for factor in factors
                     if self.low <= math.log10(factor) + decade <= self.high]
            places = [(self.at(each), width_of(number(each)) / 2 + 6) for each in found]
            if all(b - a > half + more for (a, half), (b, more) in zip(places, places[1:])):
                return found
        return []


STYLE = """
  text { font: 12px "DejaVu Sans", Verdana, Arial, sans-serif; fill: #1c2430; }
  .ground { fill: #ffffff; } .title, .head, .group { font-weight: bold; } .title { font-size: 18px; }
  .head { font-size: 14px; } .faint { fill: #566070; } .missed { fill: #a82a00; }
  .grid { stroke: #dde2ea; } .one { stroke: #1c2430; } .limit { stroke: #a82a00; stroke-width: 2; }
  .aim { stroke: #12744a; stroke-width: 2; stroke-dasharray: 3 2; }
  .bar { fill: #2f6fb5; } .bar.over { fill: #d9541e; } .mark { fill: #2f6fb5; }
  .range { stroke: #2f6fb5; stroke-width: 2; } .hollow { fill: #ffffff; stroke: #2f6fb5; stroke-width: 2; }
  @media (prefers-color-scheme: dark) {
    text { fill: #e6eaf0; } .ground { fill: #151a21; } .faint { fill: #a3adba; } .missed { fill: #ff9a6b; }
    .grid { stroke: #2c343f; } .one { stroke: #e6eaf0; } .limit { stroke: #ff9a6b; } .aim { stroke: #5fd39b; }
    .bar { fill: #5a9be0; } .bar.over { fill: #f07a3f; } .mark { fill: #5a9be0; } .range { stroke: #5a9be0; }
    .hollow { fill: #151a21; stroke: #5a9be0; }
  }
"""


class Picture:
    def __init__(self):
        self.parts, self.y = [], GAP

    def text(self, x, y, words, kind="", size=FONT, middle=False):
        place = ' text-anchor="middle"' if middle else ""
        kind = f' class="{kind}"' if kind else ""
        self.parts.append(f'<text x="{x:.1f}" y="{y + 0.8 * size:.1f}"{kind}{place}>{escape(words)}</text>')

    def lines(self, x, y, lines, kind="", size=FONT):
        for at, words in enumerate(lines):
            self.text(x, y + at * LINE, words, kind, size)

    def stroke(self, x, top, bottom, kind):
        self.parts.append(f'<line class="{kind}" x1="{x:.1f}" y1="{top:.1f}" x2="{x:.1f}" y2="{bottom:.1f}"/>')

    def heading(self, words, kind, size, step):
        for line in wrapped(words, WIDTH - 2 * GAP, 1.1 * size):
            self.text(GAP, self.y, line, kind, size)
            self.y += step

    def whole(self, title):
        size = f'width="{WIDTH}" height="{self.y:.0f}"'
        return "\n".join([f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="0 0 {WIDTH} {self.y:.0f}" '
                          'role="img">', f"<title>{escape(title)}</title>", f"<style>{STYLE}</style>",
                          f'<rect class="ground" {size}/>', *self.parts, "</svg>\n"])


def broken_by(key, limit, value):
    return value < limit if key == "at_least" else key != "aim" and value > limit


def verdict(line):
    """What a row comes to beside its limits, in words."""
    said = []
    for key, limit in line.limits:
        missed = any(finite(value) and broken_by(key, limit, value) for _, value in line.marks)
        said.append({"at_least": "at least", "aim": "aim"}.get(key, "limit") + f" {number(limit)}"
                    + (", missed" if missed else ""))
    return "; ".join(said)


def figures(line, unit):
    if len(line.marks) > 3 and not line.marks[0][0]:  # a list
        values = sorted(value for _, value in line.marks)
        return f"{number(values[0])} to {number(values[-1])} {unit}, {len(values)} values".replace("  ", " ")
    said = ", ".join(f"{what} {number(value)}".strip() for what, value in line.marks)
    return f"{said} {unit if unit != 'share' else ''}".strip()


def draw_marks(picture, line, scale, top, ratio):
    middle = top + LINE / 2
    over = any(finite(value) and broken_by(key, limit, value) for key, limit in line.limits for _, value in line.marks)
    places = [(what, scale.at(value)) for what, value in line.marks]
    known = [x for _, x in places if x is not None]
    if ratio or not scale.log and len(line.marks) == 1:
        base = scale.at(1 if ratio else 0)
        for x in known:
            begin, long = min(base, x), max(1.0, abs(x - base))
            picture.parts.append(f'<rect class="bar{" over" if over else ""}" x="{begin:.1f}" y="{middle - 5:.1f}" '
                                 f'width="{long:.1f}" height="10"/>')
    else:
        if len(known) > 1:
            picture.parts.append(f'<line class="range" x1="{min(known):.1f}" y1="{middle:.1f}" x2="{max(known):.1f}" '
                                 f'y2="{middle:.1f}"/>')
        for what, x in places:
            if x is None:
                continue
            kind = "mark" if what in ("", "p50", "median", "mean", "rms") else "hollow"
            picture.parts.append(f'<circle class="{kind}" cx="{x:.1f}" cy="{middle:.1f}" r="4"/>')
    for key, limit in line.limits:
        x = scale.at(limit)
        if x is not None:
            picture.stroke(x, middle - 9, middle + 9, "aim" if key == "aim" else "limit")


def grouped(lines):
    """Side by side what is to be compared: the same figure of several rows, or the figures of one row."""
    figures_of = {line.figure for line in lines}
    if figures_of == {""}:
        return lines
    whole = [f"{line.group}: {line.name}" if line.group else line.name for line in lines]
    by_figure = len(lines) >= 2 * len(figures_of)
    for line, row in zip(lines, whole):
        figure = line.figure or ", ".join(what for what, _ in line.marks if what) or "itself"
        line.group, line.name = (figure, row) if by_figure else (row, figure)
    if by_figure:
        order = list(dict.fromkeys(line.group for line in lines))
        return sorted(lines, key=lambda line: order.index(line.group))
    return lines


def draw_chart(picture, unit, lines):
    ratio = unit == "×"
    besides = {line.beside for line in lines}
    shared = besides.pop() if len(besides) == 1 and len(lines) > 1 else ""
    head = ("Ratios" + (f" beside {shared}" if shared else "") if ratio else
            {"words": "In words", "share": "Shares", "a second": "A second", "": "Numbers"}.get(unit, f"In {unit}"))
    picture.y += GAP
    picture.heading(head, "head", 14, 22)
    scale = None
    if unit != "words":
        scale = Scale([value for line in lines for _, value in line.marks + line.limits], ratio)
        kinds = ["logarithmic scale" if scale.log else "scale from 0"]
        if ratio:
            kinds.append("the strong line is 1 ×")
            if any(line.words for line in lines):
                kinds.append("in figures ours / theirs")
        elif any(len(line.marks) > 1 for line in lines):
            kinds.append("full circle: p50, median, mean or one value; hollow: the others")
        if any(key != "aim" for line in lines for key, _ in line.limits):
            kinds.append("red stroke: limit")
        if any(key == "aim" for line in lines for key, _ in line.limits):
            kinds.append("dashed green stroke: aim")
        if shared and not ratio:
            kinds.append(f"of all: {shared}")
        picture.heading("; ".join(kinds), "faint", FONT, LINE + 4)
        ticks = [(scale.at(value), number(value)) for value in scale.ticks()]
        for x, words in ticks:
            picture.text(x, picture.y, words, "faint", middle=True)
        picture.y += LINE + 4
    grid, begun, group = len(picture.parts), picture.y, ""
    for line in grouped(lines):
        if line.group and line.group != group:
            picture.y += STEP
            for words in wrapped(line.group, LEFT, 1.1 * FONT):
                picture.text(GAP, picture.y, words, "group")
                picture.y += LINE
        group = line.group
        names = wrapped(line.name or "(no name)", LEFT)
        besides = wrapped(line.beside, LEFT) if line.beside and line.beside != shared else []
        said = "; ".join(filter(None, [figures(line, unit) if scale else "", line.words]))
        right = wrapped(said, RIGHT) if said else []
        limits = verdict(line)
        verdicts = wrapped(limits, RIGHT) if limits else []
        height = LINE * max(len(names) + len(besides), len(right) + len(verdicts), 1)
        picture.lines(GAP, picture.y, names)
        picture.lines(GAP, picture.y + LINE * len(names), besides, "faint")
        x = LEFT + PLOT + 3 * GAP
        picture.lines(x, picture.y, right)
        picture.lines(x, picture.y + LINE * len(right), verdicts, "missed" if "missed" in limits else "faint")
        if scale:
            draw_marks(picture, line, scale, picture.y - 2, ratio)
        picture.y += height + STEP
    if scale:
        behind = Picture()
        for x, _ in ticks:
            behind.stroke(x, begun - 2, picture.y - STEP, "grid")
        if ratio:
            behind.stroke(scale.at(1), begun - 2, picture.y - STEP, "one")
        picture.parts[grid:grid] = behind.parts


def drawn(name, said):
    charts = Charts(said)
    picture = Picture()
    picture.heading(plain(name), "title", 18, 26)
    beside = [f"./deploy/run-bench {plain(name)}"]
    if isinstance(said, dict):
        load, cores = said.get("load"), said.get("cores")
        if isinstance(load, list) and load and all(map(is_number, load)):
            beside.append(f"load at its end {number(load[0])}")
        if is_number(cores):
            beside.append(f"{number(cores)} cores")
    picture.heading("; ".join(beside), "faint", FONT, LINE)
    for unit in sorted(charts.lines, key=lambda unit: (unit != "×", unit == "", unit == "words")):
        draw_chart(picture, unit, charts.lines[unit])
    skipped = said.get("skipped") if isinstance(said, dict) else None
    if isinstance(skipped, list):
        picture.y += STEP
        for what in skipped[:100]:
            picture.heading(f"Left out: {plain(what)}", "faint", FONT, LINE)
    picture.y += GAP
    return picture.whole(f"{plain(name)}: what ./deploy/run-bench {plain(name)} found")


def read(path):
    if path.stat().st_size > LARGEST:
        raise Refused(f"it is larger than {LARGEST >> 20} MiB")
    try:
        return json.loads(path.read_bytes())
    except (ValueError, RecursionError) as why:
        raise Refused(f"it is not JSON: {str(why).splitlines()[0]}") from None


def main(words):
    if len(words) not in (1, 2) or words[0].startswith("-"):
        print("usage: plot.py NAME.json [NAME.svg]", file=sys.stderr)
        return 2
    source = pathlib.Path(words[0])
    target = pathlib.Path(words[1]) if len(words) > 1 else source.with_suffix(".svg")
    try:
        picture = drawn(source.stem, read(source))
        part = target.with_name(target.name + ".part")
        part.write_text(picture, encoding="utf-8")
        part.replace(target)
    except (Refused, OSError) as why:
        print(f"plot.py: {source}: {why.strerror if isinstance(why, OSError) else why}", file=sys.stderr)
        return 1
    print(target)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
