"""The wall that is meant: one that is said, TESSERA_SERVER, or the only one of this user on this machine."""
import os
import tempfile
import unittest

import tessera
from live import Live


class WallsHere(unittest.TestCase):
    def setUp(self):
        self._before = {name: os.environ.pop(name, None) for name in ("XDG_RUNTIME_DIR", "TESSERA_SERVER")}
        self._folder = tempfile.TemporaryDirectory()
        os.environ["XDG_RUNTIME_DIR"] = self._folder.name

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
                second.kill_server()
                with tessera.connect() as wall:
                    self.assertEqual(wall.address, first.address)

    def test_a_console_keeps_its_link(self):
        links = []
        for _ in range(2):
            with Live() as live:
                links.append([line for line in live.log("server").split("\n") if line.startswith("console: ")][0])
        self.assertEqual(links[0], links[1])


if __name__ == "__main__":
    unittest.main()
