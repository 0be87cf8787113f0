"""A panel's token: what its holder reaches on a wall of real processes, by the native link and through the console."""
import contextlib
import http.client
import json
import re
import socket
import ssl
import unittest
import urllib.error
import urllib.request

import tessera
from live import PATIENCE, YARD, Live, run_folder

PANEL = """title: "Yard"
controls { label: "carriage" node: "/carriage" field: "translation" choice { options { value: "0 1 1" } options {
  value: "0 2 1" } } }
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
                for refused in (lambda: setattr(carriage, "translation", (0, 2.5, 1)),
                                lambda: setattr(wall["/sun/light"], "intensity", 6),
                                lambda: setattr(carriage, "name", "x"), lambda: wall["/post"], lambda: wall.status(),
                                carriage.remove,
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
                return asks("api/ProposeChanges",
                            {"list": {"set": [{"type": "Transform", "field": "translation", "ids": [node],
                                               "values": [value]}]}})
            with live.connect() as mine:
                core = mine["/carriage"].core.id
                self.assertEqual(sets(core, [0, 2, 1]).get("answer"), "Committed")
                self.assertEqual(tuple(mine["/carriage"].translation), (0, 2, 1))
                self.assertIn("gives no such value", json.dumps(sets(core, [0, 3, 1])))
                self.assertEqual(asks("api/NavigateView", {"deed": "home"}).get("answer"), "Done")
                for path, fields in (("api/GetTree", {"node": "/carriage"}), ("api/GetStatus", {}), ("metrics", None),
                                     ("wall.jpg", None),
                                     ("tile/front-0-0.png", None), ("api/NavigateView", {"mode": "fly"}),
                                     ("api/GetObjects", {"names": ["/post"]})):
                    self.assertIn("panel", json.dumps(asks(path, fields)), path)
                self.assertEqual(tuple(mine["/carriage"].translation), (0, 2, 1))

    def test_it_is_told_as_it_stands_and_where_it_has_not_changed_as_that(self):
        with (VisitedWall(surface="none") as live, live.connect() as mine, run_folder(),
              live.connect(token_file=str(live.folder / "word")) as wall):
            told = wall.ask("GetPanel")
            self.assertEqual((told.title, [control.kind for control in told.controls]),
                             ("Yard", ["choice", "slider", "press"]))
            self.assertEqual(told.controls[1].now.object, mine["/sun/light"].core.id)
            mine["/sun/light"].intensity = 1.5
            later = wall.ask("GetPanel", since=told.stamp)
            self.assertEqual((later.same, list(later.controls[1].now.numbers)), (False, [1.5]))
            with self.assertRaisesRegex(tessera.TesseraError, "of no panel"):
                mine.ask("GetPanel")

    def test_a_server_serves_panels_of_its_own_without_keys(self):
        with run_folder() as folder:
            path = folder / "yard.panel"
            path.write_text(PANEL)
            with Live(surface="none", options=["--panel", str(path)]) as live, live.connect() as mine:
                link, _, word = re.search(re.escape(f"panel {path}: ") + r"(\S+)",
                                          live.log("server")).group(1).partition("?token=")

                def asks(target, fields=None):
                    request = urllib.request.Request(link + target, headers={"Authorization": "Bearer " + word},
                                                     data=None if fields is None else json.dumps(fields).encode())
                    try:
                        return urllib.request.urlopen(request, timeout=PATIENCE).read().decode()
                    except urllib.error.HTTPError as error:
                        return error.read().decode()
                self.assertIn("/page/panel.js", asks(""))
                self.assertEqual(json.loads(asks("api/GetPanel", {}))["fields"]["title"], "Yard")
                sun = {"type": "DirectionalLight", "field": "intensity", "ids": [mine["/sun/light"].core.id],
                       "values": [4.5]}
                self.assertEqual(json.loads(asks("api/ProposeChanges", {"list": {"set": [sun]}}))["answer"],
                                 "Committed")
                self.assertEqual(mine["/sun/light"].intensity, 4.5)
                for target, fields in (("api/GetStatus", {}), ("api/GetTree", {}), ("wall.jpg", None)):
                    self.assertIn("panel", asks(target, fields))
                of_panel, mine_word = word, live.token()
                for word in (of_panel, live.token("viewer")):
                    self.assertIn("told to editors", asks("panels"))
                word = mine_word
                self.assertEqual(json.loads(asks("panels"))["panels"], [{"title": "Yard", "token": of_panel}])
                word = "x" * 43
                self.assertIn("token", asks("api/GetPanel", {}))

    def test_a_hundred_tablets_share_one_word(self):
        with run_folder() as folder:
            path = folder / "yard.panel"
            path.write_text(PANEL)
            with (Live(surface="none", options=["--panel", str(path)]) as live, live.connect() as mine,
                  contextlib.ExitStack() as tablets):
                door, word = re.search(r"panel .*http://([^/]+)/\?token=(\S+)", live.log("server")).groups()
                connections = [tablets.enter_context(
                    contextlib.closing(http.client.HTTPConnection(door, timeout=PATIENCE))) for _ in range(100)]

                def told(since):
                    for connection in connections:
                        connection.request("POST", "/api/GetPanel", json.dumps({"since": since}),
                                           {"Authorization": "Bearer " + word})
                    answers = [connection.getresponse() for connection in connections]
                    self.assertEqual({answer.status for answer in answers}, {200})
                    return [json.loads(answer.read())["fields"] for answer in answers]
                self.assertEqual({state["title"] for state in told("")}, {"Yard"})
                mine["/sun/light"].intensity = 1.25
                self.assertEqual({state["controls"][1]["now"]["numbers"][0] for state in told("")}, {1.25})
                self.assertLess(mine.status().applications, 10,
                                "they are one application of the server's, and not a hundred")

    def test_a_panel_that_is_none_is_said_before_the_server_starts(self):
        for options, words in ((["--panel", "/nowhere.panel"], "no such panel"), (["--panel", "/dev/zero"], "no file"),
                               (["--no-console", "--panel", "/nowhere.panel"], "--no-console")):
            ended = Live.run(None, "tessera-server", "--wall", "1x1", "--scene", str(YARD), *options)
            self.assertIn(words, ended.stderr)
            self.assertNotEqual(ended.returncode, 0)

    def test_a_body_that_comes_after_its_token_s_end_does_nothing(self):
        with VisitedWall(surface="none") as live, live.connect() as mine:
            port = int(live.sealed_link().split("?")[0].rstrip("/").rsplit(":", 1)[1])
            context = ssl.create_default_context(cafile=str(live.keys / "authority.crt"))
            body = (b'{"list":{"set":[{"type":"Transform","field":"translation","ids":[%d],"values":[[0,2,1]]}]}}'
                    % mine["/carriage"].core.id)
            with (socket.create_connection(("127.0.0.1", port), PATIENCE) as plain,
                  context.wrap_socket(plain, server_hostname="localhost") as sealed):
                sealed.sendall(b"POST /api/ProposeChanges HTTP/1.1\r\nHost: localhost:%d\r\nAuthorization: Bearer "
                               b"%s\r\nContent-Length: %d\r\n\r\n"
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
