"""The recorded session (tests/data/wire/session.txt): each message is whole and is what its line says; and before a
server that plays it this package says the same bytes and understands what it is told."""
import pathlib
import socket
import tempfile
import threading
import unittest

import numpy as np

import record
import tessera
from live import PATIENCE, Live, run_folder
from test_link import Stranger, hear
from tessera import _described, _wire
from tessera._schema import schema


EARLIER = [record.FILE.with_name(f"session-{protocol}.txt") for protocol in (17, 18)]  # that the server still takes


def recorded(file=record.FILE):
    """(connection, way, name, header and payload) of each line."""
    for line in file.read_text().splitlines():
        if line[:1].isdigit():
            way, name, data = line.split()
            yield int(way[0]), way[1], name, bytes.fromhex(data)


class Recorded(unittest.TestCase):
    def test_it_is_of_this_protocol(self):
        self.assertIn(f"\nprotocol {schema().protocol}\n", record.FILE.read_text(),
                      "tests/python/record.py writes it anew")

    def test_each_message_is_whole_and_what_it_says(self):
        seen = set()
        for connection, way, name, data in recorded():
            header = _wire.Header(data)
            header.check(data[_wire.HEADER_BYTES:])
            self.assertEqual((schema().message_names[header.kind], header.size), (name, len(data) - _wire.HEADER_BYTES))
            said = schema().messages[name]
            members = _described.decode_message(said, memoryview(data)[_wire.HEADER_BYTES:])
            if way == ">":
                again = _described.encode_message(said, members)
                self.assertEqual((_wire.header_of(header.kind, header.epoch, again) + again.joined()).hex(), data.hex())
            if name == "Request":
                body = _described.decode({each.number: each for each in schema().requests.values()}, members["body"])
                seen.add(body._said)
            elif name == "Reply" and not members["error"]:
                _described.decode(schema().answers, members["body"])
            elif name == "Notice":
                _described.decode(schema().notices, members["body"])
            seen.add(name)
        self.assertGreaterEqual(seen,
                                {"Hello", "Welcome", "Heartbeat", "Request", "Reply", "Notice", "BlobRequest",
                                 "BlobChunk", "GetStatus", "GetObjects",
                                 "ProposeChanges", "RemoveNode", "SubscribeNews", "UndoStep"})

    def test_a_server_that_plays_it_is_understood_and_told_the_same(self):
        lines = list(recorded())
        faults, threads, number = [], [], iter((1, 2))
        turn = threading.Condition()
        at = [0]  # the line that is next

        def play(connection, mine):
            """Says its lines when their turn comes, and hears those of the other side."""
            try:
                while True:
                    with turn:
                        turn.wait_for(lambda: at[0] >= len(lines) or lines[at[0]][0] == mine, PATIENCE)
                        if at[0] >= len(lines):
                            return
                        _, way, name, data = lines[at[0]]
                        if name == "Heartbeat" and way == ">":
                            at[0] += 1
                            turn.notify_all()
                            continue
                    if way == "<":
                        connection.sendall(data)
                    else:
                        said, members = hear(connection)
                        while said == "Heartbeat":
                            said, members = hear(connection)
                        self.compare(name, data, said, members, faults)
                    with turn:
                        at[0] += 1
                        turn.notify_all()
            except (OSError, tessera.TesseraError) as error:
                faults.append(f"line {at[0]}: {error!r}")

        def serve(connection):
            thread = threading.Thread(target=play, args=(connection, next(number)), daemon=True)
            threads.append(thread)
            thread.start()

        word = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())) / "token"
        word.write_text(record.TOKEN)
        with (Stranger(serve) as stranger,
              tessera.connect(stranger.address, token_file=str(word), name="recorded", timeout=PATIENCE) as wall):
            status, place, refused, positions, frame = record.steps(wall, lambda text: None)
            for thread in threads:
                thread.join(PATIENCE)
        self.assertEqual(faults, [])
        self.assertEqual((status.wall_name, place, frame.shown), ("1x1", (1.0, 2.0, 3.0), ["all"]))
        self.assertTrue(np.array_equal(positions, np.eye(3)))
        self.assertIn("root", refused)

    def test_a_server_of_today_takes_an_application_of_then(self):
        """The promise of proto/README.md. That types and fields are others now does not keep it out."""
        for file in (record.FILE, *EARLIER):
            with self.subTest(file.name):
                self.takes(file)

    def takes(self, file):
        self.enterContext(run_folder())
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        (folder / "token").write_text(record.TOKEN)
        (folder / "thing.tsct").write_text(record.SCENE)
        asked = []
        with Live(scene=folder / "thing.tsct", surface="none", size="64x36",
                  options=["--token-file", str(folder / "token")]) as live:
            host, port = live.address.rsplit(":", 1)
            with socket.create_connection((host, int(port)), PATIENCE) as connection:
                epoch = 0
                for number, way, name, data in recorded(file):
                    if number != 1 or way != ">" or name not in ("Hello", "Request"):
                        continue
                    payload = data[_wire.HEADER_BYTES:]
                    if name == "Hello":
                        greeting = _described.decode_message(schema().messages["Hello"], memoryview(payload))
                        greeting["schema"] ^= 1
                        payload = _described.encode_message(schema().messages["Hello"], greeting).joined()
                    connection.sendall(_wire.header_of(_wire.Header(data).kind, epoch, _wire.Chain(payload)) + payload)
                    said, members = hear(connection)
                    while said not in ("Welcome", "Refused", "Reply"):
                        said, members = hear(connection)
                    if name == "Hello":
                        self.assertEqual(said, "Welcome", members)
                        epoch = members["epoch"]
                        continue
                    request = _described.decode_message(schema().messages["Request"], memoryview(payload))
                    self.assertEqual((said, members["id"]), ("Reply", request["id"]))
                    asked.append((request["id"], members["error"]))
        self.assertEqual([error for _, error in asked if error and "root" not in error], [])
        self.assertGreater(len(asked), 8)

    def compare(self, name, data, said, members, faults):
        wanted = _described.decode_message(schema().messages[name], memoryview(data)[_wire.HEADER_BYTES:])
        if name == "Hello":
            members["schema"] = wanted["schema"]  # that of the types of another day
        if said != name or members != wanted:
            faults.append(f"{said} {members} instead of {name} {wanted}")


if __name__ == "__main__":
    unittest.main()
