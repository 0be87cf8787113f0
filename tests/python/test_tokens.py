"""How long tokens and links let in: over restarts, until the wall is protected otherwise or they are revoked."""
import os
import pathlib
import re
import shutil
import ssl
import subprocess
import unittest
import urllib.error
import urllib.parse
import urllib.request

import tessera
from console_socket import WebSocket
from eventually import eventually
from live import BIN, PATIENCE, Live, run_folder

ROLES = ("viewer", "editor", "operator")
PANEL = pathlib.Path(__file__).resolve().parents[2] / "deploy/scenes/engine-hall.panel"


class SealedWall(Live):
    def __enter__(self):
        self.make_keys("ada:operator")
        return super().__enter__()


def until(what, found):
    result = eventually(found)
    if not result:
        raise AssertionError(what)
    return result


def panel_token(live, times):
    """Of the link that the server has printed so often."""
    printed = until("a link of the panel", lambda: (
        found := re.findall(r"panel \S+: \S+token=([^&\s]+)", live.log("server"))) and len(found) == times and found)
    return printed[-1]


def ssl_of(live):
    return ssl.create_default_context(cafile=str(live.keys / "authority.crt"))


def status_of(live, token):
    """What the console answers to who has a token: 200, or 401 and the words."""
    address = urllib.parse.urlsplit(live.link())
    context = ssl_of(live) if address.scheme == "https" else None
    request = urllib.request.Request(f"{address.scheme}://{address.netloc}/api",
                                     headers={"Authorization": f"Bearer {token}"})
    try:
        with urllib.request.urlopen(request, timeout=PATIENCE, context=context) as answer:
            return answer.status, ""
    except urllib.error.HTTPError as refused:
        with refused:
            return refused.code, refused.read().decode()


def keys_say(*arguments, folder):
    done = subprocess.run([str(BIN / "tessera-keys"), *arguments], cwd=folder, capture_output=True, text=True,
                          timeout=PATIENCE)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return done.stdout


class Tokens(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(run_folder())

    def refused(self, live, tokens):
        for token in tokens:
            status, words = status_of(live, token)
            self.assertEqual(status, 401, token)
            self.assertIn("has ended: `tessera-ctl link` prints a link with another one", words)

    def restart(self, live, options):
        live.server.terminate()
        live.server.wait(PATIENCE)
        live._options = options  # of the next server, at the same port
        live.start_server()
        return {role: live.token(role) for role in ROLES}

    def test_tokens_end_where_the_wall_is_protected_otherwise(self):
        with Live(options=["--insecure"]) as live:
            live.make_keys()
            sealed = live._options[-2:]
            insecure = {role: live.token(role) for role in ROLES}
            self.assertEqual(self.restart(live, ["--insecure"]), insecure, "the same protection")
            keyed = self.restart(live, sealed)
            self.refused(live, insecure.values())
            self.assertEqual([status_of(live, token)[0] for token in keyed.values()], [200] * 3)
            self.assertEqual(self.restart(live, sealed), keyed)
            live.keys_say("renew", "server")
            self.assertEqual(self.restart(live, sealed), keyed, "another key of the same authority")
            plain = self.restart(live, [])
            self.refused(live, [*insecure.values(), *keyed.values()])
            (live.keys / "authority.pem").unlink()
            (live.keys / "authority.crt").unlink()
            live.keys_say("init", "--wall", "1x1")
            self.restart(live, sealed)
            self.refused(live, [*insecure.values(), *keyed.values(), *plain.values()])

    def test_revoked_links_end_while_the_server_runs_and_stay_so(self):
        with SealedWall(surface="none", options=["--panel", str(PANEL)]) as live:
            hours = live.keys_say("token", "ci", "--role", "editor").split()[-1]
            handed_out = [live.token(role) for role in ROLES] + [panel_token(live, 1), hours]
            until("that the server has read the new token", lambda: status_of(live, hours)[0] == 200)
            self.assertEqual([status_of(live, token)[0] for token in handed_out], [200] * 5)
            door = urllib.parse.urlsplit(live.link()).netloc
            own = live.connect(redial=PATIENCE)
            with run_folder():
                by_key = tessera.connect(live.address, keys=live.key_of("ada"), timeout=PATIENCE)
            sockets = [WebSocket(door, token, context=ssl_of(live)) for token in handed_out]
            said = live.keys_say("revoke", "--links")
            self.assertIn("revoked 1 token ('ci')", said)
            for socket in sockets:
                with socket, self.assertRaisesRegex(OSError, "its token has ended"):
                    while True:
                        socket.read()
            self.refused(live, handed_out)
            self.assertEqual(own.whoami().role, "operator", "a program of the server's user finds the new token")
            self.assertEqual(by_key.whoami().role, "operator", "a key is no token")
            own.close()
            by_key.close()
            new = [live.token(role) for role in ROLES]
            self.assertFalse(set(new) & set(handed_out))
            self.assertEqual([status_of(live, token)[0] for token in new], [200] * 3)
            live._wait_until_live(1)  # its host dialled again
            panel = panel_token(live, 2)
            self.assertEqual(status_of(live, panel)[0], 200, "it prints new links")
            self.restart(live, live._options)
            self.refused(live, [*handed_out, panel])
            self.assertEqual([live.token(role) for role in ROLES], new, "new links hold as others do")
            live.server.terminate()
            live.server.wait(PATIENCE)
            live.keys_say("revoke", "--links")
            live.start_server()
            self.refused(live, new)

    def test_links_of_a_wall_without_keys_are_revoked_too(self):
        with Live() as live:
            link, tokens = live.link("viewer"), [live.token(role) for role in ROLES]
            with tessera.connect(link, timeout=PATIENCE) as guest:
                self.assertEqual(guest.whoami().role, "viewer")
                said = keys_say("revoke", "--links", folder=live.folder)
                self.assertIn(f"these run now: 1x1 ({live.address})", said)
                with self.assertRaisesRegex(tessera.TesseraError, "token"):
                    while True:
                        guest.status()
            self.refused(live, tokens)
            with self.assertRaisesRegex(tessera.Refused, "has ended: `tessera-ctl link`"):
                tessera.connect(link, timeout=PATIENCE)
            self.restart(live, [])
            self.refused(live, tokens)

    def test_a_token_that_a_person_chose_ends_too_and_the_server_says_so(self):
        word = self.folder / "word"
        word.write_text("a-token-that-a-person-chose\n")
        with Live(options=["--token-file", str(word)]) as live:
            self.assertEqual(live.token(), "a-token-that-a-person-chose")
            keys_say("revoke", "--links", folder=live.folder)
            until("its end", lambda: status_of(live, "a-token-that-a-person-chose")[0] == 401)
            self.refused(live, ["a-token-that-a-person-chose"])
            live.server.terminate()
            live.server.wait(PATIENCE)
            done = subprocess.run([str(BIN / "tessera-server"), "--listen", live.address, "--token-file", str(word)],
                                  capture_output=True, text=True, timeout=PATIENCE, env=os.environ)
            self.assertEqual(done.returncode, 2)
            self.assertIn(f"--token-file {word}: its token has ended", done.stderr)
            word.write_text("another-token-that-a-person-chose\n")
            live.start_server()
            self.assertEqual(live.token(), "another-token-that-a-person-chose")

    def refused_after_a_restart_of_the_machine(self, live, options):
        """The machine empties the run folder. A server that then names the token says that it has ended."""
        live.server.terminate()
        live.server.wait(PATIENCE)
        shutil.rmtree(self.folder / "tessera", ignore_errors=True)
        live._options = options
        with self.assertRaisesRegex(RuntimeError, "--token-file .*: its token has ended"):
            live.start_server()

    def test_a_chosen_token_that_was_revoked_stays_so_over_a_restart_of_the_machine(self):
        word = self.folder / "word"
        word.write_text("a-token-that-a-person-chose\n")
        with SealedWall(options=["--token-file", str(word)]) as live:
            self.assertEqual(status_of(live, "a-token-that-a-person-chose")[0], 200)
            live.keys_say("revoke", "--links")
            until("its end", lambda: status_of(live, "a-token-that-a-person-chose")[0] == 401)
            self.refused_after_a_restart_of_the_machine(live, live._options)
            shutil.rmtree(self.folder / "state")
            self.refused_after_a_restart_of_the_machine(live, live._options)  # the keys' folder remembers it, too

    def test_a_chosen_token_stays_with_its_protection_over_a_restart_of_the_machine(self):
        word = self.folder / "word"
        word.write_text("a-token-that-a-person-chose\n")
        chosen = ["--token-file", str(word)]
        with Live(options=["--insecure", *chosen]) as live:
            live.make_keys()
            self.assertEqual(status_of(live, "a-token-that-a-person-chose")[0], 200)
            live.server.terminate()
            live.server.wait(PATIENCE)
            shutil.rmtree(self.folder / "tessera", ignore_errors=True)
            self.assertEqual(self.restart(live, ["--insecure", *chosen])["operator"], "a-token-that-a-person-chose")
            self.refused_after_a_restart_of_the_machine(live, ["--keys", str(live.keys), *chosen])

    def test_no_chosen_token_lets_in_where_its_end_could_not_be_kept(self):
        word = self.folder / "word"
        word.write_text("a-token-that-a-person-chose\n")
        (self.folder / "state").write_text("a file where the folder should be")
        with Live() as live:
            with live.connect() as wall:
                self.assertEqual(wall.whoami().role, "operator", "nobody chose a token")
            live.server.terminate()
            live.server.wait(PATIENCE)
            live._options = ["--token-file", str(word)]
            with self.assertRaisesRegex(RuntimeError, f"cannot be kept: {self.folder}/state.*set XDG_STATE_HOME"):
                live.start_server()


if __name__ == "__main__":
    unittest.main()
