"""From the lines that documents show to what is run, group by group."""
import re
import shlex
from dataclasses import dataclass, field

import extract
import table

SCENE_GROUPS = [f"Scenes{n}" for n in range(1, 6)]
GROUPS = ["Install", "Build", "ScriptsOfTests", "Benches", "BenchesInPython", "Installed", *SCENE_GROUPS, "Options",
          "Hall", "Rooms", "Asked", "ByHand", "Desk", "Files", "Tests", "Gallery", "Slow"]
# Scenes that take seconds to read or to draw even so small.
HEAVY = ("plant.tsct", "pour-10000.tsct", "gallery.tsct")


@dataclass
class Task:
    name: str  # the line, as it is shown
    row: table.Row
    where: list = field(default_factory=list)  # where it is shown


def smaller(words, run_wall):
    """A run of a wall, small and with two frames; what the line says besides stays."""
    words = list(words)

    def given(option):
        return any(w == option or w.startswith(option + "=") for w in words)

    if "--frames" in words:
        words[words.index("--frames") + 1] = "2"
    else:
        words += ["--frames", "10" if given("--deform") else "2"]
    if not given("--size"):
        words += ["--size", "64x36"]
    if not given("--wall") and given("--scene"):
        words += ["--wall", "1x1"]  # a quarter of the processes; `./deploy/run-wall` alone has them all
    if run_wall:
        words.insert(1, "--no-install")
    return words


def rule(text, walls_so_far):
    """What is run of a line that has no row, or nothing."""
    words = text.split("\n")[0]
    if re.match(r"\./deploy/run-wall(\s|$)", words) and "--window" not in words and "ANY" not in words:
        words = shlex.split(words)
        needs = ()
        if "PLANT" in words:
            words[words.index("PLANT")] = "$DATA/plant"
            needs = ("plant",)
        run = " ".join(w if w.startswith("$") else shlex.quote(w) for w in smaller(words, True))
        heavy = any(w.endswith(HEAVY) for w in words)
        group = "Slow" if heavy else SCENE_GROUPS[walls_so_far % len(SCENE_GROUPS)]
        port = "TESSERA_DEFORM_PORT=$PORT " if "--deform" in words else ""
        return table.Row(group, port + run, says="tessera-wall: ", leaves=("out/wall.png", "out/report.json"),
                         needs=needs, slow=heavy)
    if words.startswith("./deploy/run-bench "):
        return table.Row("Benches", "run_bench " + " ".join(shlex.quote(w) for w in shlex.split(words)[1:]))
    return None


def plan(root):
    """(tasks, faults): each line once, however often it is shown."""
    tasks, faults, known = [], [], {}
    walls = 0
    for line in extract.command_lines(root):
        key = line.text
        if key in known:
            known[key].where.append(line)
            continue
        row = table.ROWS.get(key.split("\n")[0])
        if row is None:
            row = rule(key, walls)
            if row is not None and row.group in SCENE_GROUPS:
                walls += 1
        if row is None:
            faults.append(f"{line}\n    no row in tests/commands/table.py says how this is run, or why it is not")
            continue
        known[key] = Task(key, row, [line])
        tasks.append(known[key])
    shown = {key.split("\n")[0] for key in known}
    for key in table.ROWS:
        if key not in shown:
            faults.append(f"tests/commands/table.py: no document shows this line any more: {key}")
    for group, run, leaves in table.MORE_LINES:
        tasks.append(Task(run, table.Row(group, run, leaves=leaves)))
    for task in tasks:
        if not task.row.elsewhere and task.row.group not in GROUPS:
            faults.append(f"{task.name}: its group '{task.row.group}' is none of plan.GROUPS")
    return tasks, faults


def script_of(task):
    text = task.row.run or task.name
    for what, by in task.row.changes:
        assert what in text, f"{task.name}: there is no '{what}' in it"
        text = text.replace(what, by)
    return text


def options_used(tasks):
    """Long options of all walls that are run."""
    used = set()
    for task in tasks:
        script = script_of(task)
        if not task.row.elsewhere and re.search(r"run-wall|tessera-wall", script):
            used.update(re.findall(r"(?<!\S)(--[a-z][\w-]*)", script))
    return used
