"""Started by a service manager: what systemd hears of server and client at its socket, and when it hears no more."""
import os
import pathlib
import re
import select
import signal
import socket
import subprocess
import tempfile
import time
import unittest

import numpy

from live import BIN, PATIENCE, YARD, run_folder

WATCHDOG_S = 0.03  # fed every hundredth of a second
QUIET_S = 2.0      # what nobody feeds any more is quiet for so long


class Manager:
    """A socket as NOTIFY_SOCKET names it, and the words that have come to it, one after the other."""

    def __init__(self, name):
        self.name = f"@tessera-{name}-{os.getpid()}"
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind("\0" + self.name[1:])

    def close(self):
        self._socket.close()

    def environment(self):
        return {**os.environ, "NOTIFY_SOCKET": self.name, "WATCHDOG_USEC": str(int(WATCHDOG_S * 1e6))}

    def next(self, patience=PATIENCE):
        """The words of the next datagram; none where there is none in time."""
        if not select.select([self._socket], [], [], patience)[0]:
            return []
        return self._socket.recv(65536).decode().splitlines()

    def wait_for(self, beginning):
        """The first word that begins so. What comes before it is kept in `before`."""
        self.before = []
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            words = self.next()
            for word in words:
                if word.startswith(beginning):
                    return word
            self.before += words
        raise AssertionError(f"no {beginning} came, but {self.before[-20:]}")

    def drain(self):
        while self.next(0):
            pass


def write_field(path, side):
    """A mesh that takes a moment to read."""
    x, y = numpy.meshgrid(numpy.arange(side, dtype="<f4"), numpy.arange(side, dtype="<f4"))
    corners = numpy.stack([x, y, numpy.sin(x / 30) * 10], -1).reshape(-1, 3).astype("<f4")
    index = numpy.arange(side * side, dtype="<i4").reshape(side, side)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]))
    triangles = numpy.concatenate([numpy.stack([a, b, c], 1), numpy.stack([a, c, d], 1)])
    faces = numpy.zeros(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    head = ("ply\nformat binary_little_endian 1.0\n"
            f"element vertex {side * side}\nproperty float x\nproperty float y\nproperty float z\n"
            f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
    path.write_bytes(head.encode() + corners.tobytes() + faces.tobytes())


class Service(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="tessera-service-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        runs = run_folder()
        runs.__enter__()
        self.addCleanup(runs.__exit__, None, None, None)

    def manager(self, name):
        made = Manager(name)
        self.addCleanup(made.close)
        return made

    def start(self, manager, program, *arguments):
        with open(self.folder / f"{program}.log", "w") as log:
            process = subprocess.Popen([str(BIN / program), *map(str, arguments)], env=manager.environment(),
                                       stdout=log,
                                       stderr=log, stdin=subprocess.DEVNULL)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def start_server(self, manager, scene=YARD):
        process = self.start(manager, "tessera-server", "--wall", "1x1", "--scene", scene, "--no-console")
        manager.wait_for("READY=1")
        log = (self.folder / "tessera-server.log").read_text()
        return process, log.split("listening on ")[1].split()[0]

    def start_client(self, manager, address, *options):
        return self.start(manager, "tessera-client", "--server", address, "--host", "all", "--surface", "none",
                          *options)

    def starves(self, manager):
        manager.drain()
        deadline = time.monotonic() + QUIET_S
        heard = []
        while time.monotonic() < deadline:
            heard += manager.next(deadline - time.monotonic())
        # What was on its way when it hung may still have come.
        return sum(word == "WATCHDOG=1" for word in heard) <= 1

    def test_a_server_says_what_it_does_and_feeds_its_watchdog_while_it_loads(self):
        field = self.folder / "field.ply"
        write_field(field, 500)
        at_server, at_client = self.manager("server"), self.manager("client")
        server, address = self.start_server(at_server, field)
        self.assertNotIn("WATCHDOG=1", at_server.before)  # it is not watched before
        self.assertEqual(at_server.wait_for("STATUS="), f"STATUS=loads {field}")
        at_server.wait_for("STATUS=0 of 1 hosts live")
        self.assertGreater(at_server.before.count("WATCHDOG=1"), 4, "it loads, and its frame thread turns")

        client = self.start_client(at_client, address)
        at_client.wait_for("READY=1")
        self.assertRegex(at_client.wait_for("STATUS=joined"), rf"joined {address}: ")
        self.assertRegex(at_server.wait_for("STATUS=1 of 1 hosts live, frame "), r"frame \d+")
        self.assertRegex(at_client.wait_for("STATUS=joined"), r"frame \d+, \d+ a second")

        for process, manager in ((client, at_client), (server, at_server)):
            process.send_signal(signal.SIGSTOP)
            self.assertTrue(self.starves(manager))
            process.send_signal(signal.SIGCONT)
            manager.wait_for("WATCHDOG=1")

        server.terminate()
        at_server.wait_for("STOPPING=1")
        self.assertEqual(server.wait(PATIENCE), 0)
        self.assertEqual(client.wait(PATIENCE), 0)

    def test_what_it_says_in_the_journal_lets_nobody_in(self):
        """Its standard output, as the journal would have it; its readers are others than the wall's people."""
        for is_journal in (True, False):
            ours, theirs = socket.socketpair()
            info = os.fstat(theirs.fileno())
            stream = f"{info.st_dev}:{info.st_ino + (not is_journal)}"
            server = subprocess.Popen([str(BIN / "tessera-server"), "--wall", "1x1"], stdout=theirs,
                                      stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL,
                                      env={**os.environ, "JOURNAL_STREAM": stream})
            self.addCleanup(server.wait)
            self.addCleanup(server.kill)
            theirs.close()
            ours.settimeout(PATIENCE)
            said = ""
            while not re.search(r"^console: .*\n", said, re.M):
                said += ours.recv(4096).decode()
            ours.close()
            self.assertEqual("token=" in said, not is_journal, said)

    def test_a_client_whose_draw_thread_hangs_starves_its_watchdog(self):
        at_server, at_client = self.manager("server"), self.manager("client")
        _, address = self.start_server(at_server)
        client = self.start_client(at_client, address, "--inject", "draw-hang@20")
        at_client.wait_for("READY=1")
        deadline = time.monotonic() + PATIENCE
        while not self.starves(at_client) and time.monotonic() < deadline:
            pass
        self.assertTrue(self.starves(at_client))
        self.assertIsNone(client.poll())  # it lives: its other thread answers the server

    def test_a_client_is_ready_while_there_is_no_server(self):
        at_client = self.manager("client")
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            address = f"127.0.0.1:{free.getsockname()[1]}"
        self.start_client(at_client, address)
        at_client.wait_for("READY=1")
        self.assertRegex(at_client.wait_for(f"STATUS=dials {address}: "), "Connection refused")
        at_client.wait_for("WATCHDOG=1")


if __name__ == "__main__":
    unittest.main()
