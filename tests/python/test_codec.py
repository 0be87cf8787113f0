"""Bytes of messages, requests and answers: those that unit_codec keeps are read, and written again, by their
descriptions alone."""
import pathlib
import unittest

import numpy as np

import tessera
from tessera import _changes, _described, _hash, _wire
from tessera._schema import schema
from tessera.errors import BadInput, UnknownField

ROOT = pathlib.Path(__file__).resolve().parents[2]


def kept_bytes():
    """(kind, name, bytes) of each line of tests/data/messages/bytes.txt."""
    for line in (ROOT / "tests/data/messages/bytes.txt").read_text().splitlines():
        words = line.split()
        if len(words) == 3 and not line.startswith("#") and words[0] != "protocol":
            yield words[0], words[1], memoryview(bytes.fromhex(words[2]))


def plain(value):
    return {name: plain(value[name]) for name in value} if isinstance(value, _described.Told) else value


class KeptBytes(unittest.TestCase):
    def test_the_protocol_is_the_one_that_is_kept(self):
        text = (ROOT / "tests/data/messages/bytes.txt").read_text()
        self.assertIn(f"\nprotocol {schema().protocol}\n", text)

    def said_again(self, kind, known):
        seen = 0
        for what, name, data in kept_bytes():
            if what != kind:
                continue
            with self.subTest(name=name):
                told = _described.decode({each.number: each for each in known}, data)
                self.assertEqual(repr(told).split("(")[0], name)
                said = next(each for each in known if each.name == name)
                values = told.as_dict()
                self.assertEqual(_described.encode(said, values).joined().hex(), bytes(data).hex())
                seen += 1
        return seen

    def test_requests_are_said_as_the_library_says_them(self):
        self.assertEqual(self.said_again("request", schema().requests.values()), len(schema().requests))

    def test_answers_are_read_whole(self):
        self.assertEqual(self.said_again("answer", schema().answers.values()), len(schema().answers))

    def test_notices_are_read_whole(self):
        self.assertEqual(self.said_again("notice", schema().notices.values()), len(schema().notices))

    def test_messages_are_read(self):
        for number, name, data in kept_bytes():
            if not number.isdigit() or int(number) not in schema().message_names:
                continue
            with self.subTest(name=name):
                self.assertEqual(schema().message_names[int(number)], name)
                members = _described.decode_message(schema().messages[name], data)
                if name in ("Hello", "Request", "Heartbeat", "Upload", "BlobRequest", "Synced"):
                    self.assertEqual(_described.encode_message(schema().messages[name], members).joined().hex(),
                                     bytes(data).hex())

    def test_a_list_is_cut_off_anywhere(self):
        for kind, name, data in kept_bytes():
            if kind not in ("answer", "notice"):
                continue
            known = {each.number: each
                     for each in (schema().answers if kind == "answer" else schema().notices).values()}
            for size in range(0, len(data) - 1, 7):
                with self.assertRaises(tessera.TesseraError):
                    _described.decode(known, data[:size])


    def test_whatever_bytes_come_they_are_read_or_refused(self):
        dice = np.random.default_rng(1)
        kept = [(kind, np.frombuffer(data, np.uint8)) for kind, _, data in kept_bytes()
                if kind in ("answer", "notice", "list")]
        read = refused = 0
        for turn in range(4000):
            kind, data = kept[turn % len(kept)]
            spoiled = data.copy()
            spoiled[dice.integers(0, len(data), 1 + turn % 3)] = dice.integers(0, 256, 1 + turn % 3)
            view = memoryview(spoiled.tobytes())
            try:
                if kind == "list":
                    _changes.decode(schema(), view)
                else:
                    _described.decode(schema().answers if kind == "answer" else schema().notices, view)
                read += 1
            except tessera.TesseraError:
                refused += 1
        self.assertTrue(read > 100 and refused > 100, (read, refused))


class Heads(unittest.TestCase):
    def test_varints(self):
        for number, text in ((0, "00"), (127, "7f"), (128, "8001"), (300, "ac02"), (2**64 - 1, "ffffffffffffffffff01")):
            self.assertEqual(_wire.varint(number).hex(), text)
            self.assertEqual(_wire.take_varint(memoryview(bytes.fromhex(text)), 0)[0], number)

    def test_parts_are_not_copied(self):
        array = np.arange(100_000, dtype=np.float32)
        chain = _wire.join_parts(b"head", [b"small", _wire.view_of(array)])
        self.assertTrue(np.shares_memory(np.frombuffer(chain.pieces[-1], np.float32), array))
        head, parts = _wire.split_parts(memoryview(chain.joined()))
        self.assertEqual((bytes(head), bytes(parts[0])), (b"head", b"small"))
        self.assertTrue(np.array_equal(np.frombuffer(parts[1], np.float32), array))

    def test_a_header_tells_damage(self):
        chain = _wire.Chain(b"some", b"bytes" * 10_000)
        data = _wire.header_of(10, 7, chain)
        header = _wire.Header(data)
        self.assertEqual((header.kind, header.epoch, header.size), (10, 7, chain.size))
        header.check(chain.joined())
        with self.assertRaises(ConnectionError):
            header.check(chain.joined()[:-1] + b"x")
        with self.assertRaises(ConnectionError):
            _wire.Header(b"HTTP/1.1 400 Bad Request\r\n\r\n      ")

    def test_names_of_arrays_are_those_of_the_library(self):
        # XXH3's own of nothing; that the server takes arrays of many leaves by these names shows test_live.
        self.assertEqual(_hash.hash64(b""), 0x2D06800538D394C2)
        self.assertEqual(_hash.array_id(np.zeros(0, np.uint8), 65536)[::-1].hex(), "99aa06d3014798d86001c324468d497f")
        large = np.zeros(65537, np.uint8)
        self.assertNotEqual(_hash.array_id(large, 65536), _hash.array_id(large, 131072))


class Refusals(unittest.TestCase):
    def encode(self, name, **values):
        return _described.encode(schema().request(name), values)

    def test_an_unknown_member_is_named_with_the_nearest(self):
        with self.assertRaisesRegex(UnknownField, 'MoveNode has no member "translaton"; is it translation'):
            self.encode("MoveNode", node=1, translaton=(1, 2, 3))

    def test_an_unknown_request_is_named_with_the_nearest(self):
        with self.assertRaisesRegex(UnknownField, "GetStatus"):
            self.encode("GetStatu")

    def test_values_of_another_type(self):
        for values, what in (({"node": "five"}, "MoveNode.node: 'five' is no whole number"),
                             ({"node": -1}, "-1 is not from 0"),
                             ({"node": 1, "translation": (1, 2)}, "MoveNode.translation: 2 numbers instead of 3"),
                             ({"node": 1, "translation": "abc"}, "MoveNode.translation"),
                             ({"node": 1, "translation": (1, "2", 3)}, "'2' is no number")):
            with self.subTest(values=values), self.assertRaisesRegex(BadInput, what):
                self.encode("MoveNode", **values)
        with self.assertRaisesRegex(BadInput, "none of scene, test_picture"):
            self.encode("ShowPicture", showing="nothing")
        with self.assertRaisesRegex(BadInput, "MeasureDistance.from is missing"):
            self.encode("MeasureDistance", node=1)

    def test_each_subscription_brings_one_notice(self):
        self.assertEqual(schema().subscriptions,
                         {"contacts": "Contacts", "picks": "Picked", "frames": "Frame", "events": "PairEvents",
                          "distances": "Distances", "questions": "Questions", "poses": "Poses", "states": "States"})
        self.assertEqual(len(schema().notices), len(schema().subscriptions))


class Lists(unittest.TestCase):
    def test_the_kept_list_is_read(self):
        for kind, name, data in kept_bytes():
            if kind == "list":
                try:
                    changes = _changes.decode(schema(), data)
                except _described.Unsupported:
                    continue  # it has made-up types
                self.assertGreater(len(changes.created), 0)

    def test_a_list_comes_back(self):
        transform = schema().type("Transform")
        field = transform.field("translation")
        ids = np.array([5, 6], np.uint64)
        values = np.arange(6.0).reshape(2, 3)
        chain = _changes.encode([(9, 1)], [(9, 1, _changes.LAST)], [(transform, field, ids, _wire.view_of(values))],
                                np.zeros(0, _changes.RANGE), b"", [7])
        changes = _changes.decode(schema(), memoryview(chain.joined()), 3)
        self.assertEqual((changes.sequence, changes.created.tolist(), changes.placed.tolist(),
                          changes.destroyed.tolist()),
                         (3, [(9, 1)], [(9, 1, 0xFFFFFFFF)], [7]))
        self.assertEqual(changes.columns[0].field.where, "Transform.translation")
        self.assertTrue(np.array_equal(changes.columns[0].values, values))


if __name__ == "__main__":
    unittest.main()
