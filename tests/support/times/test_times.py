#!/usr/bin/env python3
"""test_times.py: that TestTimes.cmake gives tests their time-outs, on machines of several speeds. It runs ctest."""
import json
import pathlib
import subprocess
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
TABLE = """# a table
speed 64
unit_one * 4
unit_one A.IsSlow 12.5
"""
NAMES = ("one.A.IsSlow", "one.A.IsQuick", "two.B.IsUnknown")
TESTS = "".join("add_test([=[{0}.{1}]=]  /bin/unit_{0} --gtest_filter={1} --also)\n".format(*name.split(".", 1))
                for name in NAMES)


def times_out(folder, milliseconds):
    """Of each test, where the machine takes so long for what took 64 ms."""
    (folder / "times.txt").write_text(TABLE)
    (folder / "one_tests.cmake").write_text(TESTS)
    speed = folder / "speed"
    speed.write_text(f"#!/bin/sh\necho {milliseconds}\n")
    speed.chmod(0o755)
    (folder / "CTestTestfile.cmake").write_text(
        f'include("{folder}/one_tests.cmake")\nset(table "{folder}/times.txt")\nset(speed "{speed}")\n'
        f'set(folder "{folder}")\nset(factor 1)\ninclude("{HERE}/TestTimes.cmake")\n')
    found = subprocess.run(["ctest", "--show-only=json-v1"], cwd=folder, capture_output=True, text=True, check=True)
    assert not found.stderr, found.stderr
    return {test["name"]: next(p["value"] for p in test["properties"] if p["name"] == "TIMEOUT")
            for test in json.loads(found.stdout)["tests"]}


with tempfile.TemporaryDirectory() as name:
    for milliseconds, expected in ((64, (125, 40, 200)), (32, (125, 40, 200)), (192, (375, 120, 600))):
        got = times_out(pathlib.Path(name), milliseconds)
        assert tuple(got[test] for test in NAMES) == expected, f"{milliseconds} ms for 64: {got}"
