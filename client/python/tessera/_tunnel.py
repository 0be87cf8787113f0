"""The link through a console: a page's link is all that a program has, and its channels are WebSockets (proto/WIRE.md).

Framing and the handshake are those of Debian's python3-websocket, which is wanted where a link is given and not
before."""
from __future__ import annotations

import collections
import importlib
import json
import re
import select
import socket
import ssl
import time
import urllib.parse
from typing import Any, Deque, NamedTuple, Optional, Sequence

from . import _door
from ._channel import Channel, Refusal, Stream, Way, connected, receive_all, send_all
from ._sealed import Distrust, Sealed, believing, believing_nobody, believing_the_system, fingerprint, sealed_to_server
from .errors import BadInput, NetworkError, TesseraError, Timeout, Unsupported, error_of

_LINK = "http://127.0.0.1:PORT/?token=… or https://HOST:PORT/?token=…&authority=…, as `tessera-ctl link` prints it"
_MOST_OF_A_HEAD = 1 << 16
_MOST_OF_A_MESSAGE = 1 << 20
_SENT_AT_ONCE = 1 << 16  # it is copied and masked as one, which larger ones are slower at
_LATER = (429, 503)  # of HTTP: there are too many of us now


def _websocket() -> Any:
    try:
        return importlib.import_module("websocket")
    except ImportError:
        raise Unsupported("a page's link needs Python's websocket (apt-get install python3-websocket); "
                          "tessera.connect(\"ADDR:PORT\") does not") from None


class _Waits:
    """A socket as the module wants it, whose waits all end at one time. It stays open when the module closes it."""

    def __init__(self, sock: Stream, deadline: float) -> None:
        self._socket, self._deadline, self._room = sock, deadline, _MOST_OF_A_HEAD

    def gettimeout(self) -> int:
        return 0  # the module is not to wait

    def send(self, data: bytes) -> int:
        send_all(self._socket, [data], self._deadline)
        return len(data)

    def recv(self, size: int) -> bytes:
        ready = select.poll()
        ready.register(self._socket, select.POLLIN)
        self._room -= size
        if self._room < 0:
            raise ValueError("its answer does not end")
        while True:
            try:
                return self._socket.recv(size, socket.MSG_DONTWAIT)
            except BlockingIOError:
                left = self._deadline - time.monotonic()
                if left <= 0 or not ready.poll(left * 1000):
                    raise TimeoutError from None

    def close(self) -> None:
        pass


class Tunnel(Channel):
    """A channel inside a WebSocket: where a message ends means nothing."""

    def __init__(self, sock: Stream, module: Any) -> None:
        super().__init__(sock)
        self._abnf = module.ABNF
        self._faults = module.WebSocketException
        self._frames = module.frame_buffer(self._take, True)
        self._left = memoryview(b"")  # of the last frame
        # They go with the next message: nobody who reads waits for that
        self._pongs: Deque[bytes] = collections.deque()

    @property
    def pending(self) -> bool:
        return len(self._left) > 0 or super().pending

    def _framed(self, data: bytes, code: int) -> bytes:
        framed: bytes = self._abnf.create_frame(data, code).format()
        return framed

    def send(self, pieces: Sequence[Any], deadline: float) -> None:
        message = bytearray()
        for piece in pieces:
            view = memoryview(piece).cast("B")
            while len(view):
                room = _SENT_AT_ONCE - len(message)
                message += view[:room]
                view = view[room:]
                if len(message) == _SENT_AT_ONCE:
                    self._say(message, deadline)
                    message = bytearray()
        if message:
            self._say(message, deadline)

    def _say(self, message: bytearray, deadline: float) -> None:
        pongs = [self._pongs.popleft() for _ in range(len(self._pongs))]
        send_all(self._socket, [*pongs, self._framed(bytes(message), self._abnf.OPCODE_BINARY)], deadline)

    def _take(self, size: int) -> bytes:
        if (self._frames.length or 0) > _MOST_OF_A_MESSAGE:
            raise NetworkError(f"the console began a message of {self._frames.length} bytes")
        data = self._socket.recv(size, socket.MSG_DONTWAIT)
        if not data:
            raise NetworkError("the server closed the connection")
        return data

    def some(self, into: memoryview) -> Optional[int]:
        while not len(self._left):
            try:
                frame = self._frames.recv_frame()  # what has come of one that has not ended it keeps
            except (BlockingIOError, InterruptedError):
                return None
            except self._faults as error:
                raise NetworkError(f"the console's messages make no sense: {error}") from None
            self._hear(frame)
        count = min(len(into), len(self._left))
        into[:count] = self._left[:count]
        self._left = self._left[count:]
        return count

    def _hear(self, frame: Any) -> None:
        code, data = frame.opcode, bytes(frame.data)
        if code in (self._abnf.OPCODE_BINARY, self._abnf.OPCODE_CONT):
            self._left = memoryview(data)
        elif code == self._abnf.OPCODE_PING:
            self._pongs.append(self._framed(data, self._abnf.OPCODE_PONG))
        elif code == self._abnf.OPCODE_CLOSE:
            raise NetworkError(f"the server closed the "
                               f"connection{': ' if data[2:] else ''}{data[2:].decode('utf-8', 'replace')}")
        elif code != self._abnf.OPCODE_PONG:
            raise NetworkError("the console said text in a channel of bytes")


class ByLink(Way):
    """Through a server's console, whose link has a token: it lets in at the console, and at the server behind it."""

    def __init__(self, link: str) -> None:
        said = _parse(link)
        self._place, self._token, self._pinned, self._seals = said.place, said.token, said.authority, said.seals
        self._module = _websocket()
        host, port = self._place
        self._authority = f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
        self.address = f"{'https' if self._seals else 'http'}://{self._authority}"
        self._context: Optional[ssl.SSLContext] = None  # that believes the authority which the link names

    def open(self, deadline: float) -> Channel:
        sock: Stream = self._sealed(deadline) if self._seals else self._connected(deadline)
        try:
            if not self._seals and not Channel(sock).near:
                raise Refusal(NetworkError(f"the link to {self.address} is plain, and leads to another machine: "
                                           f"others could read its token on "
                                           "the way. A server with keys has an https link; one without takes "
                                           "\"ADDR:PORT\""), False)
            self._upgrade(sock, deadline)
        except BaseException:
            sock.close()
            raise
        return Tunnel(sock, self._module)

    def _connected(self, deadline: float) -> socket.socket:
        try:
            return connected(self._place, deadline)
        except OSError as error:
            raise NetworkError(f"no Tessera console at {self.address}: {error.strerror or error}") from None

    def _sealed(self, deadline: float) -> Sealed:
        """Nothing has been said to it yet, and it is the one that the link means."""
        if self._pinned and self._context is None:
            self._context = believing(self._believed(deadline))
        sock = self._connected(deadline)
        try:
            if self._context is not None:
                return sealed_to_server(sock, self._context, deadline)
            return Sealed(sock, believing_the_system(), self._place[0], deadline)
        except BaseException as error:
            sock.close()
            raise self._told(error) from None

    def _told(self, error: BaseException) -> BaseException:
        if isinstance(error, Distrust):
            hint = "" if self._pinned else "; the whole link of a wall's own console ends with &authority=…"
            return Refusal(NetworkError(f"no way in at the console at {self.address}: {error}{hint}"), False)
        if isinstance(error, Timeout):
            return Timeout(f"no Tessera console at {self.address}: {error}")
        return NetworkError(f"no Tessera console at {self.address}: {error}") if isinstance(error, OSError) else error

    def _believed(self, deadline: float) -> str:
        """The certificate of the authority that the link names. Who gives it need not be believed: the link says which
        it is."""
        sock = self._connected(deadline)
        try:
            stream = Sealed(sock, believing_nobody(), None, deadline)
            send_all(stream, [f"GET /authority.crt HTTP/1.1\r\nHost: {self._authority}\r\nConnection: "
                              f"close\r\n\r\n".encode()], deadline)
            waits, said = _Waits(stream, deadline), b""
            while True:
                data = waits.recv(4096)
                if not data:
                    break
                said += data
        except ValueError as error:
            raise self._told(NetworkError(str(error))) from None
        except TimeoutError:
            raise self._told(Timeout("it did not answer in time")) from None
        except OSError as error:
            raise self._told(error) from None
        finally:
            sock.close()
        head, _, body = said.partition(b"\r\n\r\n")
        pem = body.decode("ascii", "replace")
        found = fingerprint(pem)
        if not found or not head.startswith(b"HTTP/1.1 200 "):
            raise NetworkError(f"what listens at {self.address} is no console of Tessera (it names no authority); a "
                               f"link is {_LINK}")
        if found != self._pinned:
            raise self._told(Distrust(f"its authority is {found}, and the link names {self._pinned}: the link is of "
                                      f"another wall, "
                                      "or somebody else answers"))
        return pem

    def access(self, channel: Channel) -> str:
        return self._token

    def _upgrade(self, sock: Stream, deadline: float) -> None:
        web = self._module.WebSocket()
        try:
            web.connect(f"ws://{self._authority}/link", socket=_Waits(sock, deadline), suppress_origin=True,
                        redirect_limit=0,
                        host=self._authority, header=[f"Authorization: Bearer {self._token}"])
            status, head = int(web.status), web.headers
        except self._module.WebSocketBadStatusException as error:
            status, head = int(error.status_code), error.resp_headers
        except (TimeoutError, self._module.WebSocketTimeoutException):
            raise Timeout(f"no Tessera console at {self.address}: it did not answer in time") from None
        except OSError as error:
            raise NetworkError(f"the connection to the console at {self.address} broke: "
                               f"{error.strerror or error}") from None
        except (self._module.WebSocketException, ValueError, LookupError) as error:
            raise NetworkError(f"what listens at {self.address} is no console of Tessera ({error}); a link is "
                               f"{_LINK}") from None
        if status != 101:
            raise Refusal(self._refused(status, _words(sock, head, deadline)), status in _LATER)

    def _refused(self, status: int, said: Any) -> TesseraError:
        words = said.get("message") if isinstance(said, dict) else None
        if not words:
            return NetworkError(f"what listens at {self.address} is no console of Tessera (it answers {status}); a "
                                f"link is {_LINK}")
        if status == 404:
            return Unsupported(f"the console at {self.address} has no /link for programs: {words}")
        return error_of(str(said.get("code", "failed")), f"the console at {self.address} refuses: {words}")


def _words(sock: Stream, head: Any, deadline: float) -> Any:
    """What is said behind an answer's head: a console's error, in JSON."""
    try:
        text = memoryview(bytearray(min(_MOST_OF_A_HEAD, int(head["content-length"]))))
        receive_all(Channel(sock), text, deadline)
        return json.loads(bytes(text))["error"]
    except (OSError, ValueError, LookupError, TypeError):
        return None


class _Link(NamedTuple):
    place: tuple[str, int]
    token: str
    seals: bool
    authority: str  #: SHA-256 of its certificate; empty: the system's authorities are believed


def _parse(link: str) -> _Link:
    """Where it leads, and what it says."""
    try:
        url = urllib.parse.urlsplit(link)
        host, port = url.hostname, url.port
    except ValueError as error:
        raise BadInput(f"this is no link: {error}; write {_LINK}") from None
    if url.scheme not in ("http", "https"):
        raise BadInput(f"a console speaks http or https, not {url.scheme}; write {_LINK}")
    seals = url.scheme == "https"
    if seals and host and port is None:
        port = 443
    if not host or not port or url.username is not None:
        raise BadInput(f"the link has no host and port of a console; write {_LINK}")
    if url.path not in ("", "/"):
        raise BadInput(f"the link leads to {url.path}, not to a console's page; write {_LINK}")
    query = urllib.parse.parse_qs(url.query, keep_blank_values=True)
    token = query.get("token", [""])[0]
    if not token:
        raise BadInput(f"the link has no token; write {_LINK}")
    if not _door.is_token(token):
        raise BadInput(f"the link's token is none (16 to 128 letters, digits, - and _): is it whole? write {_LINK}")
    authority = query.get("authority", [""])[0].lower()
    if "authority" in query and not seals:
        raise BadInput(f"a link that names an authority begins with https; write {_LINK}")
    if "authority" in query and not re.fullmatch("[0-9a-f]{64}", authority):
        raise BadInput(f"the link's authority is none (64 digits of 0-9a-f): is it whole? write {_LINK}")
    return _Link((host, port), token, seals, authority)

