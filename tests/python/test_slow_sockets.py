"""Sockets of the console that read slowly, for longer than its pings wait: a minute and more by the clock."""
import os
import socket
import time
import unittest

import numpy as np

from live import PATIENCE, Live
from console_socket import WebSocket, array_name


class SlowSockets(unittest.TestCase):
    def test_one_that_reads_slowly_lives_and_one_that_stops_does_not(self):
        piece, pieces = 256 << 10, 60
        with Live(surface="none") as live, live.connect() as wall:
            data = os.urandom(piece)
            wall.create("/bytes", "ApplicationData", data=data)
            door, _, token = live.link().removeprefix("http://").partition("/?token=")
            slow, still, silent = (WebSocket(door, token) for _ in range(3))
            for each in (slow, still):
                each.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)
                each.socket.sendall(b"".join(WebSocket.question(at, "GetArray",
                                                                blob=array_name(np.frombuffer(data, np.uint8)),
                                                                length=piece) for at in range(pieces)))
            began = time.monotonic()
            # Each takes a second and a quarter: the ping that waits behind them is not answered in time
            for _ in range(pieces):
                self.assertIn("answer", slow.read())
                self.assertEqual(slow.read(), data)
                time.sleep(1.25)  # the slowness that is tested
            self.assertGreater(time.monotonic() - began, 65)
            slow.ask(pieces, "GetStatus")
            self.assertEqual(slow.read()["id"], pieces)
            with self.assertRaises(ConnectionError):
                while True:
                    still.read()
            with self.assertRaises(ConnectionError):  # it has answered no ping
                silent.read()


if __name__ == "__main__":
    unittest.main()
