"""TLS 1.3: by a console's https link, and by a person's key at the server's own port."""
import asyncio
import contextlib
import importlib.util
import os
import pathlib
import shutil
import ssl
import subprocess
import tempfile
import threading
import unittest
import urllib.error
import urllib.parse
import urllib.request

import numpy as np

import tessera
from console_socket import WebSocket, array_name
from eventually import eventually
from live import BIN, PATIENCE, Live, figure, run_folder
from test_link import Stranger

WORD = "the-token-of-a-page-s-link"
HAS_WEBSOCKET = importlib.util.find_spec("websocket") is not None


class SealedWall(Live):
    def __enter__(self):
        self.make_keys("anna:viewer", "bob:operator", "eve:editor")
        return super().__enter__()


def contexts(live):
    """Of a browser that trusts the authority, without a key and with bob's."""
    plain = ssl.create_default_context(cafile=str(live.keys / "authority.crt"))
    known = ssl.create_default_context(cafile=str(live.keys / "authority.crt"))
    known.load_cert_chain(os.path.join(live.key_of("bob"), "person-bob.pem"))
    return plain, known


def refusal(url, context):
    """Asks for a page; returns the code and the words with which it is refused, or None where it comes."""
    try:
        urllib.request.urlopen(url, timeout=PATIENCE, context=context).close()
    except urllib.error.HTTPError as refused:
        with refused:
            return refused.code, refused.read().decode()
    return None


def is_held(connection):
    """Tells whether a process still has the other end of a connection on loopback."""
    try:
        ends = [f"{port:04X}" for _, port in (connection.getpeername(), connection.getsockname())]
    except OSError:
        return False  # it was reset
    for line in pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:]:
        words = line.split()
        if [address.partition(":")[2] for address in words[1:3]] == ends:
            return words[9] != "0"  # its inode
    return False


@contextlib.contextmanager
def somebody_sealed(holder, wall="1x1", serve=lambda connection: None):
    """Something that listens with a key of its own wall: ("server",) or ("person", "eve"). Yields its address, and the
    SHA-256 of its authority."""
    with tempfile.TemporaryDirectory() as folder:
        keys = pathlib.Path(folder) / "keys"

        def say(*arguments):
            subprocess.run([str(BIN / "tessera-keys"), "--keys", str(keys), *arguments], check=True,
                           capture_output=True, timeout=PATIENCE)
        say("init", "--wall", wall)
        if holder[0] == "person":
            say("person", holder[1], "--role", "operator")
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(keys / ("-".join(holder) + ".pem"))

        def shake(connection):
            try:
                with context.wrap_socket(connection, server_side=True) as sealed:
                    serve(sealed, (keys / "authority.crt").read_bytes())
            except (OSError, ssl.SSLError):
                pass
        with Stranger(lambda connection: threading.Thread(target=shake, args=(connection,),
                                                          daemon=True).start()) as stranger:
            yield stranger.address, tessera._sealed.fingerprint((keys / "authority.crt").read_text())


class Keys(unittest.TestCase):
    """At the server's own port."""

    def setUp(self):
        self.enterContext(run_folder())

    def connect(self, live, name, **options):
        with run_folder():
            return tessera.connect(live.address, keys=live.key_of(name), **{"timeout": PATIENCE, **options})

    def test_a_person_s_key_lets_in_as_what_it_says(self):
        async def awaited(address, keys):
            async with await tessera.aio.connect(address, keys=keys, timeout=PATIENCE) as wall:
                return (await wall.whoami()).role
        with SealedWall(surface="none") as live:
            with self.connect(live, "anna") as wall:
                self.assertEqual(wall.whoami().role, "viewer")
                with self.assertRaisesRegex(tessera.Refused, "is for an editor; this link is of a viewer"):
                    wall["/row"].translation = (1, 2, 3)
            with self.connect(live, "eve") as wall:
                wall["/row"].translation = (1, 2, 3)
            file = pathlib.Path(live.key_of("bob")) / "person-bob.pem"
            with run_folder(), tessera.connect(live.address, keys=file, timeout=PATIENCE) as wall:
                self.assertEqual(wall.whoami().role, "operator")
                self.assertEqual(wall["/row"].translation, (1.0, 2.0, 3.0))
            with run_folder():
                self.assertEqual(asyncio.run(awaited(live.address, str(file))), "operator")

    def test_arrays_go_both_ways(self):
        points = np.random.default_rng(3).random((1_400_000, 3), np.float32)
        with SealedWall(surface="none") as live, self.connect(live, "bob") as wall, live.connect() as watcher:
            node = wall.create("/large", "Geometry", primitive="points", positions=points)
            self.assertTrue(np.array_equal(watcher["/large"].positions, points))
            self.assertTrue(np.array_equal(node.positions, points))
            with wall.frames(timeout=PATIENCE) as frames:
                self.assertGreater(next(frames).frame, 0)

    def test_whose_key_is_revoked_goes_and_is_told(self):
        with (SealedWall(surface="none") as live, self.connect(live, "bob", redial=PATIENCE) as wall,
              self.connect(live, "anna") as other):
            live.keys_say("revoke", "bob")
            self.assertTrue(eventually(lambda: not wall.connected))
            with self.assertRaisesRegex(tessera.NetworkError, "has been revoked"):
                while True:
                    wall.status()
            with self.assertRaisesRegex(tessera.NetworkError, "has been revoked"):
                self.connect(live, "bob")
            self.assertEqual(other.whoami().role, "viewer")

    def test_a_renewed_key_counts_at_the_next_dial(self):
        with SealedWall(surface="none", journal=True) as live, self.connect(live, "bob", redial=PATIENCE) as wall:
            live.keys_say("renew", "bob", "--out", live.key_of("bob"))
            live.kill_server()
            self.assertTrue(eventually(lambda: not wall.connected))
            live.start_server()
            self.assertEqual(wall.whoami().role, "operator")

    def test_who_is_not_the_wall_s_server_is_not_spoken_to(self):
        heard = []
        with SealedWall() as live:
            with somebody_sealed(("server",), serve=lambda sealed, pem: heard.append(sealed.recv(1))) as (address, _):
                with self.assertRaisesRegex(tessera.NetworkError, "no way in.*certificate is not believed"):
                    tessera.connect(address, keys=live.key_of("bob"), timeout=PATIENCE)
            with (Stranger(lambda connection: connection.close()) as stranger,
                  self.assertRaisesRegex(tessera.NetworkError, "no Tessera server at")):
                tessera.connect(stranger.address, keys=live.key_of("bob"), timeout=PATIENCE)
            with Stranger(lambda connection: connection.sendall(b"hello" * 100)) as stranger:
                with self.assertRaisesRegex(tessera.NetworkError, "does not speak TLS 1.3"):
                    tessera.connect(stranger.address, keys=live.key_of("bob"), timeout=PATIENCE)
            with (Stranger(lambda connection: None) as stranger,
                  self.assertRaisesRegex(tessera.Timeout, "did not answer in time")):
                tessera.connect(stranger.address, keys=live.key_of("bob"), timeout=0.3)
            # Somebody of the same wall is no server of it.
            mixed = pathlib.Path(tempfile.mkdtemp(dir=live.folder))
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            shutil.copy(os.path.join(live.key_of("eve"), "person-eve.pem"), mixed)
            context.load_cert_chain(mixed / "person-eve.pem")

            def serve(connection):
                with contextlib.suppress(OSError), context.wrap_socket(connection, server_side=True) as sealed:
                    heard.append(sealed.recv(1))
            with Stranger(serve) as stranger, self.assertRaisesRegex(tessera.NetworkError, "no way in.*"):
                tessera.connect(stranger.address, keys=live.key_of("bob"), timeout=PATIENCE)
        self.assertEqual([data for data in heard if data], [])

    def test_a_server_without_keys_says_so(self):
        with SealedWall() as live, Live() as plain, self.assertRaisesRegex(tessera.NetworkError, "has the server keys"):
            tessera.connect(plain.address, keys=live.key_of("bob"), timeout=PATIENCE)

    def test_keys_that_are_none_say_what_is_wrong(self):
        with SealedWall() as live:
            folder = pathlib.Path(tempfile.mkdtemp(dir=live.folder))
            # Noqa: E731
            connect = lambda keys, **more: tessera.connect(live.address, keys=str(keys), timeout=PATIENCE, **more)
            with self.assertRaisesRegex(tessera.NotFound, "no key of a person is there: tessera-keys person"):
                connect(folder)
            with self.assertRaisesRegex(tessera.NotFound, "missing: No such file"):
                connect(folder / "missing")
            bob = folder / "person-bob.pem"
            shutil.copy(os.path.join(live.key_of("bob"), "person-bob.pem"), bob)
            with self.assertRaisesRegex(tessera.NotFound, "authority.crt: No such file"):
                connect(folder)
            shutil.copy(live.keys / "authority.crt", folder)
            with connect(folder) as wall:
                self.assertEqual(wall.whoami().role, "operator")
            bob.chmod(0o644)
            with self.assertRaisesRegex(tessera.Refused, "others may read this key.*chmod 600"):
                connect(folder)
            bob.chmod(0o600)
            shutil.copy(os.path.join(live.key_of("eve"), "person-eve.pem"), folder)
            with self.assertRaisesRegex(tessera.BadInput,
                                        r"several people are there \(person-bob.pem, person-eve.pem\)"):
                connect(folder)
            bob.write_text("no key\n")
            with self.assertRaisesRegex(tessera.BadInput, "person-bob.pem: holds no key"):
                connect(bob)
            with self.assertRaisesRegex(tessera.BadInput, "a key says who comes in"):
                connect(folder, token_file="word")
            with self.assertRaisesRegex(tessera.BadInput, "a link has its token in it"):
                tessera.connect(f"http://127.0.0.1:7001/?token={WORD}", keys=str(folder))


class Console(unittest.TestCase):
    """What a browser does."""

    def setUp(self):
        self.enterContext(run_folder())

    def test_browsers_come_in_with_a_key_or_a_token(self):
        with SealedWall() as live:
            link = live.sealed_link()
            url = urllib.parse.urlsplit(link)
            plain, known = contexts(live)
            page = urllib.request.urlopen(link, timeout=PATIENCE, context=plain)
            self.assertIn("/page/main.js", page.read().decode())
            with self.assertRaises(urllib.error.HTTPError) as refused:
                urllib.request.urlopen(f"https://{url.netloc}/metrics", timeout=PATIENCE, context=plain)
            self.assertEqual(refused.exception.code, 401)
            refused.exception.close()
            figures = f"https://{url.netloc}/metrics"
            self.assertEqual(urllib.request.urlopen(figures, timeout=PATIENCE, context=known).status, 200)
            live.keys_say("revoke", "bob")
            code, words = eventually(lambda: refusal(figures, known)) or (200, "")
            self.assertEqual(code, 403)
            self.assertIn("has been revoked", words)

    def test_a_socket_holds_its_bounds_and_goes_with_its_key(self):
        piece, pieces = 256 << 10, 400
        points = np.random.default_rng(3).random((170_000, 3), np.float32)
        raw = points.reshape(-1).view(np.uint8)
        with SealedWall(surface="none") as live, live.connect() as wall:
            wall.show(points, "/points", radius=0.1)
            url = urllib.parse.urlsplit(live.sealed_link())
            token = urllib.parse.parse_qs(url.query)["token"][0]
            plain, known = contexts(live)
            with (WebSocket(url.netloc, token, context=plain) as one,
                  WebSocket(url.netloc, "none-is-needed-here", context=known) as other):
                one.ask(0, "WhoAmI")
                self.assertEqual(one.read()["fields"]["role"], "operator")
                memory, array = figure(live.server, "VmRSS"), array_name(raw)
                offsets = [at * piece % (raw.nbytes - piece) for at in range(pieces)]
                asked = b"".join(WebSocket.question(at, "GetArray", blob=array, offset=offset, length=piece)
                                 for at, offset in enumerate(offsets))
                one.socket.sendall(asked)  # it does not read yet: 100 MB would have to wait for it
                other.socket.sendall(asked)
                for _ in range(2 * pieces):  # all comes to one that asked later
                    other.read()
                self.assertLess(figure(live.server, "VmRSS") - memory, 60_000, "kB held for one that does not read")
                left = dict(enumerate(offsets))
                while left:
                    begin = left.pop(one.read()["id"])
                    self.assertEqual(one.read(), raw[begin:begin + piece].tobytes())
                one.send_binary(bytes(20 << 20))
                with self.assertRaisesRegex(ConnectionError, "that no text has announced"):
                    one.read()
                other.ask(1, "WhoAmI")
                self.assertEqual(other.read()["fields"]["role"], "operator")
                other.socket.sendall(asked)  # what waits for it does not keep it
                with WebSocket(url.netloc, token, context=plain) as third:  # which asks later, and has all
                    third.socket.sendall(asked)
                    for _ in range(2 * pieces):
                        third.read()
                live.keys_say("revoke", "bob")
                self.assertTrue(eventually(lambda: not is_held(other.socket)), "although it takes nothing")
                heard = 0
                with self.assertRaises(OSError):
                    while True:
                        heard += isinstance(other.read(), bytes)
                self.assertLess(heard, pieces / 2, "what was on its way, and no more")

    @unittest.skipUnless(shutil.which("curl"), "curl is not installed")
    def test_curl_comes_in(self):
        with SealedWall() as live:
            link = live.sealed_link()
            done = subprocess.run(["curl", "-sS", "--cacert", str(live.keys / "authority.crt"), link],
                                  capture_output=True, text=True, timeout=PATIENCE)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertIn("/page/main.js", done.stdout)
            done = subprocess.run(["curl", "-sS", link.replace("https://", "http://")], capture_output=True, text=True,
                                  timeout=PATIENCE)
            self.assertIn("this door speaks https", done.stdout)

    def test_a_console_beyond_this_machine_needs_keys_or_a_word(self):
        start = [str(BIN / "tessera-server"), "--listen", "127.0.0.1:0", "--frames", "1", "--console", "0.0.0.0:0"]
        done = subprocess.run(start, capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(done.returncode, 2)
        for word in ("tessera-keys --keys DIR init", "--keys DIR", "--insecure"):
            self.assertIn(word, done.stderr)
        with Live(options=["--console", "0.0.0.0:0", "--insecure"]) as live:
            self.assertRegex(live.log("server"), r"console: http://[0-9.]+:\d+/\?token=")
            self.assertNotIn("0.0.0.0", live.link())


@unittest.skipUnless(HAS_WEBSOCKET, "python3-websocket is not installed (./deploy/set-up installs it)")
class Links(unittest.TestCase):
    def setUp(self):
        self.enterContext(run_folder())

    def connect(self, link, **options):
        """As somebody who has the link and nothing else."""
        with run_folder():
            return tessera.connect(link, **{"timeout": PATIENCE, **options})

    def test_all_is_as_in_plain(self):
        points = np.random.default_rng(3).random((1_400_000, 3), np.float32)
        with (SealedWall(surface="none") as live, self.connect(live.sealed_link(), name="linked") as wall,
              live.connect() as watcher):
            self.assertEqual(wall.whoami().as_dict(), {"name": "linked", "role": "operator"})
            self.assertTrue(wall.address.startswith("https://"))
            node = wall.create("/large", "Geometry", primitive="points", positions=points)
            self.assertTrue(np.array_equal(watcher["/large"].positions, points))
            self.assertTrue(np.array_equal(node.positions, points))
            with wall.frames(timeout=PATIENCE) as frames:
                self.assertGreater(next(frames).frame, 0)

    def test_a_link_holds_after_kill_9(self):
        with (SealedWall(surface="none", journal=True) as live,
              self.connect(live.sealed_link(), redial=PATIENCE) as wall):
            link = live.sealed_link()
            live.kill_server()
            self.assertTrue(eventually(lambda: not wall.connected))
            live.start_server()
            self.assertEqual(wall.whoami().role, "operator")
            self.assertEqual(live.sealed_link(), link)

    def test_another_authority_than_the_link_s_is_not_told_the_token(self):
        with SealedWall() as live:
            link = live.sealed_link()
            wrong = link[:-1] + ("1" if link[-1] == "0" else "0")
            with self.assertRaisesRegex(tessera.NetworkError,
                                        "no way in.*its authority is [0-9a-f]{64}, and the link names"):
                self.connect(wrong)
            with self.assertRaisesRegex(tessera.NetworkError, "no way in.*is not believed.*&authority="):
                self.connect(link.partition("&authority=")[0])  # the system knows no such authority
            with self.assertRaisesRegex(tessera.Refused, "refuses: this door speaks https"):
                self.connect(link.partition("&authority=")[0].replace("https://", "http://"))

    def test_nothing_is_said_to_who_is_not_the_wall_s_server(self):
        heard = []

        def serve(sealed, pem):
            said = sealed.recv(1 << 16)
            heard.append(said)
            if said.startswith(b"GET /authority.crt "):
                sealed.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(pem) + pem)
                sealed.unwrap()
        with somebody_sealed(("person", "eve"), serve=serve) as (address, authority):
            with self.assertRaisesRegex(tessera.NetworkError, "no way in"):
                self.connect(f"https://{address}/?token={WORD}&authority={authority}")
        self.assertTrue(heard and all(WORD.encode() not in said for said in heard))

    def test_who_is_no_console(self):
        def answer(text):
            return lambda sealed, pem: (sealed.recv(1 << 16), sealed.sendall(text), sealed.unwrap())

        def endless(sealed, pem):
            while True:
                sealed.sendall(b"HTTP/1.1 200 OK\r\n" * 100)
        for serve, kind, what in ((answer(b"HTTP/1.1 200 OK\r\n\r\nhello"), tessera.NetworkError, "names no authority"),
                                  (answer(b""), tessera.NetworkError, "names no authority"),
                                  (endless, tessera.NetworkError, "does not end")):
            with self.subTest(what=what), somebody_sealed(("server",), serve=serve) as (address, authority):
                with self.assertRaisesRegex(kind, what):
                    self.connect(f"https://{address}/?token={WORD}&authority={authority}")
        with Stranger(lambda connection: connection.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")) as stranger:
            with self.assertRaisesRegex(tessera.NetworkError, "does not speak TLS 1.3"):
                self.connect(f"https://{stranger.address}/?token={WORD}&authority={'a' * 64}")
        with (Stranger(lambda connection: None) as stranger,
              self.assertRaisesRegex(tessera.Timeout, "did not answer in time")):
            self.connect(f"https://{stranger.address}/?token={WORD}&authority={'a' * 64}", timeout=0.3)


if __name__ == "__main__":
    unittest.main()
