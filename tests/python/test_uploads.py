"""Files through the console: what is brought is whole or not there at all, has bounds, and can be loaded; the scene and
the wall come out as files."""
import http.client
import json
import os
import pathlib
import random
import socket
import ssl
import struct
import tempfile
import time
import unittest
import urllib.parse

import numpy
from live import PATIENCE, Live, figure, processor_seconds, run_folder
from page_browser import until
from tessera._picture import decode_png

TRIANGLE = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)


def model(name="triangle.bin", size=len(TRIANGLE)):
    """A glTF whose points lie in a file beside it."""
    return json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "brought"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "buffers": [{"uri": name, "byteLength": size}],
        "bufferViews": [{"buffer": 0, "byteLength": size}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0],
                       "max": [1, 1, 0]}]}).encode()


class Door:
    """HTTP as a page speaks it."""

    def __init__(self, live, role="operator"):
        self.address = live.link().split("//")[1].split("/?")[0]
        self.token = live.token(role)

    def ask(self, method, path, body=None, **head):
        connection = http.client.HTTPConnection(self.address, timeout=PATIENCE)
        try:
            connection.request(method, urllib.parse.quote(path), body,
                               {"Authorization": f"Bearer {self.token}", **head})
            answer = connection.getresponse()
            return answer.status, answer.read()
        finally:
            connection.close()

    def json(self, *what, **more):
        status, body = self.ask(*what, **more)
        return status, json.loads(body)

    def request(self, name, **fields):
        return self.json("POST", f"/api/{name}", json.dumps(fields))

    def begin(self, name, length, some=b""):
        """The head of an upload, and the beginning of its body."""
        return self.says(f"PUT /upload/{name} HTTP/1.1", some, f"Content-Length: {length}\r\n")

    def says(self, line, body=b"", more=""):
        host, _, port = self.address.rpartition(":")
        stream = socket.create_connection((host, int(port)), timeout=PATIENCE)
        stream.sendall(f"{line}\r\nHost: {self.address}\r\nAuthorization: Bearer "
                       f"{self.token}\r\n{more}\r\n".encode() + body)
        return stream

    def used(self):
        return self.json("GET", "/upload")[1]


class Uploads(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.enterClassContext(run_folder())
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="tessera-files-")))
        cls.live = cls.enterClassContext(Live(wall="2x2", surface="osmesa", size="96x64", journal=True, options=[
            "--audit", str(cls.folder / "audit"), "--uploads-mib", "300"]))
        cls.door = Door(cls.live)
        cls.wall = cls.enterClassContext(cls.live.connect())

    def there(self):
        return sorted(str(path.relative_to(self.uploads())) for path in self.uploads().rglob("*"))

    def uploads(self):
        return pathlib.Path(self.door.used()["folder"])

    def tearDown(self):
        for name in os.listdir(self.uploads()):
            self.door.ask("DELETE", f"/upload/{name}")
        self.assertEqual(self.there(), [])

    def bring(self, name, body):
        status, said = self.door.json("PUT", f"/upload/{name}", body)
        self.assertEqual(status, 201, said)
        return said["path"]

    def test_a_model_and_the_file_that_it_names_are_loaded(self):
        self.bring("hall/triangle.bin", TRIANGLE)
        path = self.bring("hall/hall.gltf", model())
        status, listed = self.door.request("GetFiles", folder=str(self.uploads() / "hall"))
        self.assertEqual([(entry["name"], entry["loads"]) for entry in listed["fields"]["entries"]],
                         [("hall.gltf", True), ("triangle.bin", False)])
        status, loaded = self.door.request("LoadFile", path=path, fit=2)
        self.assertEqual(status, 200, loaded)
        self.assertEqual(loaded["fields"]["triangles"], 1)
        self.assertIn("notes", loaded["fields"])
        self.assertTrue(self.wall.find("/**/brought"))

    def test_what_is_no_model_is_refused_in_the_importers_words(self):
        for name, body in (("text.gltf", b"this is a letter, not a model"), ("text.glb", b"glTF" + bytes(100)),
                           ("lonely.gltf", model("nowhere.bin"))):
            status, said = self.door.request("LoadFile", path=self.bring(name, body))
            self.assertGreaterEqual(status, 400)
            self.assertIn(name, said["error"]["message"])
        self.assertIsNone(self.live.server.poll())

    def test_one_that_stops_leaves_nothing(self):
        before = self.door.used()
        with self.door.begin("half/hall.gltf", 100_000, b"x" * 50_000):
            until("its place to be taken", lambda: self.door.used()["bytes"] == before["bytes"] + 100_000)
            self.assertEqual([name for name in self.there() if not name.startswith(".incoming")], [])
        until("its place to be free", lambda: self.door.used() == before)
        self.assertEqual(self.there(), [])

    def test_one_that_stalls_is_told_so(self):
        with self.door.begin("slow.gltf", 100_000, b"x" * 1000) as stream:
            answer = http.client.HTTPResponse(stream)
            answer.begin()
            self.assertEqual(answer.status, 408)
            self.assertIn("stopped coming", json.loads(answer.read())["error"]["message"])
        until("nothing to be there", lambda: self.there() == [])

    def test_who_waits_to_be_asked_is_refused_before_a_byte_has_come(self):
        def ask(name, length):
            """Whether it is asked for the body, and how it ends."""
            with self.door.says(f"PUT /upload/{name} HTTP/1.1",
                                more=f"Content-Length: {length}\r\nExpect: 100-continue\r\n") as stream:
                head = b""
                while b"\r\n\r\n" not in head:
                    head += stream.recv(1)
                asked = head.startswith(b"HTTP/1.1 100")
                if asked:
                    stream.sendall(b"x" * length)
                    head = b""
                    while b"\r\n\r\n" not in head:
                        head += stream.recv(1)
                return asked, int(head.split()[1])

        self.assertEqual(ask("a", 1000), (True, 201))
        with self.door.begin("b", 200 << 20):
            until("its place to be taken", lambda: self.door.used()["files"] == 2)
            self.assertEqual(ask("c", 200 << 20), (False, 413), "there is no room for it")
        self.assertEqual(ask("c", 301 << 20), (False, 413))
        streams = [self.door.begin(f"d{i}", 1000, b"x") for i in range(8)]
        until("all to have begun", lambda: self.door.used()["files"] == 9)
        self.assertEqual(ask("c", 1000), (False, 503))
        for stream in streams:
            stream.close()

    def test_one_in_the_place_of_another_has_its_room(self):
        self.bring("a", bytes(200 << 20))
        self.bring("a", bytes(201 << 20))
        self.assertEqual((self.door.used()["bytes"], self.door.used()["files"]), (201 << 20, 1))

    def test_what_is_too_large_is_refused_before_it_comes(self):
        for length, status in ((301 << 20, 413), (2 ** 63, 413), (0, 400), (None, 411)):
            with self.door.begin("a.gltf", length) if length is not None else self.without_length() as stream:
                answer = http.client.HTTPResponse(stream)
                answer.begin()
                self.assertEqual(answer.status, status, length)
                self.assertTrue(json.loads(answer.read())["error"]["message"])
        with self.door.begin("a", 200 << 20), self.door.begin("b", 200 << 20) as second:
            answer = http.client.HTTPResponse(second)
            answer.begin()
            self.assertEqual(answer.status, 413)
            self.assertIn("remove some", json.loads(answer.read())["error"]["message"])
        until("nothing to be there", lambda: self.there() == [])

    def without_length(self):
        return self.door.says("PUT /upload/a HTTP/1.1", b"x")

    def test_only_so_many_come_at_once(self):
        streams = [self.door.begin(f"a{i}", 1000, b"x") for i in range(8)]
        try:
            until("all to have begun", lambda: self.door.used()["files"] == 8)
            status, said = self.door.json("PUT", "/upload/ninth", b"x")
            self.assertEqual(status, 503, said)
        finally:
            for stream in streams:
                stream.close()
        until("nothing to be there", lambda: self.there() == [])

    def test_who_may_not_load_files_brings_none(self):
        for role, saves in (("viewer", 403), ("editor", 200)):
            door = Door(self.live, role)
            self.assertEqual(door.ask("PUT", "/upload/a", b"x")[0], 403)
            self.assertEqual(door.ask("DELETE", "/upload/a")[0], 403)
            self.assertEqual(door.ask("GET", "/upload")[0], 403)
            self.assertEqual(door.request("GetFiles")[0], 403)
            self.assertEqual(door.ask("GET", "/scene.tsct")[0], saves)
            self.assertEqual(door.ask("GET", "/wall.png")[0], 200)

    def test_what_nobody_may_do_is_refused(self):
        for method, path in (("POST", "/upload/a"), ("GET", "/upload/a"), ("ELE", "/upload/a"), ("PUT", "/upload"),
                             ("DELETE", "/scene.tsc"), ("E", "/scene.tsc")):
            self.assertEqual(self.door.ask(method, path)[0], 405, (method, path))

    def test_names_lead_nowhere_else(self):
        for name in ("../a", "a/../../b", ".a", "a//b", "a\\b", "a/b/c/d/e", "a" * 256, "a\u202eb", "/etc/x"):
            status, said = self.door.json("PUT", f"/upload/{name}", b"x")
            self.assertEqual(status, 400, name)
            self.assertIn("name", said["error"]["message"] + "name" * ("folders" in said["error"]["message"]))
        strange = "世界 <img src=x onerror=alert(1)>/مرحبا.txt"
        self.assertEqual(self.bring(strange, b"x"), str(self.uploads() / strange))

    def test_much_takes_no_memory(self):
        size = 256 << 20
        self.door.used()
        before = figure(self.live.server, "VmRSS")
        with self.door.begin("large", size) as stream:
            piece, highest = bytes(1 << 20), 0
            for _ in range(size >> 20):
                stream.sendall(piece)
                highest = max(highest, figure(self.live.server, "VmRSS"))
            answer = http.client.HTTPResponse(stream)
            answer.begin()
            self.assertEqual((answer.status, json.loads(answer.read())["bytes"]), (201, size))
        self.assertLess(highest - before, 32 << 10, "KiB")

    def test_the_scene_is_saved_as_it_is(self):
        status, text = self.door.ask("GET", "/scene.tsct")
        self.assertEqual(status, 200)
        status, binary = self.door.ask("GET", "/scene.tsc")
        self.assertEqual(status, 200)
        (self.folder / "saved.tsc").write_bytes(binary)
        with Live(scene=self.folder / "saved.tsc") as again:
            status, loaded = Door(again).ask("GET", "/scene.tsct")
        self.assertEqual(status, 200)
        self.assertEqual(loaded.decode(), text.decode())

    def test_a_saved_text_that_a_hand_has_edited_looks_the_same(self):
        self.wall["/drive"].playing = False
        self.wall["/carriage"].translation = (-1, 0.5, 0)
        file = self.folder / "hand.tsct"
        said = self.live.run("tessera-ctl", "--server", self.live.address, "save", str(file))
        self.assertEqual(said.returncode, 0, said.stderr)
        arrays, = self.folder.glob("hand.*.arrays")
        self.assertIn(str(arrays), said.stdout)
        text = file.read_text()
        self.assertIn('\n  node { name: "stop" interest { object: "carriage" against: "post" } }\n', text)
        # A node more, one less, another name; lines in another order.
        lines = [line for line in text.splitlines() if 'name: "stop"' not in line]
        at = next(i for i, line in enumerate(lines) if line.startswith('  node { name: "sky"'))
        sky = lines.pop(at)
        lines.insert(len(lines) - 1, sky)
        lines.insert(at, '  node { name: "note" application_data { key: "by.hand" data: "17" } }')
        edited = "\n".join(lines).replace('"material-1"', '"Stahl, gebürstet"')
        self.assertIn("gebürstet", edited)
        file.write_text(edited)
        with Live(wall="2x2", surface="osmesa", size="96x64", scene=file) as again, again.connect() as wall:
            self.assertTrue(wall.find("/note"))
            pictures = [decode_png(memoryview(door.ask("GET", "/wall.png")[1])) for door in (self.door, Door(again))]
        self.assertTrue(numpy.array_equal(*pictures))
        self.assertGreater(len(numpy.unique(pictures[0].reshape(-1, pictures[0].shape[-1]), axis=0)), 10, "a picture")
        # It is brought with its arrays, as a model with its files.
        missing = self.bring("alone/hand.tsct", edited.encode())
        status, refused = self.door.request("LoadFile", path=missing)
        self.assertNotEqual(status, 200)
        self.assertIn(f"its arrays lie in '{arrays.name}' beside it", json.dumps(refused))
        self.bring(f"hand/{arrays.name}", arrays.read_bytes())
        status, loaded = self.door.request("LoadFile", path=self.bring("hand/hand.tsct", edited.encode()))
        self.assertEqual(status, 200, loaded)

    def test_the_whole_wall_is_its_tiles_pixel_by_pixel(self):
        plan = self.door.request("GetWall")[1]["fields"]
        status, png = self.door.ask("GET", "/wall.png")
        self.assertEqual(status, 200)
        tiles = sorted((tile["y"], tile["x"], tile["name"]) for tile in plan["tiles"])
        rows = [[decode_png(memoryview(self.door.ask("GET", f"/tile/{name}.png")[1])) for at, _, name in tiles
                 if at == y]
                for y in sorted({y for y, _, _ in tiles})]
        wanted = numpy.concatenate([numpy.concatenate(row, axis=1) for row in rows])
        self.assertTrue(numpy.array_equal(decode_png(memoryview(png)), wanted))
        self.assertGreater(len(numpy.unique(wanted.reshape(-1, wanted.shape[-1]), axis=0)), 10, "a picture")

    def test_files_are_there_after_a_restart_and_who_brought_them_is_kept(self):
        path = pathlib.Path(self.bring("stays.bin", b"1234"))
        stream = self.door.begin("half", 1000, b"x" * 10)
        until("it to have begun", lambda: self.door.used()["files"] == 2)
        audit = self.folder / "audit"
        # A kill loses the last second
        until("it to be kept who brought it", lambda: audit.exists() and str(path) in audit.read_text())
        self.live.kill_server()
        stream.close()
        self.live.start_server()
        type(self).door = Door(self.live)
        until("the door", lambda: self.door.used()["files"] == 1)
        self.assertEqual(path.read_bytes(), b"1234")
        self.assertEqual(self.there(), ["stays.bin"])
        lines = [json.loads(line) for line in audit.read_text().splitlines()]
        self.assertTrue([line for line in lines if str(path) in json.dumps(line, ensure_ascii=False)
                         and "PutFile" in json.dumps(line)], lines[-3:])


class WholeWall(unittest.TestCase):
    def test_who_asks_for_it_and_goes_keeps_nobody_waiting(self):
        with run_folder(), Live(surface="osmesa", size="2560x1440", options=["--rate", "4"]) as live:
            door = Door(live)
            self.assertEqual(door.ask("GET", "/wall.png")[0], 200)
            before = processor_seconds(live.server)
            self.assertEqual(door.ask("GET", "/wall.png")[0], 200)
            one = processor_seconds(live.server) - before
            for _ in range(200):
                door.says("GET /wall.png HTTP/1.1").close()
            before = processor_seconds(live.server)
            self.assertEqual([door.ask("GET", path)[0] for path in ("/wall.jpg", "/wall.png")], [200, 200])
            # Those who go are not drawn for: 200 pictures would be in its time
            self.assertLess(processor_seconds(live.server) - before, 30 * one + 1)


class SealedUploads(unittest.TestCase):
    def test_with_keys_it_is_the_same(self):
        with run_folder():
            live = Live()
            live.make_keys()
            with live:
                link = urllib.parse.urlsplit(live.sealed_link())
                token = urllib.parse.parse_qs(link.query)["token"][0]
                context = ssl.create_default_context(cafile=str(live.keys / "authority.crt"))

                def ask(method, path, body=None):
                    connection = http.client.HTTPSConnection(link.netloc, timeout=PATIENCE, context=context)
                    try:
                        connection.request(method, path, body, {"Authorization": f"Bearer {token}"})
                        answer = connection.getresponse()
                        return answer.status, answer.read()
                    finally:
                        connection.close()

                body = random.Random(44).randbytes(3_000_001)
                status, said = ask("PUT", "/upload/noise.bin", body)
                self.assertEqual(status, 201, said)
                self.assertEqual(pathlib.Path(json.loads(said)["path"]).read_bytes(), body)
                status, scene = ask("GET", "/scene.tsct")
                self.assertEqual(status, 200)
                self.assertIn(b"carriage", scene)


if __name__ == "__main__":
    unittest.main()
