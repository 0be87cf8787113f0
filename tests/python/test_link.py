"""The link: time-outs, strangers in a server's place, and the return after kill -9."""
import asyncio
import gc
import os
import socket
import struct
import tempfile
import threading
import time
import traceback
import unittest
import weakref
from unittest import mock

import numpy as np

import tessera
from eventually import eventually
from live import PATIENCE, Live
from tessera import _described, _wire
from tessera._channel import Channel, receive_all
from tessera._schema import schema


class Stranger:
    """Something that listens; `serve(connection)` is its manners, on a thread of its own."""

    def __init__(self, serve):
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self._serve = serve
        self._open = []
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, kind, value, trace):
        self._listener.close()
        for connection in self._open:
            connection.close()

    def _run(self):
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            self._open.append(connection)
            try:
                self._serve(connection)
            except OSError:
                pass


def say(connection, name, epoch=7, spoil=b"", **members):
    payload = _described.encode_message(schema().messages[name], members)
    connection.sendall(_wire.header_of(schema().messages[name].number, epoch, payload) + payload.joined() + spoil)


def welcome(connection, **more):
    hear(connection)
    say(connection, "Welcome", **{"epoch": 7, "heartbeat_ms": 50, "lost_after_ms": 800, "token": (1, 2), **more})


def hear(connection):
    data = memoryview(bytearray(32))
    receive_all(Channel(connection), data, time.monotonic() + PATIENCE)
    header = _wire.Header(data)
    payload = memoryview(bytearray(header.size))
    receive_all(Channel(connection), payload, time.monotonic() + PATIENCE)
    header.check(payload)
    name = schema().message_names[header.kind]
    return name, _described.decode_message(schema().messages[name], payload)


class Strangers(unittest.TestCase):
    def refused(self, serve, kind, what, **options):
        with Stranger(serve) as stranger:
            begin = time.monotonic()
            with self.assertRaisesRegex(kind, what):
                tessera.connect(stranger.address, **{"timeout": 0.3, **options})
            self.assertLess(time.monotonic() - begin, PATIENCE)

    def test_nobody_is_there(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            address = f"127.0.0.1:{taken.getsockname()[1]}"
        with self.assertRaisesRegex(tessera.NetworkError, f"no Tessera server at {address}"):
            tessera.connect(address, timeout=1)
        for wrong in ("here", "here:", "1.2.3.4:x", "1.2.3.4:99999"):
            with self.assertRaisesRegex(tessera.BadInput, "is no address"):
                tessera.connect(wrong)

    def test_who_is_silent_times_out(self):
        self.refused(lambda connection: None, tessera.Timeout, "no Tessera server at .*did not answer in time")
        self.refused(lambda connection: connection.sendall(b"TSRA"), tessera.Timeout, "in time")

    def test_another_protocol(self):
        web = b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n"
        self.refused(lambda connection: connection.sendall(web), tessera.NetworkError,
                     "not a Tessera server: it began a message with .*HTTP")
        for version, size, what in ((9, 0, "version 9"),
                                    (1, 0xFFFFFFFF, "announced a message of type 11 with 4294967295 bytes")):
            header = struct.pack("<4sHHIIQQ", b"TSRA", version, 11, size, 0, 0, 0)
            self.refused(lambda connection: connection.sendall(header), tessera.NetworkError, what)
        self.refused(lambda connection: connection.close(), tessera.NetworkError, "closed the connection|reset")

    def test_a_refusal_is_told_in_its_words(self):
        def refuse(connection):
            hear(connection)
            say(connection, "Refused", code=3, reason="already 64 applications are connected")
        self.refused(refuse, tessera.Refused, "already 64 applications")

    def test_damage_ends_the_link(self):
        def damaged(connection):
            hear(connection)
            payload = _described.encode_message(schema().messages["Welcome"], {"epoch": 7})
            data = bytearray(_wire.header_of(11, 7, payload) + payload.joined())
            data[-1] ^= 1
            connection.sendall(data)
        self.refused(damaged, tessera.NetworkError, "checksum is wrong")

    def test_what_a_server_said_last_is_told_where_it_takes_nothing_more(self):
        for message in ("Request", "Heartbeat"):
            said, broken = threading.Event(), threading.Event()

            def last_words(connection, said=said):
                welcome(connection)
                hear(connection)
                say(connection, "Refused", code=3, reason="your token has ended")
                connection.close()
                said.set()

            with (Stranger(last_words) as stranger,
                  tessera.connect(stranger.address, timeout=PATIENCE, redial=0) as wall):
                link = wall._link
                read, send = link._channel.some, link._send

                def some(into, read=read, broken=broken):
                    return read(into) if broken.is_set() else None  # it lies unread

                def sent(channel, name, *rest, send=send, message=message, said=said, broken=broken):
                    if name != message or not said.is_set():
                        return send(channel, name, *rest)
                    broken.set()
                    raise BrokenPipeError("a test")

                with mock.patch.object(link._channel, "some", some), mock.patch.object(link, "_send", sent):
                    link.say("Heartbeat", {})
                    self.assertTrue(said.wait(PATIENCE))
                    with self.assertRaisesRegex(tessera.NetworkError, "ended: your token has ended"):
                        wall.status()

    def test_an_answer_that_does_not_come(self):
        with Stranger(welcome) as stranger, tessera.connect(stranger.address, timeout=0.2) as wall:
            with self.assertRaisesRegex(tessera.Timeout, "did not answer within 0.2 s"):
                wall.status()
            with self.assertRaisesRegex(tessera.Timeout, "within 0.1 s"):
                wall.ask("GetStatus", timeout=0.1)
            self.assertTrue(wall.connected)

    def test_a_server_that_does_not_read_costs_no_more_than_the_time_out(self):
        with Stranger(welcome) as stranger, tessera.connect(stranger.address, timeout=0.5, redial=0) as wall:
            begin = time.monotonic()
            with self.assertRaises(tessera.NetworkError):
                edit = wall.edit()
                edit.object("Geometry", positions=np.zeros((8_000_000, 3), np.float32))
                edit.commit()
            self.assertLess(time.monotonic() - begin, PATIENCE)

    def test_an_answer_of_another_kind(self):
        def rubbish(connection):
            welcome(connection)
            while True:
                name, said = hear(connection)
                if name == "Request":
                    say(connection, "Reply", id=said["id"], body=b"\x00" * 5)
        with Stranger(rubbish) as stranger, tessera.connect(stranger.address, timeout=PATIENCE) as wall:
            with self.assertRaises(tessera.TesseraError):
                wall.status()

    def test_no_address(self):
        with (tempfile.TemporaryDirectory() as empty,
              mock.patch.dict(os.environ, {"TESSERA_SERVER": "", "XDG_RUNTIME_DIR": empty})):
            with self.assertRaisesRegex(tessera.NotFound, "TESSERA_SERVER"):
                tessera.connect()


class Return(unittest.TestCase):
    def test_what_was_granted_is_there_after_kill_9_and_so_are_subscriptions(self):
        with Live(surface="none", journal=True) as live:
            with (live.connect(redial=PATIENCE) as wall, wall.frames(timeout=PATIENCE) as frames,
                  wall.follow("changes", timeout=PATIENCE) as changes):
                node = wall.create("/kept")
                node.translation = (1, 2, 3)
                next(changes)
                live.kill_server()
                answers = []
                self.assertTrue(eventually(lambda: not wall.connected))
                waiting = threading.Thread(target=lambda: answers.append(wall.status()))  # it waits for the return
                waiting.start()
                live.start_server()
                waiting.join(PATIENCE)
                self.assertEqual(len(answers), 1)
                self.assertEqual(node.translation, (1.0, 2.0, 3.0))
                node.translation = (4, 5, 6)
                self.assertEqual((wall["/kept"].translation, wall["/kept"].id), ((4.0, 5.0, 6.0), node.id))
                self.assertTrue(wall.connected)
                last = wall.status().sequence
                while next(changes).sequence < last:
                    continue
                self.assertGreater(frames.latest(PATIENCE).frame, 0)
                self.assertEqual((frames.gaps, changes.gaps), (1, 1))
                frames._told.clear()
                self.assertGreater(next(frames).frame, 0)

    def test_without_a_journal_handles_are_looked_up_again(self):
        with Live(surface="none") as live, live.connect(redial=PATIENCE) as wall:
            node = wall["/row"]
            live.kill_server()
            self.assertTrue(eventually(lambda: not wall.connected))
            live.start_server()
            with self.assertRaisesRegex(tessera.NotFound, "before the connection broke"):
                node.translation = (1, 2, 3)
            wall["/row"].translation = (1, 2, 3)

    def test_what_was_looked_at_just_before_the_connection_broke_is_looked_at_again(self):
        """The number means something else at a server that began anew: it is never sent there, whoever looked at it
        before."""
        with Live(surface="none") as live, live.connect(redial=PATIENCE) as wall:
            row, several = wall["/row"], wall.nodes(["/row"])
            edit = wall.edit()
            edit.set(row, translation=(9, 9, 9))
            live.kill_server()
            self.assertTrue(eventually(lambda: not wall.connected))
            live.start_server()
            wall.status()
            before = wall["/row"].translation
            with mock.patch.object(wall._link, "settled", return_value=0):  # as the handle saw it, a moment ago
                for deed in (lambda: row.set(translation=(9, 9, 9)), lambda: several.set(translation=[(9, 9, 9)]),
                             edit.commit, row.remove,
                             lambda: row.move((9, 9, 9)), row.clone, lambda: row.translation, lambda: row.children,
                             lambda: wall.find("*", below=row)):
                    with self.assertRaisesRegex(tessera.NotFound, "before the connection broke"):
                        deed()
            with mock.patch.object(tessera.Object, "_number", lambda handle: handle._id):
                with self.assertRaisesRegex(tessera.NotFound, "before the connection broke"):
                    wall["/carriage"].set(core=row.core)
            self.assertEqual(wall["/row"].translation, before)

    def test_a_handle_of_an_answer_that_came_before_the_break_is_of_that_time(self):
        with Live(surface="none") as live, live.connect(redial=PATIENCE) as wall:
            really = wall._told

            def told(reply):  # the connection breaks between the answer and the handle that is made of it
                if reply["generation"] == 0:
                    live.kill_server()
                    live.start_server()
                    self.assertTrue(eventually(lambda: wall._link.generation))
                return really(reply)
            with mock.patch.object(wall, "_told", told):
                row = wall["/row"]
            with self.assertRaisesRegex(tessera.NotFound, "before the connection broke"):
                row.translation = (9, 9, 9)

    def test_a_channel_for_arrays_that_was_closed_is_opened_again(self):
        with Live(surface="none") as live, live.connect() as wall:
            node = wall.create("/kept", "Geometry", positions=np.eye(3, dtype=np.float32))
            self.assertTrue(np.array_equal(node.positions, np.eye(3)))
            wall._fetcher._channel.abort()
            self.assertTrue(np.array_equal(node.positions, np.eye(3)))

    def test_nobody_comes_back(self):
        with Live() as live, live.connect(redial=0.3) as wall:
            frames = wall.frames(timeout=PATIENCE)
            live.kill_server()
            with self.assertRaisesRegex(tessera.NetworkError, "nobody has answered|ended"):
                next(frames)
            with self.assertRaisesRegex(tessera.NetworkError, "nobody has answered|ended"):
                wall.status()

    def test_a_server_that_ends_says_so(self):
        with Live(surface="none") as live, live.connect() as wall:
            frames = wall.frames(timeout=PATIENCE)
            next(frames)
            live.server.terminate()
            live.server.wait(PATIENCE)
            for _ in frames:
                pass
            self.assertTrue(wall.over)
            depths = []
            for _ in range(3):
                with self.assertRaisesRegex(tessera.NetworkError, "is over") as ended:
                    wall.status()
                depths.append(len(traceback.extract_tb(ended.exception.__traceback__)))
            self.assertEqual(depths[0], depths[2])


class Dropped(unittest.TestCase):
    def test_a_wall_that_nothing_holds_is_closed(self):
        with Live(surface="none") as live:
            def threads():
                return [each for each in threading.enumerate() if each.name.startswith("tessera ")]
            before, files = len(threads()), len(os.listdir("/proc/self/fd"))
            for _ in range(5):
                wall = live.connect()
                frames = wall.frames()
                wall.show(np.eye(3), "/shown")
                self.assertEqual(len(threads()), before + 1)
                del wall
                gc.collect()
                next(frames)  # an iterator holds its wall
                frames.close()
                del frames
                gc.collect()
                self.assertEqual(len(threads()), before)
            self.assertEqual(len(os.listdir("/proc/self/fd")), files)

    def test_a_wall_that_has_shown_something_goes_without_the_collector(self):
        with Live(surface="none") as live:
            gc.collect()
            gc.disable()
            try:
                wall = live.connect()
                wall.show(np.eye(3), "/shown")
                wall.show(np.eye(3), "/shown")
                with wall.edit():
                    wall.show(np.eye(3), "/other")
                gone = weakref.ref(wall)
                del wall
                # The thread that reads may hold it for a moment
                self.assertTrue(eventually(lambda: gone() is None))
            finally:
                gc.enable()

    def test_an_iterator_that_nothing_holds_ends_and_lets_go_of_its_wall(self):
        with Live(surface="none") as live:
            def threads():
                return [each for each in threading.enumerate() if each.name.startswith("tessera ")]

            def ended():
                gc.collect()
                return len(threads()) <= before
            before, files = len(threads()), len(os.listdir("/proc/self/fd"))
            for what in ("frames", "contacts", "changes"):
                wall = live.connect()
                kept = wall.frames()
                iterator = wall.follow(what)
                next(kept)
                del iterator
                gc.collect()
                next(kept)
                self.assertTrue(wall.connected)
                self.assertEqual(len(wall._subscriptions._listening()), 1)
                del wall, kept
                eventually(ended)  # the thread that reads may have been at one of them
                self.assertEqual(len(threads()), before, what)
            self.assertEqual(len(os.listdir("/proc/self/fd")), files)

    def test_after_a_fork_the_wall_is_the_parents(self):
        with Live() as live, live.connect() as wall:
            child = os.fork()
            if child == 0:
                said = 2
                try:
                    wall.status()
                except tessera.NetworkError as error:
                    said = 0 if "forked" in str(error) else 3
                    wall.close()
                    with live.connect() as own:
                        said += 4 * (not own.root.id)
                finally:
                    os._exit(said)
            self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 0)
            wall.status()
            self.assertTrue(wall["/"].id)


class Asyncio(unittest.TestCase):
    def test_what_is_cancelled_costs_nobody_else(self):
        async def program(address):
            async with await tessera.aio.connect(address, timeout=PATIENCE) as wall:
                made = await wall.create("/async")
                for _ in range(20):
                    asked = [asyncio.create_task(wall.ask("GetStatus")) for _ in range(4)]
                    await asyncio.sleep(0)  # no pause: each task begins, and has asked
                    for one in asked[:2]:
                        one.cancel()
                    told = await asyncio.gather(*asked, return_exceptions=True)
                    self.assertEqual([each.wall_name for each in told[2:]], ["1x1", "1x1"])
                await wall.set(made, translation=(1, 2, 3))  # its number holds: nothing was dialled again
        with Live(surface="none") as live:
            asyncio.run(program(live.address))

    def test_the_same_is_awaited(self):
        async def program(address):
            async with await tessera.aio.connect(address, timeout=PATIENCE) as wall:
                self.assertEqual((await wall.status()).wall_name, "1x1")
                made = await wall.create("/async", translation=(1, 0, 0))
                await asyncio.gather(*(wall.set(made, translation=(at, 0, 0)) for at in range(4)))
                await wall.set("/async", translation=(5, 0, 0))
                self.assertEqual(await wall.get("/async", "translation"), (5.0, 0.0, 0.0))
                seen = 0
                async for frame in wall.follow("frames", timeout=PATIENCE):
                    seen += frame.shown == ["all"]
                    if seen == 2:
                        break
                with self.assertRaises(tessera.NotFound):
                    await wall.node("/nowhere")
                await wall.undo()
                return seen
        with Live(surface="none") as live:
            self.assertEqual(asyncio.run(program(live.address)), 2)


if __name__ == "__main__":
    unittest.main()
