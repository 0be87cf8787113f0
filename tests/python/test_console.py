"""The console's figures, read by the parser of those who made the format; and by others than the server's user."""
import importlib.util
import os
import pathlib
import socket
import unittest
import urllib.error
import urllib.parse
import urllib.request

import numpy as np

from live import PATIENCE, Live, figure
from console_socket import WebSocket, array_name


def ask(link, path, token=True):
    url = urllib.parse.urlsplit(link)
    request = urllib.request.Request(f"{url.scheme}://{url.netloc}{path}")
    if token:
        request.add_header("Authorization", "Bearer " + urllib.parse.parse_qs(url.query)["token"][0])
    return urllib.request.urlopen(request, timeout=PATIENCE)


class Console(unittest.TestCase):
    @unittest.skipUnless(importlib.util.find_spec("prometheus_client"),
                         "python3-prometheus-client is not installed (./deploy/set-up installs it)")
    def test_figures_are_openmetrics(self):
        from prometheus_client.openmetrics.parser import text_string_to_metric_families

        with Live(wall="2x2", surface="none") as live:
            answer = ask(live.link(), "/metrics")
            self.assertTrue(answer.headers["Content-Type"].startswith("application/openmetrics-text"))
            families = {family.name: family for family in text_string_to_metric_families(answer.read().decode())}
        self.assertTrue(all(name.startswith("tessera_") and family.documentation for name, family in families.items()))
        self.assertEqual({sample.labels["state"] for sample in families["tessera_host_up"].samples}, {"live"})
        self.assertEqual(len(families["tessera_host_up"].samples), 4)
        self.assertGreater(families["tessera_frames"].samples[0].value, 0)
        self.assertGreater(families["tessera_resident_bytes"].samples[0].value, 1e6)

    def test_without_a_token_nobody_is_told(self):
        with Live() as live:
            link = live.link()
            for path in ("/metrics", "/api", "/wall.jpg", "/", "/api.html"):
                with self.assertRaises(urllib.error.HTTPError) as refused:
                    ask(link, path, token=False)
                self.assertEqual(refused.exception.code, 401)
                refused.exception.close()
            self.assertEqual(ask(link, "/style.css", token=False).status, 200)
            self.assertEqual(ask(link, "/page/style.css", token=False).headers["Content-Type"],
                             "text/css; charset=utf-8")
            policy = ask(link, "/").headers["Content-Security-Policy"]
            for said in ("default-src 'none'", "script-src 'self'", "connect-src 'self'", "img-src 'self' blob: data:"):
                self.assertIn(said, policy)
            self.assertNotIn("unsafe", policy)

    def test_sockets_cost_no_threads_and_what_is_asked_at_once_comes(self):
        piece, pieces = 256 << 10, 400
        points = np.arange(3 * 170_000, dtype=np.float32).reshape(-1, 3)
        with Live(surface="none") as live, live.connect() as wall:
            wall.show(points, "/points", radius=0.1)
            door, _, token = live.link().removeprefix("http://").partition("/?token=")
            raw = points.reshape(-1).view(np.uint8)
            array = array_name(raw)
            with WebSocket(door, token) as one:
                one.ask(0, "GetStatus")
                one.read()
                threads, memory = figure(live.server, "Threads"), figure(live.server, "VmRSS")
                others = [WebSocket(door, token) for _ in range(40)]
                for other in others:
                    other.ask(0, "GetStatus")
                    other.read()
                self.assertEqual(figure(live.server, "Threads"), threads, "forty sockets more")
                offsets = [at * piece % (raw.nbytes - piece) for at in range(pieces)]
                asked = b"".join(WebSocket.question(at, "GetArray", blob=array, offset=offset, length=piece)
                                 for at, offset in enumerate(offsets))
                one.socket.sendall(asked)  # it does not read yet: 100 MB would have to wait for it
                others[1].socket.sendall(asked)
                for _ in range(2 * pieces):  # all comes to one that asked later
                    others[1].read()
                self.assertLess(figure(live.server, "VmRSS") - memory, 60_000, "kB held for one that does not read")
                others[0].ask(1, "GetStatus")
                self.assertEqual(others[0].read()["id"], 1)
                left = dict(enumerate(offsets))
                while left:
                    answer = one.read()
                    self.assertIn("answer", answer)
                    begin = left.pop(answer["id"])
                    self.assertEqual(one.read(), raw[begin:begin + piece].tobytes())
                for other in others:
                    other.close()

    def test_what_a_viewer_may_not_bring_is_not_kept(self):
        with Live() as live:
            door, _, token = live.link(role="viewer").removeprefix("http://").partition("/?token=")
            with WebSocket(door, token) as one:
                one.ask(0, "GetStatus")
                one.read()
                memory, frame = figure(live.server, "VmRSS"), bytes(48 << 20)
                one.socket.sendall(WebSocket.frame('{"id":1,"request":"ProposeChanges","binaries":4}'))
                self.assertEqual(one.read()["error"]["code"], "refused")
                for _ in range(3):
                    one.send_binary(frame)
                self.assertLess(figure(live.server, "VmRSS") - memory, 40_000, "kB of 144 MiB")
                one.send_binary(bytes(1 << 16))
                one.ask(2, "GetStatus")
                self.assertEqual(one.read()["id"], 2)

    def test_a_second_head_that_stops_half_way_is_answered(self):
        with Live() as live:
            host, _, port = live.link().removeprefix("http://").partition("/")[0].partition(":")
            with socket.create_connection((host, int(port)), PATIENCE) as one:
                ask_for = f"GET /style.css HTTP/1.1\r\nHost: {host}:{port}\r\n"
                one.sendall(f"{ask_for}\r\n".encode())
                self.assertTrue(one.recv(1 << 16).startswith(b"HTTP/1.1 200"))
                one.sendall(ask_for.encode())
                self.assertTrue(one.recv(1 << 16).startswith(b"HTTP/1.1 408"))


if __name__ == "__main__":
    unittest.main()
