#!/usr/bin/env python3
"""`run-tests` refuses what it does not know before it sets anything up."""
import pathlib
import subprocess
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Options(unittest.TestCase):
    def test_what_is_no_option_is_refused(self):
        for words, said in ((["--bogus"], "unknown option --bogus"), (["--quik"], "unknown option --quik"),
                            (["-R"], "-R wants a value"), (["--all", "unit_base"], "unknown option unit_base"),
                            (["--quick", "-R", "x", "--bear"], "unknown option --bear"),
                            (["--all=gcc"], "--all=gcc: the parts are clang, asan, tsan, world"),
                            (["--all=clang asan"], "--all=clang asan: the parts are clang, asan, tsan, world"),
                            (["-N"], "unknown option -N"), (["--show-only"], "unknown option --show-only"),
                            (["--seed", "4"], "--seed is of --storm"),
                            (["--only", "x", "-R", "y"], "-R: --only takes no options of ctest"),
                            (["--only"], "--only wants a part of a name"),
                            (["--fuzz"], "--fuzz takes a number of seconds"),
                            (["--storm", "0"], "--storm takes a number of seconds"),
                            (["--hunt"], "--hunt takes a number of runs"),
                            (["--hunt", "1", "-R", "x"], "-R: --hunt takes no options of ctest"),
                            (["--storm", "5", "--seed", "x"], "--seed takes a number")):
            done = subprocess.run([ROOT / "deploy/run-tests", "--no-install", *words], capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stdout), (2, ""), words)
            self.assertEqual(done.stderr, f"run-tests: {said}\n")


if __name__ == "__main__":
    unittest.main()
