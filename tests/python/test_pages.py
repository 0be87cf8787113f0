"""What types the first-hour pages (tests/commands/pages) notices each way in which a page can be wrong."""
import os
import pathlib
import subprocess
import tempfile
import unittest

from eventually import eventually

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Pages(unittest.TestCase):
    def typed(self, text):
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder) / "page.md"
            page.write_text(text)
            done = subprocess.run([ROOT / "tests/commands/pages", page], capture_output=True, text=True, timeout=60)
            return done.returncode, done.stdout + done.stderr

    def test_types_line_by_line_and_finds_what_is_seen(self):
        code, said = self.typed("# Page\n\n```sh\nfor n in 1 2; do echo number $n; done\ncat >a <<'END'\nfalse\nEND\n"
                                "cat a\n```\n\n```text\nnumber …\nfalse\n```\n")
        self.assertEqual(code, 0, said)
        self.assertIn("5 lines typed, 0 of them otherwise, 2 lines seen", said)

    def test_a_line_that_fails_is_named(self):
        code, said = self.typed("# Page\n\n```sh\ntrue\nfalse\necho later\n```\n")
        self.assertEqual(code, 1)
        self.assertIn("page.md:5: exit code 1: false", said)
        self.assertNotIn("later\n", said)

    def test_a_line_that_is_not_seen_is_named(self):
        code, said = self.typed("```sh\necho one two\n```\n\n```text\none … three\n```\n")
        self.assertEqual(code, 1)
        self.assertIn("page.md:6: never seen: one … three", said)

    def test_lines_that_run_otherwise_are_counted_and_must_be_there(self):
        mark = "<!-- test: apt install x => echo none -->\n"
        code, said = self.typed(mark + "```sh\napt install x\n```\n\n```text\nnone\n```\n")
        self.assertEqual(code, 0, said)
        self.assertIn("page.md:3: instead of `apt install x`: `echo none`", said)
        self.assertIn("1 lines run otherwise", said)
        code, said = self.typed(mark + "```sh\napt install y\n```\n")
        self.assertEqual(code, 1)
        self.assertIn("has no 'apt install x'", said)

    def test_what_a_page_leaves_running_ends_with_it(self):
        with tempfile.TemporaryDirectory() as folder:
            code, said = self.typed(f"```sh\nsetsid sh -c 'echo $$ >{folder}/pid; exec sleep 1000' &\n"
                                    f"until [ -s {folder}/pid ]; do sleep 0.02; done\n```\n")
            self.assertEqual(code, 0, said)
            pid = int(pathlib.Path(folder, "pid").read_text())
            self.assertTrue(eventually(lambda: not os.path.exists(f"/proc/{pid}"), 10))


if __name__ == "__main__":
    unittest.main()
