#!/usr/bin/env python3
"""Skipped tests are named with their reasons, and one without a line in the list fails (`skipped`)."""
import pathlib
import subprocess
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
FOUND = """unit_a.Data/Real.Models/0: no test data
python.shells: fish is not installed
pages.two: two.md: no sshd
"""


class Skipped(unittest.TestCase):
    def said(self, allowed, found=FOUND):
        with tempfile.TemporaryDirectory() as folder:
            build = pathlib.Path(folder)
            if found is not None:
                (build / "skips").write_text(found)
            (build / "allowed").write_text(allowed)
            done = subprocess.run([HERE / "skipped", build / "skips", "--allowed", build / "allowed"],
                                  capture_output=True, text=True, timeout=60)
            return done.returncode, done.stdout.splitlines()

    def test_each_is_named_with_its_reason(self):
        code, lines = self.said("# a list\n*Data/*  models lie elsewhere\npython.shells x\npages.* y\n")
        self.assertEqual(code, 0)
        self.assertEqual(lines, [f"skipped: {line}" for line in sorted(FOUND.splitlines())])

    def test_one_that_is_not_listed_fails(self):
        code, lines = self.said("*Data/*  models lie elsewhere\npages.* y\n")
        self.assertEqual(code, 1)
        self.assertIn("skipped, and must not be: python.shells: fish is not installed", lines)

    def test_a_line_without_a_reason_fails(self):
        self.assertEqual(self.said("*\n")[0], 1)

    def test_nothing_skipped_is_nothing_said(self):
        self.assertEqual(self.said("", found=None), (0, []))


if __name__ == "__main__":
    unittest.main()
