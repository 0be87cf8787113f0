"""Much at once over the console's sockets: answers, arrays, readers that stop."""
import contextlib
import http.client
import itertools
import json
import os
import socket
import time
import unittest

import numpy as np

from live import PATIENCE, Live, figure
from console_socket import WebSocket, array_name


class Bounds(unittest.TestCase):
    def test_a_large_answer_comes_whole(self):
        with Live(surface="none") as live, live.connect() as wall:
            joints = []
            for group in range(30):
                with wall.edit():
                    wall.create(f"/g{group}", None)
                    nodes = [wall.create(f"/g{group}/{at}", None) for at in range(1000)]
                joints += [node.id for node in nodes]
            with wall.edit():
                skins = [wall.create(f"/skin{at}", "Skin", joints=np.array(joints, np.uint64)) for at in range(4)]
            door, _, token = live.link().removeprefix("http://").partition("/?token=")
            with WebSocket(door, token, "/socket?changes=1") as one, WebSocket(door, token) as other:
                one.ask(0, "GetStatus")
                while one.read().get("id") != 0:
                    pass
                names = [f"#{skin.id}" for skin in skins]
                for at in range(1, 3):  # two of a name are open at once
                    one.ask(at, "GetObjects", names=names[:at], content=True)
                    one.ask(-at, "WhoAmI")
                answers = (said for said in iter(one.read, None) if "id" in said)  # among the scene and its changes
                told = {answer["id"]: answer["fields"] for answer in itertools.islice(answers, 4)}
                self.assertEqual(set(told), {1, -1, 2, -2})
                self.assertGreater(told[2]["sequence"], 0, "as of which list: others may have come before it")
                other.ask(1, "GetObjects", names=names, content=True)
                answer = other.read()
                self.assertEqual((answer["id"], len(answer["fields"]["objects"])), (1, len(skins)))
                told = [each for column in answer["fields"]["content"]["set"] if column["field"] == "joints"
                        for each in column["values"]]
                self.assertEqual(len(told), len(skins))
                self.assertTrue(all(each == joints for each in told))
            many = []
            for _ in range(7):
                with wall.edit():
                    many += [wall.create(f"/more{len(many) + at}", "Skin", joints=np.array(joints, np.uint64))
                             for at in range(10)]
            self.nobody_holds_much_over_http(door, token, [f"#{skin.id}" for skin in many])

    def nobody_holds_much_over_http(self, door, token, names):
        body = json.dumps({"names": names, "content": True})

        def ask(connection):
            connection.request("POST", "/api/GetObjects", body, {"Authorization": f"Bearer {token}"})
            return connection
        with contextlib.ExitStack() as kept:
            still = [kept.enter_context(contextlib.closing(http.client.HTTPConnection(door, timeout=PATIENCE)))
                     for _ in range(16)]
            for each in still:
                each.connect()
                each.sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)
                ask(each)
            reader = kept.enter_context(contextlib.closing(http.client.HTTPConnection(door, timeout=PATIENCE)))
            began = time.monotonic()
            while time.monotonic() < began + 4:
                self.assertEqual(ask(reader).getresponse().read(2), b"{\"")
                reader.close()
            ended = 0
            for each in still:
                try:
                    each.getresponse().read()
                except (OSError, http.client.HTTPException):
                    ended += 1
            self.assertGreaterEqual(ended, 1, "sixteen who do not take 12 MB each are more than 64 MiB together")
            self.assertLess(ended, len(still), "no more than has to go")

    def test_of_many_that_do_not_read_some_go_and_who_reads_stays(self):
        piece, pieces = 256 << 10, 80
        with Live(surface="none") as live, live.connect() as wall:
            data = os.urandom(piece)
            wall.create("/bytes", "ApplicationData", data=data)
            door, _, token = live.link().removeprefix("http://").partition("/?token=")
            array = array_name(np.frombuffer(data, np.uint8))
            with WebSocket(door, token) as reader, contextlib.ExitStack() as kept:
                still = [kept.enter_context(WebSocket(door, token)) for _ in range(8)]
                for each in still:
                    each.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)
                    each.socket.sendall(b"".join(
                        WebSocket.question(at, "GetArray", blob=array, length=piece) for at in range(pieces)))
                frames, began, asked = kept.enter_context(wall.frames(timeout=PATIENCE)), time.monotonic(), 0
                while time.monotonic() < began + 5:
                    reader.ask(asked, "GetArray", blob=array, length=piece)
                    self.assertEqual(reader.read()["id"], asked)
                    self.assertEqual(reader.read(), data)
                    asked += 1
                    next(frames)
                ended = 0
                for each in still:
                    try:
                        for _ in range(2 * pieces):
                            each.read()
                    except OSError:
                        ended += 1
                self.assertGreaterEqual(ended, 1, "eight of which each holds 16 MiB are more than 64 together")
                self.assertLess(ended, len(still), "no more than has to go")

    def test_of_many_who_bring_much_one_goes(self):
        frame = bytes(60 << 20)
        with Live() as live, contextlib.ExitStack() as kept:
            door, _, token = live.link(role="editor").removeprefix("http://").partition("/?token=")
            sockets = [kept.enter_context(WebSocket(door, token)) for _ in range(3)]
            with self.assertRaisesRegex(OSError, "too many arrays come at once|reset|Broken pipe"):
                for one in sockets:
                    one.socket.sendall(WebSocket.frame('{"id":1,"request":"ProposeChanges","binaries":5}'))
                    for _ in range(4):
                        one.send_binary(frame)
                sockets[-1].read()
            self.assertLess(figure(live.server, "VmHWM"), 900_000, "kB of 720 MiB")
            sockets[0].send_binary(bytes(1 << 16))
            self.assertEqual(sockets[0].read()["id"], 1, "who was there first is answered")
            host, _, port = door.partition(":")
            with socket.create_connection((host, int(port)), PATIENCE, source_address=("127.0.0.2", 0)) as stranger:
                stranger.sendall(f"GET /style.css HTTP/1.1\r\nHost: {door}\r\n\r\n".encode() * 600 + b"end\r\n\r\n")
                said = b"".join(iter(lambda: stranger.recv(1 << 16), b""))
                self.assertIn(b" 429 ", said)
                for _ in range(20):
                    with contextlib.closing(http.client.HTTPConnection(door, timeout=PATIENCE)) as page:
                        page.request("GET", "/page/main.js")
                        self.assertEqual(page.getresponse().status, 200,
                                         "a stranger elsewhere keeps nobody from the page")
            with WebSocket(door, token) as one, self.assertRaisesRegex(ConnectionError, "no text has announced"):
                # And not the rest
                one.socket.sendall(b"\x02\xff" + (60 << 20).to_bytes(8, "big") + b"\0\0\0\0" + bytes(1 << 16))
                one.read()


if __name__ == "__main__":
    unittest.main()
