#!/usr/bin/env python3
"""`run-entry` ends as its program does, and its last lines name what failed and how to repeat it."""
import os
import pathlib
import stat
import subprocess
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
RUN = ("[==========] Running 2 tests from 1 test suite.\n[ RUN      ] A.One\n[       OK ] A.One (0 ms)\n"
       "[ RUN      ] A.Two\n")


class RunEntry(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.program = pathlib.Path(self.folder.name) / "program"

    def run_it(self, script, *options, **variables):
        self.program.write_text(f"#!/bin/bash\n{script}\n")
        self.program.chmod(self.program.stat().st_mode | stat.S_IXUSR)
        own = {name: value for name, value in os.environ.items() if not name.startswith(("TESSERA_", "GTEST_"))}
        done = subprocess.run([HERE / "run-entry", *options, "entry", self.program, "word"], capture_output=True,
                              text=True, timeout=60, env={**own, **variables})
        return done.returncode, done.stdout

    def files(self, *names):
        return {name: str(pathlib.Path(self.folder.name) / name) for name in names}

    def gtest(self, rest, **variables):
        code, said = self.run_it(f"cat <<'TEXT'\n{RUN}{rest}\nTEXT\n{variables.pop('then', '')}", "--shard", "1/3",
                                 **variables)
        return code, said.splitlines()

    def test_what_passes_passes(self):
        code, lines = self.gtest("[       OK ] A.Two (0 ms)")
        self.assertEqual((code, lines[-1]), (0, "[       OK ] A.Two (0 ms)"))

    def test_a_skip_is_one(self):
        self.assertEqual(self.run_it("exit 77")[0], 77)

    def test_no_test_is_a_failure(self):
        code, said = self.run_it("echo '[==========] Running 0 tests from 0 test suites.'", "--shard", "0/1")
        self.assertEqual((code, said.splitlines()[-1]), (1, "FAILED entry: it ran no test"))

    def test_no_suite_is_cut_in_two(self):
        script = ('case "$*" in *--gtest_list_tests*) printf "A.\\n  One\\n  Two\\n  Three\\nB.\\n  One  # of 3\\nC.\\n'
                  '  One\\n" ;; *) echo "[==========] Running 1 test from 1 test suite."; echo "$*" ;; esac')
        said = [self.run_it(script, "--shard", f"{part}/3", "--suites")[1].splitlines()[-1] for part in range(3)]
        self.assertEqual(said, ["word --gtest_filter=A.One:A.Two:A.Three", "word --gtest_filter=B.One",
                                "word --gtest_filter=C.One"])

    def test_each_that_failed_has_its_command(self):
        code, lines = self.gtest("[  FAILED  ] A.Two, where GetParam() = 1 (0 ms)\n[  FAILED  ] A.Two", then="exit 1")
        self.assertEqual(code, 1)
        self.assertEqual(lines[-2:], ["FAILED entry: A.Two", f"repeat: {self.program} --gtest_filter=A.Two"])

    def test_a_program_that_says_so_and_exits_with_0_has_failed(self):
        self.assertEqual(self.gtest("[  FAILED  ] A.Two (0 ms)")[0], 1)

    def test_what_ended_the_program_is_named(self):
        code, lines = self.gtest("", then="kill -SEGV $$")
        self.assertEqual(code, 1)
        self.assertEqual(lines[-2], "FAILED entry: ended by signal SIGSEGV in A.Two; the tests behind it did not run")
        self.assertEqual(lines[-1], f"repeat: {self.program} --gtest_filter=A.Two")

    def test_what_hangs_is_stopped_and_named(self):
        code, lines = self.gtest("", then="exec tail -f /dev/null", TESSERA_LIMIT="1")
        self.assertEqual(code, 1)
        self.assertEqual(lines[-2], "FAILED entry: was stopped after 1 s in A.Two; the tests behind it did not run")

    def test_another_program_is_repeated_whole(self):
        code, said = self.run_it("exit 3")
        self.assertEqual(code, 3)
        self.assertEqual(said.splitlines(), ["FAILED entry: exit code 3", f"repeat: {self.program} word"])

    def test_what_failed_and_how_long_it_took_go_into_files(self):
        files = self.files("TESSERA_TIMES", "TESSERA_FAILURES")
        self.run_it("exit 3", **files)
        self.assertEqual(pathlib.Path(files["TESSERA_FAILURES"]).read_text().splitlines()[0],
                         "FAILED entry: exit code 3")
        self.assertRegex(pathlib.Path(files["TESSERA_TIMES"]).read_text(), r"^entry \d+\.\d\d \d+\.\d\d\n$")

    def test_skips_go_into_a_file_with_their_reasons(self):
        files = self.files("TESSERA_SKIPS")
        self.gtest("a.cpp:3: Skipped\nno models\n\n[  SKIPPED ] A.Two (0 ms)", **files)
        self.run_it("echo test_x.X.test_y: Skipped; echo no fish", **files)
        self.run_it("echo began; echo two.md: no sshd; exit 77", **files)
        self.assertEqual(pathlib.Path(files["TESSERA_SKIPS"]).read_text().splitlines(),
                         ["program.A.Two: no models", "entry: no fish", "entry: two.md: no sshd"])

    def test_its_part_and_order_are_the_programs(self):
        said = self.run_it('echo "[==========] Running 1 test from"; echo $GTEST_SHARD_INDEX/$GTEST_TOTAL_SHARDS $*',
                           "--shard", "2/5", "--filter=-B.*", TESSERA_SHUFFLE="7")[1]
        self.assertEqual(said.splitlines()[1], "2/5 word --gtest_filter=-B.* --gtest_shuffle --gtest_random_seed=8")


if __name__ == "__main__":
    unittest.main()
