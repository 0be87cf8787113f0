"""A page's link is all that a program has: its channels are WebSockets, and all is as over TCP."""
import asyncio
import base64
import hashlib
import importlib.util
import os
import re
import socket
import struct
import subprocess
import sys
import threading
import time
import unittest
from unittest import mock

import numpy as np

import tessera
from eventually import eventually
from live import BUILD, PATIENCE, ROOT, Live, run_folder
from test_link import Stranger
from tessera import _described, _wire
from tessera._schema import schema

WORD = "the-token-of-a-page-s-link"
HAS_WEBSOCKET = importlib.util.find_spec("websocket") is not None


class Links(unittest.TestCase):
    def test_a_link_that_is_none_says_what_is_wrong(self):
        for link, what in ((f"http://127.0.0.1:7001/?token={WORD}&authority={'a' * 64}", "begins with https"),
                           (f"https://127.0.0.1:7001/?token={WORD}&authority=", "authority is none"),
                           (f"https://127.0.0.1:7001/?token={WORD}&authority={'a' * 63}", "authority is none"),
                           (f"ws://127.0.0.1:7001/?token={WORD}", "not ws"),
                           ("http://127.0.0.1:7001/", "has no token"),
                           ("http://127.0.0.1:7001/?token=", "has no token"),
                           ("http://127.0.0.1:7001/?token=abc", "is it whole"),
                           (f"http://127.0.0.1/?token={WORD}", "no host and port"),
                           (f"http://127.0.0.1:99999/?token={WORD}", "no link: "),
                           (f"http://:7001/?token={WORD}", "no host and port"),
                           (f"http://127.0.0.1:7001/api?token={WORD}", "leads to /api"),
                           (f"http://me@127.0.0.1:7001/?token={WORD}", "no host and port")):
            with self.subTest(link=link), self.assertRaisesRegex(tessera.BadInput, f"{what}.*tessera-ctl link"):
                tessera.connect(link)
        with self.assertRaisesRegex(tessera.BadInput, "a link has its token in it"):
            tessera.connect(f"http://127.0.0.1:7001/?token={WORD}", token_file="/tmp/word")

    def test_without_the_module_a_link_says_what_to_install(self):
        with mock.patch.dict(sys.modules, {"websocket": None}):
            with self.assertRaisesRegex(tessera.Unsupported, "apt-get install python3-websocket"):
                tessera.connect(f"http://127.0.0.1:7001/?token={WORD}")
            with self.assertRaises(tessera.NetworkError):  # an address needs none
                tessera.connect("127.0.0.1:1", timeout=1)


@unittest.skipUnless(HAS_WEBSOCKET, "python3-websocket is not installed (./deploy/set-up installs it)")
class Tunnel(unittest.TestCase):
    def setUp(self):
        self.enterContext(run_folder())

    def connect(self, link, **options):
        """As somebody who has the link and nothing else."""
        with run_folder():
            return tessera.connect(link, **{"timeout": PATIENCE, **options})

    def test_the_lines_of_the_readme_move_an_object_by_a_link_alone(self):
        text = (ROOT / "client/python/README.md").read_text()
        program = re.search(r"```python\n(import tessera\n.*?)```", text, re.S).group(1)
        self.assertLessEqual(len(program.strip().splitlines()), 6)
        with Live(surface="none") as live, live.connect() as watcher:
            link = live.link()
            with run_folder():
                done = subprocess.run([sys.executable, "-c", program.replace("127.0.0.1:7000", link)],
                                      capture_output=True, text=True, timeout=PATIENCE,
                                      env={**os.environ, "PYTHONPATH": str(BUILD / "python")})
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertNotEqual(watcher["/hello"].translation, (0.0, 1.0, -1.0))

    def test_large_arrays_go_both_ways(self):
        points = np.random.default_rng(3).random((1_400_000, 3), np.float32)
        self.assertGreater(points.nbytes, 16e6)
        with Live(surface="none") as live, self.connect(live.link()) as wall, live.connect() as watcher:
            node = wall.create("/large", "Geometry", primitive="points", positions=points)
            self.assertTrue(np.array_equal(watcher["/large"].positions, points))
            self.assertTrue(np.array_equal(node.positions, points))
            wall._fetcher._channel.abort()  # a console closes one that nobody reads
            self.assertTrue(np.array_equal(node.positions, points))

    def test_what_happens_is_told(self):
        with Live(surface="none") as live, self.connect(live.link()) as wall:
            with wall.frames(timeout=PATIENCE) as frames, wall.follow("changes", timeout=PATIENCE) as changes:
                wall["/row"].translation = (1, 2, 3)
                self.assertGreater(next(frames).frame, 0)
                while not any(column.field.name == "translation" and (column.values == (1, 2, 3)).all(axis=1).any()
                              for column in next(changes).columns):
                    continue

    def test_who_comes_in_by_a_link_is_who_it_stands_for(self):
        async def awaited(link):
            async with await tessera.aio.connect(link, timeout=PATIENCE, name="awaited") as wall:
                return (await wall.whoami()).as_dict()
        with Live(surface="none") as live:
            with self.connect(live.link(), name="linked") as wall:
                self.assertEqual(wall.whoami().as_dict(), {"name": "linked", "role": "operator"})
            with self.connect(live.link("viewer")) as wall:
                self.assertEqual(wall.whoami().role, "viewer")
                self.assertEqual(len(wall["/row"].translation), 3)
                with self.assertRaisesRegex(tessera.Refused, "is for an editor; this link is of a viewer"):
                    wall["/row"].translation = (1, 2, 3)
                self.assertNotIn(live.token("viewer"), f"{wall!r} {wall.address} {wall._link._thread.name}")
            self.assertEqual(asyncio.run(awaited(live.link("editor"))), {"name": "awaited", "role": "editor"})

    def test_what_was_granted_is_there_after_kill_9_and_the_link_is_the_same(self):
        with Live(surface="none", journal=True) as live:
            link = live.link()
            with self.connect(link, redial=PATIENCE) as wall, wall.frames(timeout=PATIENCE) as frames:
                node = wall.create("/kept", translation=(1, 2, 3))
                live.kill_server()
                self.assertTrue(eventually(lambda: not wall.connected))
                live.start_server()
                self.assertEqual(live.link(), link)
                node.translation = tuple(np.add(node.translation, 1))
                self.assertEqual(wall["/kept"].translation, (2.0, 3.0, 4.0))
                self.assertGreater(frames.latest(PATIENCE).frame, 0)
                self.assertEqual(frames.gaps, 1)

    def test_a_server_that_ends_says_so(self):
        with Live(surface="none") as live, self.connect(live.link()) as wall:
            live.server.terminate()
            live.server.wait(PATIENCE)
            with self.assertRaisesRegex(tessera.NetworkError, "is over"):
                while True:
                    wall.status()

    def test_a_wrong_token_is_refused_in_the_console_s_words(self):
        with Live() as live:
            link = live.link()
            refused = "the console at http://[0-9.:]+ refuses: the token is not this server.s, or has ended"
            with self.assertRaisesRegex(tessera.Refused, refused):
                self.connect(link.rpartition("=")[0] + "=" + WORD)
            with self.assertRaisesRegex(tessera.NetworkError, "is no console of Tessera.*tessera-ctl link"):
                self.connect(f"http://{live.address}/?token={WORD}")  # where programs dial in without a console
            live.kill_server()
            with self.assertRaisesRegex(tessera.NetworkError, "no Tessera console at http://"):
                self.connect(link)


def exactly(connection, size):
    data = b""
    while len(data) < size:
        more = connection.recv(size - len(data))
        if not more:
            raise ConnectionError
        data += more
    return data


class Console:
    """A console's manners at /link, by hand: `frame` says, `message` hears."""

    def __init__(self, connection):
        self.connection = connection
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += exactly(connection, 1)
        self.head = head.decode()
        key = re.search("Sec-WebSocket-Key: (.*)\r\n", self.head).group(1)
        accept = base64.b64encode(hashlib.sha1(f"{key}258EAFA5-E914-47DA-95CA-C5AB0DC85B11".encode()).digest()).decode()
        connection.sendall(f"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: "
                           f"Upgrade\r\nSec-WebSocket-Accept: {accept}\r\n\r\n".encode())

    def frame(self, data, code=2, whole=True, size=None):
        size = len(data) if size is None else size
        head = bytes([code | (0x80 if whole else 0)])
        self.connection.sendall(head
                                + (bytes([size]) if size < 126 else b"\x7e" + struct.pack("!H", size) if size < 65536
                                   else
                                   b"\x7f" + struct.pack("!Q", size)) + data)

    def message(self):
        """(code, data) of the next frame."""
        code, size = exactly(self.connection, 2)
        assert code & 0x80 and size & 0x80, "whole, and masked"
        size &= 0x7F
        if size == 126:
            size = struct.unpack("!H", exactly(self.connection, 2))[0]
        elif size == 127:
            size = struct.unpack("!Q", exactly(self.connection, 8))[0]
        assert size <= 1 << 20
        mask = np.frombuffer(exactly(self.connection, 4), np.uint8)
        data = np.frombuffer(exactly(self.connection, size), np.uint8)
        return code & 0xF, (data ^ np.resize(mask, size)).tobytes()

    def said(self, name, **members):
        payload = _described.encode_message(schema().messages[name], members)
        return _wire.header_of(schema().messages[name].number, 7, payload) + payload.joined()

    def welcome(self, heartbeat_ms=50):
        return self.said("Welcome", epoch=7, heartbeat_ms=heartbeat_ms, lost_after_ms=800, token=(1, 2))


@unittest.skipUnless(HAS_WEBSOCKET, "python3-websocket is not installed (./deploy/set-up installs it)")
class Strangers(unittest.TestCase):
    def link(self, stranger):
        return f"http://{stranger.address}/?token={WORD}"

    def refused(self, serve, kind, what, timeout=0.5):
        with Stranger(serve) as stranger:
            begin = time.monotonic()
            with self.assertRaisesRegex(kind, what):
                tessera.connect(self.link(stranger), timeout=timeout)
            self.assertLess(time.monotonic() - begin, PATIENCE)

    def test_where_messages_end_means_nothing_and_a_ping_is_answered(self):
        heard, ponged = {}, threading.Event()

        def serve(connection):
            console = Console(connection)
            heard["head"] = console.head
            code, hello = console.message()
            header = _wire.Header(hello)
            heard["hello"] = _described.decode_message(schema().messages["Hello"],
                                                       memoryview(hello)[_wire.HEADER_BYTES:])
            header.check(hello[_wire.HEADER_BYTES:])
            console.frame(b"are you there", code=9)
            welcome = console.welcome()
            for at in range(len(welcome)):  # byte by byte, as one message of many frames
                console.frame(welcome[at:at + 1], code=0 if at else 2, whole=at + 1 == len(welcome))
                console.frame(b"", code=10)
            beats = b"".join(console.said("Heartbeat") for _ in range(3))
            console.frame(beats[:50])
            console.frame(b"")
            console.frame(beats[50:])
            while True:
                code, data = console.message()
                if code == 10:
                    heard["pong"] = data
                    ponged.set()

        with Stranger(serve) as stranger, tessera.connect(self.link(stranger), timeout=PATIENCE) as wall:
            self.assertTrue(ponged.wait(PATIENCE))
            self.assertTrue(wall.connected)
        self.assertEqual(heard["pong"], b"are you there")
        self.assertEqual(heard["hello"]["access"], WORD)
        self.assertIn(f"Authorization: Bearer {WORD}\r\n", heard["head"])
        self.assertRegex(heard["head"], f"^GET /link HTTP/1.1\r\n(.*\r\n)*Host: {stranger.address}\r\n")
        self.assertNotIn("Origin", heard["head"])

    def test_all_that_is_in_a_message_is_heard_at_once(self):
        def serve(connection):
            console = Console(connection)
            console.message()
            console.frame(console.welcome(heartbeat_ms=3_600_000))  # nothing else wakes the thread that reads
            console.frame(console.said("Heartbeat") + console.said("Over", reason="the show ends"))
            connection.recv(1)
        with Stranger(serve) as stranger, tessera.connect(self.link(stranger), timeout=PATIENCE) as wall:
            wall._link._thread.join(PATIENCE / 3)
            self.assertTrue(wall.over)

    def test_messages_that_make_no_sense_end_the_link(self):
        def with_a(deed):
            def serve(connection):
                console = Console(connection)
                console.message()
                deed(console)
            return serve
        for deed, what in ((lambda console: console.frame(b"hello", code=1), "text in a channel of bytes"),
                           (lambda console: console.frame(b"", size=1 << 40), "a message of 1099511627776 bytes"),
                           (lambda console: console.frame(struct.pack("!H", 1001) + b"the server has hung up", code=8),
                            "the server has hung up"),
                           (lambda console: console.frame(b"", code=5), "make no sense"),
                           (lambda console: console.connection.close(), "closed the connection")):
            self.refused(with_a(deed), tessera.NetworkError, what)

    def test_who_is_no_console(self):
        def answer(text):
            return lambda connection: (connection.recv(65536), connection.sendall(text),
                                       connection.shutdown(socket.SHUT_WR))

        enough = threading.Event()
        self.addCleanup(enough.set)

        def drip(connection):
            while not enough.wait(0.05):
                connection.sendall(b"H")
        words = b'{"error":{"code":"limit","message":"as many sockets are open as may be"}}'
        for serve, kind, what in (
                (lambda connection: None, tessera.Timeout, "did not answer in time"),
                (drip, tessera.Timeout, "did not answer in time"),
                (lambda connection: connection.close(), tessera.NetworkError, "is no console|broke"),
                (answer(b"TSRA" * 20 + b"\r\n"), tessera.NetworkError, "is no console of Tessera"),
                (answer(b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\nhi"), tessera.NetworkError, "it answers 200"),
                (answer(b"HTTP/1.1 301 Moved\r\nLocation: http://127.0.0.1:1/\r\n\r\n"), tessera.NetworkError,
                 "it answers 301"),
                (answer(b"HTTP/1.1 404 Not Found\r\nContent-Length: 51\r\n\r\n"
                        + b'{"error":{"code":"not_found","message":"not here"}}'), tessera.Unsupported, "not here"),
                (answer(b"HTTP/1.1 503 Busy\r\nContent-Length: %d\r\n\r\n" % len(words) + words), tessera.LimitExceeded,
                 "refuses: as many sockets")):
            with self.subTest(what=what):
                self.refused(serve, kind, what)

        def endless(connection):
            connection.sendall(b"HTTP/1.1 101 Yes\r\n")
            while True:
                connection.sendall(b"X: y\r\n" * 1000)
        self.refused(endless, tessera.NetworkError, "its answer does not end", timeout=PATIENCE)


if __name__ == "__main__":
    unittest.main()
