"""Sockets that say nothing, at both ports of a server, in a network namespace of the test's own: 10,000; and more than
the server has descriptors for."""
import http.client
import json
import os
import pathlib
import resource
import select
import shutil
import socket
import subprocess
import sys
import time
import unittest

SOCKETS = 5_000  # at each port
INSIDE = "TESSERA_TEST_INSIDE"


def namespace():
    """The command that runs in a network namespace of its own; None where nobody may make one."""
    if not shutil.which("unshare"):
        return None
    for flags in (["-n"], ["-rn"]):
        if subprocess.run(["unshare", *flags, "true"], capture_output=True, check=False).returncode == 0:
            return ["unshare", *flags]
    return None


class ManySockets(unittest.TestCase):
    def test_hold_up_nobody(self):
        self.apart("test_hold_up_nobody", self.many)

    def test_hold_up_nobody_who_has_few_descriptors(self):
        self.apart("test_hold_up_nobody_who_has_few_descriptors", self.few)

    def apart(self, name, test):
        if os.environ.get(INSIDE):
            return test()
        apart = namespace()
        if apart is None:
            self.skipTest("nobody may make a network namespace here (unshare -n)")
        done = subprocess.run([*apart, sys.executable, __file__, f"ManySockets.{name}"],
                              env={**os.environ, INSIDE: "1", "PYTHONPATH": os.pathsep.join(sys.path)},
                              capture_output=True, text=True, timeout=300, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def few(self):
        from live import BIN, Live  # noqa: PLC0415: the processes of this namespace alone
        bring_up_loopback()
        before = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (200, 200 if before[1] == resource.RLIM_INFINITY else before[1]))
        with Live() as live:
            resource.setrlimit(resource.RLIMIT_NOFILE, (min(1500, before[1]), before[1]))
            resource.prlimit(live.server.pid, resource.RLIMIT_NOFILE, (200, 200))
            door, token = console(live)
            began = time.monotonic()
            for _ in range(5):
                self.assertEqual(figures(door, token), 200)
                subprocess.run([BIN / "tessera-ctl", "--server", live.address, "whoami"], capture_output=True,
                               check=True)
            quiet = (time.monotonic() - began) / 5
            for ports in ([door], [int(live.address.split(":")[1])], [door, int(live.address.split(":")[1])]):
                silent = [knock(port) for port in ports for _ in range(600)]
                for _ in range(5):
                    began = time.monotonic()
                    self.assertEqual(figures(door, token), 200)
                    subprocess.run([BIN / "tessera-ctl", "--server", live.address, "whoami"], capture_output=True,
                                   check=True)
                    # The silent ones may stay for ten seconds
                    self.assertLess(time.monotonic() - began, 5 + 10 * quiet, f"600 at each of {len(ports)} ports")
                for one in silent:
                    one.close()

    def many(self):
        from live import BIN, Live  # noqa: PLC0415
        bring_up_loopback()
        hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
        wanted = 2 * SOCKETS + 200
        if hard != resource.RLIM_INFINITY and hard < wanted:
            self.skipTest(f"this process may have {hard} descriptors, and {wanted} are needed")
        with Live(surface="none") as live:
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
            door, token = console(live)
            before = frame(live)
            silent = []
            for port in (live.address, f"127.0.0.1:{door}"):
                silent += [knock(int(port.split(":")[1])) for _ in range(SOCKETS)]
            began = time.monotonic()
            asked = 0
            while time.monotonic() < began + 5:
                self.assertEqual(figures(door, token), 200)
                subprocess.run([BIN / "tessera-ctl", "--server", live.address, "status"], capture_output=True,
                               check=True)
                asked += 1
            self.assertGreater(asked, 0)
            self.assertGreater(frame(live), before + 100, "the wall goes on")
            # What was too much is told so, and closed: each in its turn, some once their system has knocked again.
            words, open_, waits = 0, {one.fileno(): one for one in silent[SOCKETS:]}, select.poll()
            for number in open_:
                waits.register(number, select.POLLIN)
            end = time.monotonic() + 60
            while len(open_) > 300 and time.monotonic() < end:
                for number, _ in waits.poll(1000):
                    try:
                        said = open_[number].recv(4096)
                    except BlockingIOError:
                        continue
                    except OSError:
                        said = b""
                    words += b"503" in said and json.loads(said.split(b"\r\n\r\n")[1])["error"]["code"] == "limit"
                    waits.unregister(number)
                    del open_[number]
            self.assertLessEqual(len(open_), 300)
            self.assertGreater(words, SOCKETS / 2)
            memory = int(pathlib.Path(f"/proc/{live.server.pid}/statm").read_text().split()[1]) * os.sysconf(
                "SC_PAGESIZE")
            self.assertLess(memory, 1 << 30)
            for one in silent:
                one.close()


def console(live):
    """Its port, and its token."""
    link = live.link()
    return int(link.split(":")[2].split("/")[0]), link.split("token=")[1]


def knock(port):
    one = socket.socket()
    one.setblocking(False)
    one.connect_ex(("127.0.0.1", port))
    return one


def figures(door, token):
    """The status with which the console answers."""
    connection = http.client.HTTPConnection("127.0.0.1", door, timeout=20)
    connection.request("GET", "/metrics", headers={"Authorization": f"Bearer {token}"})
    answer = connection.getresponse()
    answer.read()
    connection.close()
    return answer.status


def frame(live):
    from live import BIN  # noqa: PLC0415
    status = subprocess.run([BIN / "tessera-ctl", "--server", live.address, "--json", "status"], capture_output=True,
                            text=True, check=True).stdout
    return json.loads(status)["frame"]


def bring_up_loopback():
    import fcntl  # noqa: PLC0415
    import struct  # noqa: PLC0415
    get, set_, up = 0x8913, 0x8914, 1
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as way:
        name = struct.pack("16sh14x", b"lo", 0)
        flags = struct.unpack("16xh14x", fcntl.ioctl(way, get, name))[0]
        fcntl.ioctl(way, set_, struct.pack("16sh14x", b"lo", flags | up))


if __name__ == "__main__":
    unittest.main()
