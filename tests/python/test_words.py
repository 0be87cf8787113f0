"""The guides are written in short sentences: `deploy/words` counts, and this holds the number."""
import pathlib
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
LONG = " ".join(["word"] * 26)


def words(*arguments):
    return subprocess.run(["/usr/bin/python3", ROOT / "deploy/words", *arguments], capture_output=True, text=True,
                          timeout=60)


class Words(unittest.TestCase):
    def of(self, text, *options):
        with tempfile.NamedTemporaryFile("w", suffix=".md") as file:
            file.write(text)
            file.flush()
            return words(file.name, *options)

    def test_counts_sentences_and_leaves_code_and_tables_out(self):
        text = (f"# {LONG}\n\n{LONG}. Short.\n- {LONG[:-5]}!\n\n| {LONG} |\n\n    {LONG}\n\n```\n{LONG}\n```\n\nWhat "
                f"it is: `{LONG}`.\n")
        self.assertIn("4 sentences: 1 of more than 25 words (25.0 %), 1 that begin with a clause", self.of(text).stdout)

    def test_a_limit_that_is_passed_is_exit_code_one(self):
        self.assertEqual(self.of(LONG + ".", "--limit", "99").returncode, 1)
        self.assertEqual(self.of("Short.", "--limit", "0").returncode, 0)

    def test_all_guides_hold_the_limit(self):
        done = words("--limit", "5")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
