"""Who is let in: a user's own programs by themselves, others by a token, in the role that it stands for."""
import asyncio
import os
import pathlib
import time
import unittest
from unittest import mock

import tessera
from live import PATIENCE, Live, run_folder
from test_link import Stranger, hear, say
from tessera import _door

FAR = 60  # s; a link that is dialled again would take so long


class Access(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(run_folder())

    def test_another_user_s_program_is_refused_in_words_and_at_once(self):
        with Live() as live:
            with run_folder():
                begin = time.monotonic()
                with self.assertRaisesRegex(tessera.Refused,
                                            r"takes programs of its own user \(.+\) alone.*--token-file") as refused:
                    tessera.connect(live.address, timeout=PATIENCE, redial=FAR)
                self.assertLess(time.monotonic() - begin, FAR / 2)
                self.assertNotIsInstance(refused.exception, tessera.NetworkError)
                with self.assertRaises(tessera.Refused):
                    asyncio.run(tessera.aio.connect(live.address, timeout=PATIENCE))
            with live.connect() as wall:
                self.assertEqual(wall.status().applications, 1)

    def test_a_token_lets_in_from_a_file_that_is_named(self):
        with Live() as live:
            place, = self.folder.glob("tessera/*.wall")
            word = pathlib.Path(live.token_file())
            for file in (word, place):  # a word alone, and what the server has left for its own user
                with run_folder(), live.connect(token_file=str(file)) as wall:
                    self.assertEqual(wall.whoami().role, "operator")
                with (run_folder(), mock.patch.dict(os.environ, {"TESSERA_TOKEN_FILE": str(file)}),
                      live.connect() as wall):
                    self.assertEqual(wall.whoami().role, "operator")

            async def program():
                async with await tessera.aio.connect(live.address, token_file=str(word), timeout=PATIENCE,
                                                     name="awaited") as wall:
                    return await wall.whoami()
            with run_folder():
                self.assertEqual(asyncio.run(program()).as_dict(), {"name": "awaited", "role": "operator"})
            word.write_text("a-token-of-nobody-at-all\n")
            with self.assertRaisesRegex(tessera.Refused, "the token is not this server's"):
                live.connect(token_file=str(word))

    def test_a_file_without_a_token_is_named(self):
        with Live() as live:
            empty = live.folder / "empty"
            for text in ("", "short\n", "not a token but words\n", "\nthe-token-in-the-second-line\n"):
                empty.write_text(text)
                with self.assertRaisesRegex(tessera.BadInput, f"{empty}: its first line is no token"):
                    live.connect(token_file=str(empty))
            for missing in (live.folder / "missing", live.folder):
                with self.assertRaisesRegex(tessera.BadInput, f"the file with a token {missing}: [A-Z]"):
                    live.connect(token_file=str(missing))

    def test_a_viewer_looks_and_does_not_touch(self):
        with Live(surface="none") as live, live.connect(token_file=live.token_file("viewer")) as wall:
            self.assertEqual(wall.whoami().role, "viewer")
            row = wall["/row"]
            before = row.translation
            with wall.frames(timeout=PATIENCE) as frames:
                self.assertGreater(next(frames).frame, 0)
            for deed in (lambda: setattr(row, "translation", (9, 9, 9)), lambda: row.move((9, 9, 9)), row.remove,
                         wall.undo, lambda: wall.create("/mine")):
                with self.assertRaisesRegex(tessera.Refused, "is for an editor; this link is of a viewer"):
                    deed()
            self.assertEqual(row.translation, before)
            with live.connect(token_file=live.token_file("editor")) as editor:
                self.assertEqual(editor.whoami().role, "editor")
                editor["/row"].translation = (1, 2, 3)
            self.assertEqual(row.translation, (1.0, 2.0, 3.0))

    def test_the_token_is_looked_up_each_time_that_a_server_is_dialled(self):
        with Live(journal=True) as live, live.connect(redial=PATIENCE) as wall:
            before = live.token()
            live.kill_server()
            place, = self.folder.glob("tessera/*.wall")
            place.unlink()
            live.start_server()
            self.assertNotEqual(live.token(), before)
            self.assertEqual(wall.whoami().role, "operator")

    def test_who_is_refused_after_a_break_is_told_and_does_not_dial_again(self):
        with (Live(journal=True) as live, live.connect(token_file=live.token_file(), redial=FAR) as wall,
              wall.frames(timeout=FAR) as frames):
            live.kill_server()
            next(self.folder.glob("tessera/*.wall")).unlink()
            live.start_server()
            begin = time.monotonic()
            for asked in (lambda: next(frames), wall.status):
                with self.assertRaisesRegex(tessera.Refused, "broke|ended.*the token is not this server's"):
                    asked()
            self.assertLess(time.monotonic() - begin, FAR / 2)

    def test_a_token_of_this_machine_goes_to_its_server_alone(self):
        heard = []

        def curious(connection):
            heard.append(hear(connection)[1]["access"])
            say(connection, "Refused", code=3, reason="thank you")
        with Live() as live, Stranger(curious) as stranger:
            port = int(live.address.rpartition(":")[2])
            self.assertEqual(_door.access_to("127.0.0.1", port, near=True), live.token())
            self.assertEqual(_door.access_to("::ffff:127.0.0.1", port, near=True), live.token())
            self.assertEqual(_door.access_to("127.0.0.9", port, near=True), "")  # somebody else may listen there
            # Another machine's port of that number
            self.assertEqual(_door.access_to("203.0.113.9", port, near=False), "")
            with self.assertRaises(tessera.Refused):
                tessera.connect(stranger.address, timeout=PATIENCE)
            self.assertEqual(heard, [""])

    def test_a_group_may_read_what_a_server_tells_and_others_may_not(self):
        with Live() as live:
            place, = self.folder.glob("tessera/*.wall")
            for folder, file, counts in ((0o700, 0o600, True), (0o710, 0o640, True), (0o711, 0o640, True),
                                         (0o710, 0o644, False), (0o710, 0o660, False),
                                         (0o755, 0o640, False), (0o770, 0o640, False)):
                place.parent.chmod(folder)
                place.chmod(file)
                with self.subTest(folder=oct(folder), file=oct(file)):
                    self.assertEqual([wall.address for wall in _door.local_walls()], [live.address] if counts else [])
            place.parent.chmod(0o700)


if __name__ == "__main__":
    unittest.main()
