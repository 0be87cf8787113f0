"""The wall that is meant: one that is said, TESSERA_SERVER, that in the user's file, or the only one of this user on
this machine."""
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

import tessera
from live import BUILD, ROOT, Live


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
            waits = first.run("tessera-ctl", "--timeout", "1", "undo")
            self.assertIn(f"tessera-client --server {first.address} --host", waits.stderr, "a command to be typed")
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

    def test_the_systems_server_is_found_by_its_group(self):
        """/run/tessera, as tessera-server.service has it: in a mount space of the test's own."""
        if os.geteuid() != 0:
            self.skipTest("other users and a /run of its own want root")
        others = pathlib.Path(self._folder.name)
        others.chmod(0o777)
        # The tree lies where other users cannot go, as in /root: they reach it in /run.
        steps = """
            set -e
            mount --make-rprivate / && mount -t tmpfs -o mode=755 tmpfs /run
            install -d -o nobody -g games -m 750 /run/tessera
            install -d -m 755 /run/tree && mount --rbind "$4" /run/tree
            [ "$4/build" -ef "$5" ] || mount --rbind "$5" /run/tree/build
            cd "$1"
            XDG_RUNTIME_DIR=/run setpriv --reuid=nobody --regid=games --clear-groups \\
                "$2/tessera-server" --group games --no-console \\
                --scene "$3" >server.log 2>&1 &
            for _ in $(seq 600); do ! grep -q "token file" server.log || break; sleep 0.1; done
            mount -t tmpfs -o mode=1777 tmpfs /tmp
            ask() { setpriv --reuid=12345 --regid=12345 "$@" 2>&1 || true; }
            ask --groups=games "$2/tessera-ctl" whoami
            ask --groups=games /usr/bin/python3 -c 'import tessera; print(tessera.connect().whoami().role)'
            ask --clear-groups "$2/tessera-ctl" whoami
            kill $!
        """
        environment = {**os.environ, "PYTHONPATH": "/run/tree/build/python"}
        environment.pop("XDG_RUNTIME_DIR")
        said = subprocess.run(["unshare", "--mount", "--pid", "--fork", "--kill-child", "bash", "-c", steps, "_",
                               str(others), "/run/tree/build/bin", "/run/tree/tests/data/scenes/yard.tsct",
                               str(ROOT), str(BUILD)],
                              env=environment, capture_output=True, text=True, timeout=120)
        if "cannot change root filesystem propagation" in said.stderr:
            self.skipTest("the root is no mount, as in a chroot: none of its processes gets a mount space of its own")
        self.assertEqual(said.returncode, 0, said.stderr)
        member, python, stranger = said.stdout.splitlines()[:3]
        self.assertIn("operator", member)
        self.assertIn("operator", python.lower())
        self.assertIn("no server of this user", stranger)


if __name__ == "__main__":
    unittest.main()
