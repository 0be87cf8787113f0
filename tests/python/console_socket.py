"""The console's WebSocket as a test speaks it: by hand, so that what comes can be counted, delayed and cut."""
import http.client
import json

CLOSE, PING = 8, 9


class WebSocket:
    """`door`: "ADDR:PORT". Frames are masked with zeros. `context`: over TLS, as it says."""

    def __init__(self, door, token, path="/socket", timeout=60, context=None):
        self._connection = (http.client.HTTPSConnection(door, timeout=timeout, context=context) if context else
                            http.client.HTTPConnection(door, timeout=timeout))
        self._connection.request("GET", path, headers={
            "Authorization": f"Bearer {token}", "Upgrade": "websocket", "Connection": "Upgrade",
            "Sec-WebSocket-Version": "13",
            "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="})
        self.socket = self._connection.sock
        self._stream = self.socket.makefile("rb")
        status = self._stream.readline()
        if b" 101 " not in status:
            raise ConnectionError(f"no socket: {status!r}")
        while self._stream.readline().strip():
            pass

    def __enter__(self):
        return self

    def __exit__(self, kind, value, trace):
        self.close()

    def close(self):
        self._stream.close()
        self._connection.close()

    PONG = b"\x8a\x80\0\0\0\0"

    @staticmethod
    def frame(text):
        size = bytes([0x80 | len(text)]) if len(text) < 126 else bytes([0xFE]) + len(text).to_bytes(2, "big")
        return b"\x81" + size + b"\0\0\0\0" + text.encode()

    def send_binary(self, data):
        """Of 65,536 bytes and more: shorter ones say their length otherwise."""
        self.socket.sendall(b"\x82\xff" + len(data).to_bytes(8, "big") + b"\0\0\0\0" + data)

    @staticmethod
    def question(number, request, **fields):
        return WebSocket.frame(json.dumps({"id": number, "request": request, "fields": fields}))

    def ask(self, number, request, **fields):
        self.socket.sendall(self.question(number, request, **fields))

    def read(self):
        """The next frame: a text as what it says, a binary frame as bytes. ConnectionError: it was closed, with the
        reason."""
        while True:
            head = self._exactly(2)
            size = head[1] & 0x7F
            if size > 125:
                size = int.from_bytes(self._exactly(2 if size == 126 else 8), "big")
            data, kind = self._exactly(size), head[0] & 0xF
            if not head[0] & 0x80:
                raise ConnectionError("a message in fragments")
            if kind == CLOSE:
                raise ConnectionError(data[2:].decode())
            if kind != PING:
                return json.loads(data) if kind == 1 else data

    def _exactly(self, size):
        data = self._stream.read(size)
        if len(data) < size:
            raise ConnectionError("the end, without a word")
        return data


def array_name(raw):
    """As requests speak of an array with these bytes."""
    from tessera._hash import array_id  # noqa: PLC0415: without numpy the tests say that they were skipped

    name = array_id(raw, 1 << 16)
    return f"{int.from_bytes(name[8:], 'little'):016x}{int.from_bytes(name[:8], 'little'):016x}"
