"""Who did what: by which door, with which key or token, on a wall of real processes."""
import http.client
import json
import pathlib
import signal
import ssl
import unittest
import urllib.request

import tessera
from eventually import eventually
from live import PATIENCE, Live, run_folder


class AuditedWall(Live):
    def __init__(self, keys=True, **options):
        super().__init__(surface="none", **options)
        self.audit = self.folder / "audit.log"
        self._options += ["--audit", str(self.audit)]
        self._keys = keys

    def __enter__(self):
        if self._keys:
            self.make_keys("anna:editor", "vera:viewer")
            (self.folder / "word").write_text(
                self.keys_say("token", "ci", "--role", "operator", "--hours", "1").split()[-1] + "\n")
        return super().__enter__()

    def lines(self):
        """Once the server has ended: each as it stands there."""
        self.server.send_signal(signal.SIGTERM)
        self.server.wait(PATIENCE)
        return [json.loads(line) for line in self.audit.read_text().splitlines()]


class Audit(unittest.TestCase):
    def setUp(self):
        self.enterContext(run_folder())

    def test_each_way_in_is_told_apart(self):
        with AuditedWall() as live:
            with run_folder():
                for options in ({"keys": live.key_of("anna")}, {"token_file": str(live.folder / "word")}):
                    with live.connect(name="program", **options) as wall:
                        wall["/carriage"].translation = (0.5, 1, 1)
            with live.connect(name="mine") as wall:
                wall["/carriage"].translation = (0, 1, 1)
            link = live.sealed_link().split("?")[0]
            anna = ssl.create_default_context(cafile=str(live.keys / "authority.crt"))
            anna.load_cert_chain(pathlib.Path(live.key_of("anna")) / "person-anna.pem")
            ask = urllib.request.Request(link + "api/MoveNode", data=b'{"node":"/carriage","translation":[0,2,1]}')
            urllib.request.urlopen(ask, context=anna, timeout=PATIENCE).read()
            lines = live.lines()
        told = {(line["who"], line["by"], line["program"], line["did"]) for line in lines}
        mine, = (line["who"] for line in lines if line["program"] == "mine")
        self.assertEqual(told, {("anna", "a key", "program", "ProposeChanges"),
                                ("ci", "a token", "program", "ProposeChanges"),
                                (mine, "the server's token", "mine", "ProposeChanges"),
                                ("anna", "a key", "console", "MoveNode")})
        for line in lines:
            self.assertEqual(line["objects"], ["/carriage"])
            self.assertTrue(line["from"].startswith("127.0.0.1"), line)

    def test_each_request_over_http_is_told_with_its_own_address(self):
        places = ["127.0.0.3", "127.0.0.4", "127.0.0.5", "127.0.0.3"]
        with AuditedWall(keys=False) as live:
            address, token = live.link().split("//")[1].split("/?token=")
            for at, place in enumerate(places, 1):
                door = http.client.HTTPConnection(address, source_address=(place, 0), timeout=PATIENCE)
                door.request("POST", "/api/MoveNode", b'{"node":"/carriage","translation":[0,2,1]}',
                             {"Authorization": "Bearer " + token})
                self.assertEqual(door.getresponse().status, 200)
                door.close()
                # Alike within a second is one line, which is written once it is over
                self.assertTrue(eventually(lambda: live.audit.read_text().count("\n") == at))
            self.assertEqual([line["from"] for line in live.lines()], places)

    def test_a_viewer_who_edits_is_told_of(self):
        with AuditedWall() as live, run_folder():
            with live.connect(keys=live.key_of("vera")) as wall, self.assertRaises(tessera.Refused):
                wall["/carriage"].translation = (0, 1, 1)
            line, = live.lines()
            self.assertEqual((line["who"], line["role"], line["did"]), ("vera", "viewer", "ProposeChanges"))
            self.assertIn("editor", line["refused"])

    def test_a_file_that_cannot_be_written_is_told_before_the_wall_begins(self):
        with Live() as live:
            for path in (live.folder, live.folder / "none" / "audit.log"):
                done = live.run("tessera-server", "--audit", str(path))
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertIn(f"--audit {path}: ", done.stderr)


if __name__ == "__main__":
    unittest.main()
