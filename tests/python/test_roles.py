"""Every request there is, by everybody who can come in, at every door: what is for a higher role is refused as such,
whatever it says.

Said with nothing in it: who may say a request is told what is missing, and who may not is told that alone."""
import http.client
import json
import unittest
import urllib.parse

import tessera
from console_socket import WebSocket
from live import PATIENCE, run_folder
from tessera import _wire
from test_sealed import SealedWall, contexts

ROLES = ("viewer", "editor", "operator")
IS_FOR = " is for an "  # roleRefusal, of common/request


def refused_for_its_role(message):
    return IS_FOR in message


class EveryRequest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = cls.enterClassContext(run_folder())
        cls.live = cls.enterClassContext(SealedWall(surface="none"))
        cls.timed = {}
        for role in ROLES:
            cls.timed[role] = cls.live.keys_say("token", f"t-{role}", "--role", role, "--hours", "1").split()[-1]
        cls.described = json.loads(cls.live.run("tessera-ctl", "requests", "--json").stdout)["requests"]
        cls.link = cls.live.sealed_link()
        cls.place = urllib.parse.urlsplit(cls.link).netloc
        cls.plain, cls.known = contexts(cls.live)

    def check(self, role, name, needed, refused, what, said=""):
        self.assertEqual(refused, ROLES.index(role) < ROLES.index(needed),
                         f"{name}, for {needed}, by {what} as {role}: {said}")

    def words(self, role):
        """By which one comes in as that: the server's own, and one for some time."""
        return {"a token": self.live.token(role), "a token for an hour": self.timed[role]}

    def wait_for_tokens(self):
        """The server reads its files soon after they change."""
        for _ in range(200):
            try:
                return self.get("GET", "/api", self.timed["operator"])
            except PermissionError:
                continue
        raise TimeoutError("the server does not know the tokens")

    def get(self, method, path, word, body=None):
        connection = http.client.HTTPSConnection(self.place, timeout=PATIENCE, context=self.plain)
        try:
            connection.request(method, path, body=body, headers={"Authorization": f"Bearer {word}"})
            answer = connection.getresponse()
            text = answer.read()
            if answer.status == 401:
                raise PermissionError(text)
            return answer.status, text
        finally:
            connection.close()

    def test_at_the_server_s_own_port(self):
        self.wait_for_tokens()
        people = {"viewer": "anna", "editor": "eve", "operator": "bob"}
        for role in ROLES:
            ways = {"a key": {"keys": self.live.key_of(people[role])}}
            for what, word in self.words(role).items():
                file = self.live.folder / "word"
                file.write_text(word + "\n")
                with tessera.connect(self.live.address, token_file=str(file), timeout=PATIENCE) as wall:
                    self.assertEqual(wall.whoami().role, role, what)
                    self.ask_all(wall, role, what)
            for what, way in ways.items():
                with tessera.connect(self.live.address, timeout=PATIENCE, **way) as wall:
                    self.assertEqual(wall.whoami().role, role, what)
                    self.ask_all(wall, role, what)

    def ask_all(self, wall, role, what):
        for request in self.described:
            head = bytearray()
            _wire.put_bytes(head, request["number"], b"")
            body = _wire.join_parts(head, [])
            try:
                wall._send(body, (), PATIENCE, None)
                refused, said = False, ""
            except tessera.TesseraError as error:
                refused, said = refused_for_its_role(str(error)), str(error)
            self.check(role, request["name"], request["role"], refused, what, said)

    def test_over_http(self):
        self.wait_for_tokens()
        for role in ROLES:
            for what, word in self.words(role).items():
                for request in self.described:
                    status, text = self.get("POST", f"/api/{request['name']}", word, "{}")
                    refused = status == 403 and refused_for_its_role(json.loads(text)["error"]["message"])
                    self.check(role, request["name"], request["role"], refused, f"{what} over HTTP")

    def test_on_a_socket(self):
        self.wait_for_tokens()
        for role in ROLES:
            for what, word in self.words(role).items():
                with WebSocket(self.place, word, context=self.plain) as socket:
                    for number, request in enumerate(self.described, 1):
                        socket.ask(number, request["name"])
                        refused = None
                        while refused is None:
                            told = socket.read()
                            if isinstance(told, dict) and told.get("id") == number:
                                refused = refused_for_its_role(told.get("error", {}).get("message", ""))
                        self.check(role, request["name"], request["role"], refused, f"{what} on a socket")
