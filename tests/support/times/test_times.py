#!/usr/bin/env python3
"""test_times.py [BUILD]: that TestTimes.cmake gives entries their time-outs, on machines of several speeds, and that
each entry of the folder BUILD has a line in times.txt. It runs ctest."""
import json
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
TABLE = """# a table
speed 64
unit_slow 12.50 3.00
unit_waits 0.20 20.10
unit_quick 0.80 0.90
unit_gone 1.00 1.00
"""
NAMES = ("unit_slow", "unit_waits", "unit_quick", "unit_unknown")


def entries(folder):
    found = subprocess.run(["ctest", "--show-only=json-v1"], cwd=folder, capture_output=True, text=True, check=True)
    assert not found.stderr, found.stderr
    return {test["name"]: {p["name"]: p["value"] for p in test["properties"]}
            for test in json.loads(found.stdout)["tests"]}


def limits(folder, milliseconds):
    """Of each entry, where the machine takes so long for what took 64 ms."""
    (folder / "times.txt").write_text(TABLE)
    speed = folder / "speed"
    speed.write_text(f"#!/bin/sh\necho {milliseconds}\n")
    speed.chmod(0o755)
    (folder / "CTestTestfile.cmake").write_text(
        "".join(f"add_test({name} true)\n" for name in NAMES) +
        f'set(table "{folder}/times.txt")\nset(speed "{speed}")\nset(factor 1)\ninclude("{HERE}/TestTimes.cmake")\n')
    told = entries(folder)
    for entry in told.values():
        if "TIMEOUT" in entry:  # run-entry stops it before ctest does
            assert entry["ENVIRONMENT_MODIFICATION"] == [f"TESSERA_LIMIT=set:{entry['TIMEOUT'] - 20:.0f}"], entry
    return tuple(told[name].get("TIMEOUT") for name in NAMES)


with tempfile.TemporaryDirectory() as name:
    for speed, expected in ((64, (150, 230, 50, None)), (32, (150, 230, 50, None)), (192, (410, 650, 110, None))):
        got = limits(pathlib.Path(name), speed)
        assert got == expected, f"{speed} ms for 64: {got}"
if len(sys.argv) > 1:
    lines = (HERE.parents[1] / "times.txt").read_text(encoding="utf-8").splitlines()
    listed = {line.split()[0] for line in lines if line and not line.startswith("#")} - {"speed"}
    there = entries(sys.argv[1])
    default = {name for name, entry in there.items() if "world" not in entry.get("LABELS", [])}
    assert default <= listed, f"without a line (run-tests --times): {sorted(default - listed)}"
    assert listed <= set(there), f"no entries any more: {sorted(listed - set(there))}"
