#!/usr/bin/python3
"""Writes tests/data/wire/session.txt anew: a short session with a real server, all bytes of both ways.
`tests/python/record.py`, where the protocol has changed, after `./deploy/build build programs tessera_python`."""
import os
import pathlib
import shutil
import socket
import sys
import tempfile
import threading

HERE = pathlib.Path(__file__).resolve().parent
BUILD = pathlib.Path(os.environ.get("TESSERA_BUILD", HERE.parents[1] / "build"))
sys.path[:0] = [str(BUILD / "python"), str(HERE)]

import numpy as np  # noqa: E402

import tessera  # noqa: E402
from eventually import eventually  # noqa: E402
from live import ROOT, Live, run_folder  # noqa: E402
from tessera import _wire  # noqa: E402
from tessera._schema import schema  # noqa: E402

FILE = ROOT / "tests/data/wire/session.txt"
SCENE = 'node { name: "thing" transform { translation { x: 1 y: 2 z: 3 } } }\n'
TOKEN = "the-token-of-a-recorded-session"
HEAD = """# A session of an application with a server, as it was on the wire: each line one message, header and payload.
# `1>` is what the application says on its control connection, `1<` what the server says there; `2` the \
connection for arrays.
# Most heartbeats are left out. proto/WIRE.md explains each step. Written by tests/python/record.py.
"""


def whole(connection, size):
    data = b""
    while len(data) < size:
        more = connection.recv(size - len(data))
        if not more:
            raise ConnectionError
        data += more
    return data


class Recorder:
    """Between an application and a server: passes messages on, one by one, and keeps them."""

    def __init__(self, server):
        self.lines, self._server, self._beats, self._lock = [], server, set(), threading.Lock()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def note(self, text):
        with self._lock:
            self.lines.append(f"# {text}")

    def wait_for_beats(self):
        """Returns once both sides have said a heartbeat on the control connection."""
        if not eventually(lambda: {"1>", "1<"} <= self._beats):
            raise RuntimeError(f"heartbeats came by {self._beats} alone")

    def _accept(self):
        for number in (1, 2):
            ours, _ = self._listener.accept()
            theirs = socket.create_connection(self._server.rsplit(":", 1))
            for way, source, target in ((">", ours, theirs), ("<", theirs, ours)):
                threading.Thread(target=self._pass, args=(f"{number}{way}", source, target), daemon=True).start()

    def _pass(self, way, source, target):
        try:
            while True:
                head = whole(source, _wire.HEADER_BYTES)
                header = _wire.Header(head)
                payload = whole(source, header.size)
                name = schema().message_names[header.kind]
                with self._lock:
                    if name != "Heartbeat" or way not in self._beats:
                        self.lines.append(f"{way} {name} {(head + payload).hex()}")
                    if name == "Heartbeat":
                        self._beats.add(way)
                target.sendall(head + payload)
        except OSError:
            for end in (source, target):
                end.close()


def steps(wall, note):
    """What the session does; test_session.py does the same before a server that plays the file."""
    note("How is the wall? (GetStatus)")
    status = wall.status()
    note("What stands at /thing? (GetObjects)")
    thing = wall["/thing"]
    note("Its translation: its core's fields, as a list of changes (GetObjects, content)")
    place = thing.translation
    note("Its translation becomes (4, 5, 6) (ProposeChanges: one column of doubles)")
    thing.translation = (4, 5, 6)
    note("A triangle: a node, a core and an array of 36 bytes, which travels with the list (ProposeChanges)")
    made = wall.create("/triangle", "Geometry", positions=np.eye(3, dtype=np.float32))
    note("What is refused (RemoveNode of the root)")
    try:
        wall.ask("RemoveNode", node=1)
        refused = ""
    except tessera.TesseraError as error:
        refused = str(error)
    note("The array is asked for, on a connection of its own (GetObjects; Hello, BlobRequest, BlobChunk)")
    positions = made.positions
    note("Frames are told from now on (SubscribeNews; Notice)")
    frames = wall.frames(timeout=60)
    frame = next(frames)
    note("and no longer")
    frames.close()
    note("The last step is taken back (UndoStep)")
    wall.undo()
    return status, place, refused, positions, frame


def main():
    folder = pathlib.Path(tempfile.mkdtemp(prefix="tessera-record-"))
    scene, word = folder / "thing.tsct", folder / "token"
    scene.write_text(SCENE)
    word.write_text(f"{TOKEN}\n")
    try:
        with (run_folder(),
              Live(scene=scene, surface="none", size="64x36", options=["--token-file", str(word)]) as live):
            recorder = Recorder(live.address)
            with tessera.connect(recorder.address, token_file=str(word), name="recorded", timeout=60) as wall:
                recorder.wait_for_beats()
                steps(wall, recorder.note)
            # Notices that nobody waited for would be other ones each time.
            lines, told = [], 0
            for line in recorder.lines:
                told += " Notice " in line
                if " Notice " not in line or told == 1:
                    lines.append(line)
    finally:
        shutil.rmtree(folder)
    FILE.write_text(HEAD + f"protocol {schema().protocol}\n" + "\n".join(lines) + "\n")
    print(f"{FILE}: {len(lines)} lines, {FILE.stat().st_size} bytes")


if __name__ == "__main__":
    main()
