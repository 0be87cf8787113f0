"""A panel's token: what its holder reaches on a wall of real processes, by the native link and through the console."""
import json
import socket
import ssl
import unittest
import urllib.error
import urllib.request

import tessera
from live import PATIENCE, Live, run_folder

PANEL = """title: "Yard"
controls { label: "carriage" node: "/carriage" field: "translation" choice { options { value: "0 1 1" } options { value: "0 2 1" } } }
controls { label: "sun" node: "/sun/light" field: "intensity" slider { greatest: 5 } }
controls { press { home: true } }
"""


class VisitedWall(Live):
    def __enter__(self):
        self.make_keys()
        (self.folder / "yard.panel").write_text(PANEL)
        self.word = self.keys_say("token", "visitor", "--panel", str(self.folder / "yard.panel")).split()[-1]
        (self.folder / "word").write_text(self.word + "\n")
        return super().__enter__()


class Panel(unittest.TestCase):
    def setUp(self):
        self.enterContext(run_folder())

    def test_it_reaches_its_fields_alone(self):
        with VisitedWall(surface="none") as live:
            with live.connect() as mine, run_folder(), live.connect(token_file=str(live.folder / "word")) as wall:
                carriage = wall["/carriage"]
                carriage.translation = (0, 2, 1)
                self.assertEqual(tuple(mine["/carriage"].translation), (0, 2, 1))
                wall["/sun/light"].intensity = 4.5
                self.assertEqual(wall["/sun/light"].intensity, 4.5)
                for refused in (lambda: setattr(carriage, "translation", (0, 2.5, 1)), lambda: setattr(wall["/sun/light"], "intensity", 6),
                                lambda: setattr(carriage, "name", "x"), lambda: wall["/post"], lambda: wall.status(), carriage.remove,
                                lambda: wall.image(), lambda: wall.undo(), lambda: next(iter(wall.follow("contacts"))),
                                lambda: next(iter(wall.follow("changes"))), lambda: wall.load("x")):
                    with self.assertRaisesRegex(tessera.TesseraError, "panel|operator"):
                        refused()
                self.assertEqual(tuple(mine["/carriage"].translation), (0, 2, 1))
                self.assertEqual(wall.whoami().role, "editor")
                live.keys_say("revoke", "visitor")
                with self.assertRaises(tessera.TesseraError):
                    while True:
                        carriage.translation = (0, 1, 1)

    def test_through_the_console_too(self):
        with VisitedWall(surface="none") as live:
            context = ssl.create_default_context(cafile=str(live.keys / "authority.crt"))
            link = live.sealed_link().split("?")[0]

            def asks(path, fields=None):
                request = urllib.request.Request(link + path, headers={"Authorization": "Bearer " + live.word},
                                                 data=None if fields is None else json.dumps(fields).encode())
                try:
                    return json.loads(urllib.request.urlopen(request, context=context, timeout=PATIENCE).read() or "{}")
                except urllib.error.HTTPError as error:
                    return json.loads(error.read())

            def sets(node, value):
                return asks("api/ProposeChanges", {"list": {"set": [{"type": "Transform", "field": "translation", "ids": [node], "values": [value]}]}})
            with live.connect() as mine:
                core = mine["/carriage"].core.id
                self.assertEqual(sets(core, [0, 2, 1]).get("answer"), "Committed")
                self.assertEqual(tuple(mine["/carriage"].translation), (0, 2, 1))
                self.assertIn("gives no such value", json.dumps(sets(core, [0, 3, 1])))
                self.assertEqual(asks("api/NavigateView", {"deed": "home"}).get("answer"), "Done")
                for path, fields in (("api/GetTree", {"node": "/carriage"}), ("api/GetStatus", {}), ("metrics", None), ("wall.jpg", None),
                                     ("tile/front-0-0.png", None), ("api/NavigateView", {"mode": "fly"}), ("api/GetObjects", {"names": ["/post"]})):
                    self.assertIn("panel", json.dumps(asks(path, fields)), path)
                self.assertEqual(tuple(mine["/carriage"].translation), (0, 2, 1))

    def test_a_body_that_comes_after_its_token_s_end_does_nothing(self):
        with VisitedWall(surface="none") as live, live.connect() as mine:
            port = int(live.sealed_link().split("?")[0].rstrip("/").rsplit(":", 1)[1])
            context = ssl.create_default_context(cafile=str(live.keys / "authority.crt"))
            body = b'{"list":{"set":[{"type":"Transform","field":"translation","ids":[%d],"values":[[0,2,1]]}]}}' % mine["/carriage"].core.id
            with socket.create_connection(("127.0.0.1", port), PATIENCE) as plain, context.wrap_socket(plain, server_hostname="localhost") as sealed:
                sealed.sendall(b"POST /api/ProposeChanges HTTP/1.1\r\nHost: localhost:%d\r\nAuthorization: Bearer %s\r\nContent-Length: %d\r\n\r\n"
                               % (port, live.word.encode(), len(body)) + body[:9])
                live.keys_say("revoke", "visitor")
                try:
                    self.assertNotIn(b"200 OK", sealed.recv(4096))  # it is closed, with a word or without
                    sealed.sendall(body[9:])
                    sealed.recv(4096)
                except OSError:
                    pass
            mine["/post"].name = "post"  # behind whatever was asked
            self.assertNotEqual(mine["/carriage"].translation[1], 2)


if __name__ == "__main__":
    unittest.main()
