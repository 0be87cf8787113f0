"""Walls of other programs, converted, and a wall that the assistant asks for: pictures of real walls of processes."""
import hashlib
import os
import pathlib
import pty
import select
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("TESSERA_BUILD", ROOT / "build")) / "bin"
SAMPLES = ROOT / "tests" / "data" / "walls"
QUESTIONS = ("beside each other", "above each other", "Pixels of a monitor", "Size of a monitor's picture",
             "Millimetres between", "Metres from the wall", "A computer for each")


def run(*words, **options):
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=120, **options)


class AtTerminal:
    """tessera-ctl at a terminal: what it asks is waited for, then answered."""

    def __init__(self, folder, *words):
        self.child, self.terminal = pty.fork()
        if self.child == 0:
            os.chdir(folder)
            os.execv(BIN / "tessera-ctl", ["tessera-ctl", *words])
        self.said = ""

    def until(self, words):
        """All that has been said since the last time, up to these words."""
        while words not in self.said:
            ready, _, _ = select.select([self.terminal], [], [], 60)
            if not ready:
                raise AssertionError(f"{words!r} never came: {self.said!r}")
            try:
                some = os.read(self.terminal, 65536)
            except OSError:  # it is over
                some = b""
            if not some:
                raise AssertionError(f"{words!r} never came: {self.said!r}")
            self.said += some.decode()
        before, self.said = self.said.split(words, 1)
        return before

    def answer(self, line):
        os.write(self.terminal, (line + "\n").encode())

    def rest(self):
        while True:
            try:
                some = os.read(self.terminal, 65536)
            except OSError:
                some = b""
            if not some:
                os.close(self.terminal)
                return self.said, os.waitstatus_to_exitcode(os.waitpid(self.child, 0)[1])
            self.said += some.decode()


class OtherWalls(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def picture(self, wall, *options):
        done = run(BIN / "tessera-wall", "--wall", wall, "--frames", "2", "--output", "out", *options, cwd=self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        return hashlib.sha256((self.folder / "out" / "wall.png").read_bytes()).hexdigest()

    def test_converted_walls_draw_the_pictures_of_the_shipped_ones(self):
        scene = ("--scene", ROOT / "tests" / "data" / "scenes" / "yard.tsct")
        for shipped, sample, size in (("2x2", "two-by-two", "160x90"), ("cave4", "room", "320x80")):
            theirs = self.picture(ROOT / "deploy" / "walls" / f"{shipped}.wall", *scene, "--size", size)
            for ending in ("json", "ndisplay", "xml"):
                with self.subTest(sample=sample, ending=ending):
                    wall = f"{sample}-{ending}.wall"
                    done = run(BIN / "tessera-convert", SAMPLES / f"{sample}.{ending}", wall, cwd=self.folder)
                    self.assertEqual(done.returncode, 0, done.stderr)
                    self.assertEqual(self.picture(f"./{wall}", *scene, "--size", size), theirs)

    def test_the_assistant_asks_and_asks_again(self):
        terminal = AtTerminal(self.folder, "new-wall", "my.wall")
        asked = {"beside each other": ["two", "", "2"], "Size of a monitor's picture": ["55x", "46"],
                 "Metres from the wall": ["2.5"]}
        reasons = {"two": '"two" is no whole number', "": "an answer is needed", "55x": "width x height in metres"}
        for question in QUESTIONS:
            terminal.until(question)
            for line in asked.get(question, ["2"] if question == "above each other" else [""]):
                terminal.until(": ")
                terminal.answer(line)
                if line in reasons and question in asked:
                    terminal.until(reasons[line])
                    terminal.until(question)
        said, code = terminal.rest()
        self.assertEqual(code, 0, said)
        self.assertIn("tessera-wall --wall my.wall --test-picture --window", said)
        self.assertEqual(run(BIN / "tessera-check", "my.wall", cwd=self.folder).returncode, 0)
        # The same from options; then the test picture of what was asked for.
        done = run(BIN / "tessera-ctl", "new-wall", "same.wall", "--columns", "2", "--rows", "2", "--size", "46",
                   "--distance", "2.5", cwd=self.folder, stdin=subprocess.DEVNULL)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((self.folder / "same.wall").read_text(), (self.folder / "my.wall").read_text())
        self.picture("my.wall", "--test-picture", "--size", "160x90")

    def test_what_is_missing_is_named_and_no_file_is_lost(self):
        def refused(*words):
            done = run(BIN / "tessera-ctl", "new-wall", *words, cwd=self.folder, stdin=subprocess.DEVNULL)
            return done.returncode, done.stderr
        code, said = refused("my.wall", "--rows", "2")
        self.assertEqual(code, 2)
        self.assertIn("say --columns N, --size SIZE, --distance M", said)
        self.assertNotIn("--rows N", said)
        whole = ("--columns", "1", "--rows", "1", "--size", "1x0.6", "--distance", "2")
        self.assertIn("ends with .wall", refused("my.txt", *whole)[1])
        self.assertIn("no folder", refused("none/my.wall", *whole)[1])
        (self.folder / "my.wall").write_text("mine")
        self.assertIn("say --force", refused("my.wall", *whole)[1])
        (self.folder / "link.wall").symlink_to("elsewhere")
        self.assertIn("say --force", refused("link.wall", *whole)[1])
        self.assertEqual((self.folder / "my.wall").read_text(), "mine")
        code, said = refused("my.wall", "--force", *whole)
        self.assertEqual((code, "pixels are" in said), (0, True), "1 x 0.6 m is not 16:9: a warning")
        self.assertNotEqual((self.folder / "my.wall").read_text(), "mine")
        terminal = AtTerminal(self.folder, "new-wall", "ended.wall")
        terminal.until(": ")
        os.write(terminal.terminal, b"\x04")
        said, code = terminal.rest()
        self.assertEqual(code, 2)
        self.assertIn("nothing is written", said)
        self.assertFalse((self.folder / "ended.wall").exists())


if __name__ == "__main__":
    unittest.main()
