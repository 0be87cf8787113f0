#!/usr/bin/python3
"""Runs modules of tests of this folder: `tests/python/run.py codec …`; without words all. 77: skipped, and why."""
import importlib.util
import os
import pathlib
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
BUILD = pathlib.Path(os.environ.get("TESSERA_BUILD", HERE.parents[1] / "build"))
sys.dont_write_bytecode = True
sys.path[:0] = [str(BUILD / "python"), str(HERE)]


def main():
    if importlib.util.find_spec("numpy") is None:
        print("skipped: python3-numpy is not installed (./deploy/set-up installs it)")
        return 77
    names = [f"test_{name}" for name in sys.argv[1:]] or sorted(path.stem for path in HERE.glob("test_*.py"))
    suite = unittest.TestSuite(unittest.defaultTestLoader.loadTestsFromName(name) for name in names)
    result = unittest.TextTestRunner().run(suite)
    for test, reason in result.skipped:
        print(f"{test.id()}: Skipped\n{reason}")  # as run-tests looks for it
    if not result.wasSuccessful():
        return 1
    return 77 if result.skipped and len(result.skipped) == result.testsRun else 0


if __name__ == "__main__":
    sys.exit(main())
