"""tessera-check --machine: what it finds on a machine that lacks something, and the cure that it names."""
import json
import os
import resource
import shutil
import socket
import subprocess
import tempfile
import unittest

from live import BIN, PATIENCE

THINGS = ["drawing", "graphics card", "desktop", "fonts", "reading files", "port", "open files", "priority", "memory",
          "shared memory", "run folder", "clock", "ssh"]


def check(*options, files=None, **variables):
    """(exit code, what is said of each thing)."""
    def bound():
        if files is not None:
            resource.setrlimit(resource.RLIMIT_NOFILE, (files, files))
    told = subprocess.run([str(BIN / "tessera-check"), "--machine", "--json", *options], capture_output=True, text=True,
                          timeout=2 * PATIENCE,
                          env={**os.environ, **variables}, preexec_fn=bound)
    return told.returncode, {line["thing"]: line for line in map(json.loads, told.stdout.splitlines())}


class Machine(unittest.TestCase):
    def test_all_is_looked_at_and_each_lack_has_its_cure(self):
        code, found = check()
        self.assertEqual(list(found), THINGS)
        self.assertEqual(code, 1 if any(each["state"] == "lacks" for each in found.values()) else 0, found)
        for each in found.values():
            self.assertEqual(each["state"] == "good", each["cure"] == "", each)
            self.assertTrue(each["what"], each)
        # What the other tests draw and read with.
        states = [found[thing]["state"] for thing in ("drawing", "fonts", "reading files")]
        self.assertEqual(states, ["good"] * 3, found)

    def test_what_is_missing_is_named(self):
        with tempfile.TemporaryDirectory() as empty, socket.socket() as taken:
            taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                taken.bind(("127.0.0.1", 7000))
                taken.listen()
            except OSError:
                pass  # somebody else has it: as good
            code, found = check(files=100, PATH=empty, DISPLAY="", WAYLAND_DISPLAY="",
                                FONTCONFIG_FILE=os.path.join(empty, "none"), FONTCONFIG_SYSROOT=empty)
        self.assertEqual(code, 1)
        states = {thing: each["state"] for thing, each in found.items()}
        self.assertEqual([states[thing] for thing in ("fonts", "open files", "port", "desktop", "ssh")],
                         ["lacks", "lacks", "note", "note", "note"], found)
        self.assertIn("fonts-dejavu-core", found["fonts"]["cure"])
        self.assertIn("openssh-client", found["ssh"]["cure"])
        self.assertIn("is held by", found["port"]["what"])

    def test_what_a_server_needs_to_start_is_there(self):
        code, found = check(XDG_RUNTIME_DIR="/nonexistent")
        self.assertEqual((code, found["run folder"]["state"]), (1, "lacks"), found["run folder"])
        # A machine whose loopback is down, as new network namespaces are, where one may be made.
        if subprocess.run(["unshare", "-n", "true"], capture_output=True, check=False).returncode == 0:
            told = subprocess.run(["unshare", "-n", str(BIN / "tessera-check"), "--machine"], capture_output=True,
                                  text=True, timeout=2 * PATIENCE)
            self.assertEqual(told.returncode, 1)
            self.assertRegex(told.stdout, r"port +LACKS 127.0.0.1 cannot be reached: Network is unreachable")

    def test_without_the_client_nothing_can_draw(self):
        with tempfile.TemporaryDirectory() as alone:
            shutil.copy(BIN / "tessera-check", alone)
            told = subprocess.run([f"{alone}/tessera-check", "--machine"], capture_output=True, text=True,
                                  timeout=2 * PATIENCE)
        self.assertEqual(told.returncode, 1)
        self.assertRegex(told.stdout, r"drawing +LACKS .*tessera-client' cannot be started")
        self.assertRegex(told.stdout, r"reading files +LACKS .*tessera-import is missing")

    def test_it_takes_no_file(self):
        told = subprocess.run([str(BIN / "tessera-check"), "--machine", "hall.wall"], capture_output=True, text=True,
                              timeout=PATIENCE)
        self.assertEqual(told.returncode, 2)
        self.assertIn("takes no FILE", told.stderr)


if __name__ == "__main__":
    unittest.main()
