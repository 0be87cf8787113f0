"""The wall that is meant: one that is said, TESSERA_SERVER, that in the user's file, or the only one of this user on
this machine."""
import os
import pathlib
import re
import tempfile
import unittest

import tessera
from live import Live


class WallsHere(unittest.TestCase):
    def setUp(self):
        self._before = {name: os.environ.pop(name, None)
                        for name in ("XDG_RUNTIME_DIR", "XDG_CONFIG_HOME", "TESSERA_SERVER")}
        self._folder = tempfile.TemporaryDirectory()
        os.environ["XDG_RUNTIME_DIR"] = os.environ["XDG_CONFIG_HOME"] = self._folder.name

    def tearDown(self):
        self._folder.cleanup()
        for name, value in self._before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value

    def test_the_only_one_is_found_until_it_is_killed(self):
        with self.assertRaisesRegex(tessera.NotFound, "no wall of this user"):
            tessera.connect()
        with Live() as first:
            with tessera.connect() as wall:
                self.assertEqual(wall.address, first.address)
            found = first.run("tessera-ctl", "status")
            self.assertEqual(found.returncode, 0, found.stderr)
            with Live() as second:
                with self.assertRaisesRegex(tessera.NotFound, "2 walls on this machine"):
                    tessera.connect()
                os.environ["TESSERA_SERVER"] = second.address
                with tessera.connect() as wall:
                    self.assertEqual(wall.address, second.address)
                del os.environ["TESSERA_SERVER"]
                self.named_in_a_file(second)
                second.kill_server()
                with tessera.connect() as wall:
                    self.assertEqual(wall.address, first.address)

    def named_in_a_file(self, meant):
        """Programs in Python and in C++ read the same file, and refuse the same ones."""
        file = pathlib.Path(self._folder.name) / "tessera" / "server"
        file.write_text(f"# the wall downstairs\n{meant.address}\n")
        with tessera.connect() as wall:
            self.assertEqual(wall.address, meant.address)
        self.assertEqual(meant.run("tessera-ctl", "status").returncode, 0)
        file.write_text("127.0.0.1:9\n")
        refused = meant.run("tessera-ctl", "status")
        self.assertEqual((refused.returncode, refused.stderr),
                         (4, f"tessera-ctl: cannot connect to 127.0.0.1:9 (named by {file}): Connection refused\n"))
        for text, why in (("", "it names no server"), ("a:1\nb:2\n", "it names more than one server"),
                          ("wall\n", '"wall" is not an address')):
            file.write_text(text)
            with self.assertRaisesRegex(tessera.BadInput, re.escape(f"{file}: {why}")):
                tessera.connect()
            refused = meant.run("tessera-ctl", "status")
            self.assertEqual(refused.returncode, 2)
            self.assertIn(f"{file}: {why}", refused.stderr)
        file.unlink()

    def test_a_console_keeps_its_link(self):
        links = []
        for _ in range(2):
            with Live() as live:
                links.append([line for line in live.log("server").split("\n") if line.startswith("console: ")][0])
        self.assertEqual(links[0], links[1])


if __name__ == "__main__":
    unittest.main()
