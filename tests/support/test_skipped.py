#!/usr/bin/env python3
"""Skipped tests are named with their reasons, and one without a line in the list fails (`skipped`)."""
import pathlib
import subprocess
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
LOG = """1/4 Test: unit_a.Runs
Output:
fine
2/4 Test: unit_a.Data/Real.Models
Output:
a.cpp:3: Skipped
no test data
3/4 Test: python.shells
Output:
test_shells.Shells.test_fish: Skipped
fish is not installed
"""
RESULTS = """<testsuite>
<testcase name="unit_a.Runs" status="run"><system-out>fine</system-out></testcase>
<testcase name="unit_a.Data/Real.Models" status="notrun"><skipped message="SKIP_REGULAR_EXPRESSION_MATCHED"/>
<system-out>a.cpp:3: Skipped</system-out></testcase>
<testcase name="python.shells" status="run"/>
<testcase name="pages.two" status="notrun"><skipped message="SKIP_RETURN_CODE=77"/>
<system-out>began
skipped: two.md: no sshd</system-out></testcase>
<testcase name="unit_b.Gone" status="notrun"><skipped message="Unable to find executable"/></testcase>
</testsuite>"""


class Skipped(unittest.TestCase):
    def said(self, allowed):
        with tempfile.TemporaryDirectory() as folder:
            build = pathlib.Path(folder)
            (build / "Testing/Temporary").mkdir(parents=True)
            (build / "Testing/Temporary/LastTest.log").write_text(LOG)
            (build / "tests.xml").write_text(RESULTS)
            (build / "allowed").write_text(allowed)
            done = subprocess.run([HERE / "skipped", build, "--allowed", build / "allowed"], capture_output=True,
                                  text=True, timeout=60)
            return done.returncode, done.stdout.splitlines()

    def test_each_is_named_with_its_reason(self):
        code, lines = self.said("# a list\n*Data/*  models lie elsewhere\npython.shells x\npages.* y\n")
        self.assertEqual(code, 0)
        self.assertEqual(lines, ["skipped: python.shells: fish is not installed",
                                 "skipped: unit_a.Data/Real.Models: no test data",
                                 "skipped: pages.two: skipped: two.md: no sshd"])

    def test_one_that_is_not_listed_fails(self):
        code, lines = self.said("*Data/*  models lie elsewhere\npages.* y\n")
        self.assertEqual(code, 1)
        self.assertIn("skipped, and must not be: python.shells: fish is not installed", lines)

    def test_a_line_without_a_reason_fails(self):
        self.assertEqual(self.said("*\n")[0], 1)


if __name__ == "__main__":
    unittest.main()
