"""Runs lines, each by itself in a shell, in a folder of its own, with an end to its patience; what a line starts ends
with it."""
import ctypes
import os
import pty
import select
import shutil
import signal
import socket
import subprocess
import tempfile
import time

PATIENCE_S = 120
SLOW_PATIENCE_S = 1800
SKIPPED = 77

# Of every line. `by_hand OPTIONS…`: a server and a host (HOST_OPTIONS), three frames, as somebody starts them by hand.
PRELUDE = r"""
set -euo pipefail
ctl() { tessera-ctl --server "$WALL" "$@"; }
by_hand() {
  local code=0
  tessera-server --wall 1x1 --size 64x36 --scene "$ROOT/tests/data/scenes/yard.tsct" --frames 3 \
    --listen 127.0.0.1:$PORT "$@" & local server=$!
  eval "tessera-client --server 127.0.0.1:$PORT --host all ${HOST_OPTIONS:-}" || code=$?
  wait "$server" || code=$?
  return "$code"
}
"""


def die_with_parent():
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return str(probe.getsockname()[1])


# Programs that scripts install where they may.
BROUGHT_BY_SCRIPTS = ("gm", "ip", "clang++-14")


class Failed(Exception):
    pass


class Process:
    """In a session of its own: all that it starts ends with it."""

    def __init__(self, command, cwd, environment, log, terminal=None):
        self.log = log
        with open(log, "wb") as out:
            self.process = subprocess.Popen(command, cwd=cwd, env=environment,
                                            stdin=terminal if terminal is not None else subprocess.DEVNULL,
                                            stdout=terminal if terminal is not None else out, stderr=subprocess.STDOUT,
                                            start_new_session=True, preexec_fn=die_with_parent)

    def output(self):
        with open(self.log, "rb") as text:
            return text.read().decode(errors="replace")

    def wait_for(self, text, patience=60):
        end = time.monotonic() + patience
        while time.monotonic() < end:
            said = self.output()
            if text in said and "\n" in said.split(text, 1)[1]:
                return said.split(text, 1)[1].split("\n", 1)[0].strip()
            if self.process.poll() is not None:
                break
            time.sleep(0.02)
        raise Failed(f"never said '{text}':\n{self.output()}")

    def end(self):
        # Whatever it started and left behind stands in its session's group.
        try:
            os.killpg(self.process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        self.process.wait()


class Runner:
    def __init__(self, root, environment, built, data, installs=False):
        self.root, self.built, self.data, self.installs = root, built, data, installs
        self.environment = dict(environment, ROOT=root,
                                BUILD=environment.get("TESSERA_BUILD") or os.path.join(root, "build"), BUILT=built,
                                DATA=data, LP_NUM_THREADS="0",
                                PATH=os.path.join(root, "out", "bin") + ":" + environment.get("PATH", "/usr/bin:/bin"))
        for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
            self.environment.pop(name, None)
        self.folder = tempfile.mkdtemp(prefix="tessera-commands-")
        self.environment["XDG_RUNTIME_DIR"] = self.folder  # what servers leave for programs of their user
        self.environment["XDG_STATE_HOME"] = os.path.join(self.folder, "state")
        self.walls = {}
        self.processes = []
        self.display = None

    def close(self):
        for process in reversed(self.processes):
            process.end()
        shutil.rmtree(self.folder, ignore_errors=True)

    def start(self, name, command, **environment):
        process = Process(command, self.root, dict(self.environment, **environment),
                          os.path.join(self.folder, f"{name}.{len(self.processes)}.log"))
        self.processes.append(process)
        return process

    def program(self, name):
        return os.path.join(self.root, "out", "bin", name)

    def wall(self, scene, options, draws):
        """The address of a wall of that scene, which runs until the end."""
        key = (scene, options, draws)
        if key not in self.walls:
            words = options.replace("$PWD", self.root).split()
            # A few frames a second: it is asked, not looked at.
            server = self.start("server",
                                [self.program("tessera-server"), "--wall", "1x1", "--size", "64x36", "--scene", scene,
                                 "--assets", "/usr/share/assimp/models", "--listen", "127.0.0.1:0",
                                 "--rate", "10", *words])
            address = server.wait_for("listening on ")
            host = self.start("host",
                              [self.program("tessera-client"), "--server", address, "--host", "all", "--output",
                               os.path.join(self.folder, f"tiles{len(self.walls)}"),
                               *([] if draws else ["--surface", "none"])])
            server.wait_for("all enters at frame")
            self.walls[key] = (address, server, host)
        return self.walls[key][0]

    def desktop(self):
        if self.display is None:
            server = self.start("xvfb",
                                ["/usr/bin/Xvfb", "-displayfd", "1", "-screen", "0", "640x480x24", "-nolisten", "tcp",
                                 "-noreset"])
            end = time.monotonic() + 30
            while self.display is None:
                numbers = [line for line in server.output().split("\n")[:-1] if line.isdigit()]
                if numbers:
                    self.display = ":" + numbers[-1]
                elif time.monotonic() > end or server.process.poll() is not None:
                    raise Failed("no desktop:\n" + server.output())
                else:
                    time.sleep(0.02)
        return self.display

    def missing(self, needs):
        for need in needs:
            if self.installs and need in BROUGHT_BY_SCRIPTS:
                continue
            if not shutil.which(need) and not os.path.exists(os.path.join(self.data, need)):
                return need
        return None

    def run(self, name, row, script):
        """Fails, or returns nothing, or why it was skipped."""
        lacks = self.missing(row.needs)
        if lacks:
            return f"{lacks} is missing"
        own = tempfile.mkdtemp(dir=self.folder)
        environment = dict(self.environment, T=own, PORT=free_port(), PORT2=free_port())
        if row.scene:
            environment["WALL"] = self.wall(row.scene, row.options, row.draws)
        if row.display:
            environment["DISPLAY"] = self.desktop()
        leaves = [path.replace("$T", own) if path.startswith("$T") else os.path.join(self.root, path)
                  for path in row.leaves]
        for path in leaves:
            if os.path.isfile(path):
                os.remove(path)
        log = os.path.join(own, "said")
        ours = theirs = None
        if row.keys:
            ours, theirs = pty.openpty()
        if self.installs:
            script = script.replace(" --no-install", "")
        # Whatever still runs in the background when a line has ended ends, too.
        process = Process(["/bin/bash", "-c",
                           PRELUDE + "trap 'kill $(jobs -p) 2>/dev/null || true; wait' EXIT\n" + script
                           + "\n"], self.root, environment, log, theirs)
        try:
            code, said = self.follow(process, row, ours, theirs)
        finally:
            process.end()
            for end in (ours, theirs):
                if end is not None:
                    os.close(end)
        if code == SKIPPED:
            return said.strip().split("\n")[-1]
        if code != row.code:
            raise Failed(f"exit code {code}, not {row.code}\n{said}")
        if row.says and row.says not in said:
            raise Failed(f"it does not say '{row.says}':\n{said}")
        for path in leaves:
            if not os.path.exists(path):
                raise Failed(f"it leaves no {path}\n{said}")
        shutil.rmtree(own, ignore_errors=True)
        return None

    def follow(self, process, row, ours, theirs):
        end = time.monotonic() + (SLOW_PATIENCE_S if row.slow else PATIENCE_S)
        if ours is None:
            try:
                return process.process.wait(end - time.monotonic()), process.output()
            except subprocess.TimeoutExpired:
                raise Failed(f"not over after {PATIENCE_S} s\n{process.output()}") from None
        # A person types once the program has said something, a key after the other.
        said, keys = b"", [key.encode() for key in row.keys.replace("\x1b[A", "\0")]
        while process.process.poll() is None:
            if time.monotonic() > end:
                raise Failed(f"not over after {PATIENCE_S} s\n{said.decode(errors='replace')}")
            if select.select([ours], [], [], 0.1)[0]:
                said += os.read(ours, 65536)
            if said and keys:
                os.write(ours, keys.pop(0).replace(b"\0", b"\x1b[A"))
        return process.process.returncode, said.decode(errors="replace")
