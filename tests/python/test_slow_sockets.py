"""Sockets of the console that read slowly, or not at all, for longer than its pings wait: a minute and more by the
clock."""
import os
import socket
import time
import unittest

import numpy as np

from eventually import eventually
from live import Live
from console_socket import WebSocket, array_name


class SlowSockets(unittest.TestCase):
    def test_one_that_reads_slowly_lives_and_those_that_stop_do_not_and_leave_their_places(self):
        piece, pieces, most = 256 << 10, 64, 48  # sockets that may be open
        with Live(surface="none") as live, live.connect() as wall:
            data = os.urandom(piece)
            wall.create("/bytes", "ApplicationData", data=data)
            door, _, token = live.link().removeprefix("http://").partition("/?token=")
            slow, still, silent = (WebSocket(door, token) for _ in range(3))
            stuck = [WebSocket(door, token) for _ in range(4)]
            for each in (slow, still):
                each.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)
                each.socket.sendall(b"".join(WebSocket.question(at, "GetArray",
                                                                blob=array_name(np.frombuffer(data, np.uint8)),
                                                                length=piece) for at in range(pieces)))
            # They read nothing, so that a ping waits behind what they asked for, and say once that they live: the next
            # ping comes while that one still waits
            for each in stuck:
                each.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
                for _ in range(64):
                    each.socket.sendall(b"".join(WebSocket.question(at, "GetStatus") for at in range(100)))
            began = time.monotonic()
            # Each takes a second and a quarter: the ping that waits behind them is not answered in time
            for at in range(pieces):
                self.assertIn("answer", slow.read())
                self.assertEqual(slow.read(), data)
                time.sleep(1.25)  # the slowness that is tested: it reads late what has come long ago
                if at == 28:
                    for each in stuck:
                        each.socket.sendall(WebSocket.PONG)
            self.assertGreater(time.monotonic() - began, 79)
            slow.ask(pieces, "GetStatus")
            self.assertEqual(slow.read()["id"], pieces)
            with self.assertRaises(ConnectionError):
                while True:
                    still.read()
            with self.assertRaises(ConnectionError):  # it has answered no ping
                silent.read()
            for each in (slow, *stuck):
                each.close()
            self.assertEqual(self.free_places(door, token, most), most)

    def free_places(self, door, token, most):
        """So many sockets can be opened at once, as soon as those that were closed are gone."""
        def open_all():
            sockets = []
            try:
                while len(sockets) <= most:
                    sockets.append(WebSocket(door, token))
            except ConnectionError:
                pass
            for each in sockets:
                each.close()
            return len(sockets)
        return most if eventually(lambda: open_all() == most) else open_all()


if __name__ == "__main__":
    unittest.main()
