"""A wall of real processes on loopback for a test: a server, and clients that draw in memory or nothing. Ended by their
ids, always."""
import contextlib
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
from unittest import mock

import tessera
from eventually import PATIENCE, eventually

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("TESSERA_BUILD", ROOT / "build"))
BIN = BUILD / "bin"
YARD = ROOT / "tests/data/scenes/yard.tsct"


@contextlib.contextmanager
def run_folder():
    """Within it servers tell of themselves where nobody else looks; programs within are another user's to servers
    without. Its `state` outlives what a restart of the machine empties."""
    with (tempfile.TemporaryDirectory(prefix="tessera-run-") as folder,
          mock.patch.dict(os.environ, {"XDG_RUNTIME_DIR": folder, "XDG_CONFIG_HOME": folder,
                                       "XDG_STATE_HOME": f"{folder}/state"})):
        for name in ("TESSERA_SERVER", "TESSERA_TOKEN", "TESSERA_TOKEN_FILE"):
            os.environ.pop(name, None)
        yield pathlib.Path(folder)


class Live:
    """`with Live(…) as wall_of_processes:`; `address` is where its server listens."""

    def __init__(self, wall="1x1", scene=YARD, surface=None, size=None, options=(), port=0, journal=False):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="tessera-python-"))
        self._wall, self._scene, self._surface, self._options, self._port = wall, scene, surface, list(options), port
        self._size = ["--size", size] if size else []
        if journal:
            self._options += ["--journal", str(self.folder / "journal")]
        self._processes = []
        self.hosts = {}  # the newest process of each
        self.server = None
        self.keys = None

    def __enter__(self):
        try:
            self.start_server()
            if self._surface:
                with self.connect() as wall:
                    hosts = [host.name for host in wall.status().hosts]
                for host in hosts:
                    self.start_host(host)
                self._wait_until_live(len(hosts))
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(self, kind, value, trace):
        for process in reversed(self._processes):
            if process.poll() is None:
                process.terminate()
        hung = []
        for process in self._processes:
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                hung.append(process.args[0])
                process.kill()
                process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)
        if hung and kind is None:
            raise RuntimeError(f"asked to end, these went on: {', '.join(map(str, hung))}")

    def connect(self, **options):
        return tessera.connect(self.address, **{"timeout": PATIENCE, **options})

    def link(self, role="operator"):
        """Of its console, as this user's programs find it."""
        found = self.run("tessera-ctl", "--server", self.address, "link", "--role", role)
        if found.returncode:
            raise RuntimeError(found.stderr)
        return found.stdout.strip()

    def make_keys(self, *people):
        """For the next server of this wall; `people`: "name:role". `key_of`: the folder with one's key."""
        self.keys = self.folder / "keys"
        self.keys_say("init", "--wall", self._wall)
        for person in people:
            name, _, role = person.partition(":")
            self.keys_say("person", name, "--role", role, "--out", str(self.folder / name))
        self._options += ["--keys", str(self.keys)]

    def keys_say(self, *arguments):
        done = self.run("tessera-keys", "--keys", str(self.keys), *arguments)
        if done.returncode:
            raise RuntimeError(done.stderr)
        return done.stdout

    def key_of(self, name):
        return str(self.folder / name)

    def sealed_link(self):
        """As the server prints it."""
        return re.search(r"console: (https://\S+)", self.log("server")).group(1)

    def token(self, role="operator"):
        return re.search(r"[?&]token=([^&]+)", self.link(role)).group(1)

    def token_file(self, role="operator"):
        path = self.folder / f"{role}.token"
        path.write_text(self.token(role) + "\n")
        return str(path)

    def start_server(self):
        command = ["tessera-server", "--wall", self._wall, "--scene", str(self._scene), "--listen",
                   f"127.0.0.1:{self._port}", *self._size, *self._options]
        self.server = self._start(command, "server")
        eventually(lambda: self._listening() or self.server.poll() is not None)
        found = self._listening()
        if not found:
            raise RuntimeError(f"the server did not start: {self.log('server')}")
        self.address, self._port = found.group(1), int(found.group(2))

    def start_host(self, host):
        self.hosts[host] = self._start(["tessera-client", "--server", self.address, "--host", host, "--surface",
                                        self._surface, "--threads", "0"], host)
        return self.hosts[host]

    def kill_server(self):
        self.server.kill()
        self.server.wait()

    def log(self, name):
        path = self.folder / f"{name}.log"
        return path.read_text() if path.exists() else ""

    def run(self, program, *arguments):
        return subprocess.run([str(BIN / program), *arguments], capture_output=True, text=True, timeout=PATIENCE)

    def _start(self, command, name):
        with open(self.folder / f"{name}.log", "w") as log:
            process = subprocess.Popen([str(BIN / command[0]), *command[1:]], stdout=log, stderr=log,
                                       stdin=subprocess.DEVNULL)
        self._processes.append(process)
        return process

    def _listening(self):
        """Finds its address and port in its log, once its scene is there, too: it comes after the port."""
        found = re.search(r"listening on (127\.0\.0\.1:(\d+))", self.log("server"))
        return found if found and re.search(r"scene: \d+ nodes|goes on|journal", self.log("server")) else None

    def _wait_until_live(self, hosts):
        with self.connect() as wall:
            for frame in wall.follow("frames", timeout=PATIENCE):
                if len(frame.shown) == hosts:
                    return


def processor_seconds(process):
    """All its threads have taken so much until now; what they waited does not count."""
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def figure(process, name):
    """Of what Linux says of a process."""
    for line in pathlib.Path(f"/proc/{process.pid}/status").read_text().splitlines():
        if line.startswith(name + ":"):
            return int(line.split()[1])
    raise KeyError(name)
