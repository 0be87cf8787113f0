"""The native link to one server: Hello and Welcome, heartbeats, requests and their replies, and the return after a break.

A thread of its own reads, answers heartbeats and dials again; requests are written by whoever asks. Any thread may call anything.
"""
from __future__ import annotations

import os
import select
import socket
import threading
import time
from concurrent.futures import Future
from typing import Any, Callable, Optional, Sequence

from . import _wire
from ._described import decode_message, encode_message
from ._schema import Schema
from .errors import LimitExceeded, NetworkError, TesseraError, Timeout, error_of

CONTROL, BULK = 0, 1
_APPLICATION = 1
_SERVER_LOST_AFTER = 5.0  # s of silence, as the C++ library has it
_FIRST_PAUSE, _LONGEST_PAUSE = 0.05, 1.0  # s between a dial that failed and the next
_MOST_PIECES = 256  # of one sendmsg


def split_address(address: str) -> tuple[str, int]:
    host, colon, port = address.rpartition(":")
    if not colon or not port.isdigit() or not 0 < int(port) < 65536:
        raise error_of("bad_input", f"\"{address}\" is no address; write HOST:PORT, as the server prints it")
    return host.strip("[]") or "127.0.0.1", int(port)


def send_all(sock: socket.socket, pieces: Sequence[Any], deadline: float) -> None:
    """Raises Timeout where the peer does not take it by then: what was begun is then cut off, and the link is useless."""
    left = [memoryview(piece).cast("B") for piece in pieces]
    ready = select.poll()
    ready.register(sock, select.POLLOUT)
    while left:
        try:
            sent = sock.sendmsg(left[:_MOST_PIECES], (), socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
        except (BlockingIOError, InterruptedError):
            if not ready.poll(max(0.0, deadline - time.monotonic()) * 1000) and time.monotonic() >= deadline:
                raise Timeout("the server does not read what it is sent") from None
            continue
        while left and sent >= len(left[0]):
            sent -= len(left.pop(0))
        if sent:
            left[0] = left[0][sent:]


def receive_all(sock: socket.socket, into: memoryview, deadline: float) -> None:
    got = 0
    while got < len(into):
        sock.settimeout(max(0.001, deadline - time.monotonic()))
        try:
            count = sock.recv_into(into[got:])
        except TimeoutError:
            raise Timeout("it did not answer in time") from None
        if count == 0:
            raise NetworkError("the server closed the connection")
        got += count


class Refusal(TesseraError):
    """Inside: a server said Refused."""

    def __init__(self, error: TesseraError, retry: bool) -> None:
        super().__init__(str(error))
        self.error, self.retry = error, retry


class Link:
    """One control connection. `on_message(name, members)` is called by the thread that reads, `on_back` there after a return."""

    def __init__(self, schema: Schema, address: str, *, name: str, timeout: float, redial: float, follows: bool,
                 on_message: Callable[[str, dict[str, Any]], None], on_back: Callable[[], None], on_end: Callable[[Optional[TesseraError]], None]) -> None:
        self.schema, self.address, self.name, self.timeout, self.redial, self.follows = schema, address, name, timeout, redial, follows
        self._place = split_address(address)
        self._on_message, self._on_back, self._on_end = on_message, on_back, on_end
        self._sending = threading.Lock()  # a message, or arrays and the proposal behind them, go out in one piece
        self._state = threading.Condition()  # of all below
        self._pending: dict[int, Future[dict[str, Any]]] = {}
        self._last_request = 0
        self._away: Optional[NetworkError] = None
        self._ended: Optional[TesseraError] = None
        self._over = False
        self._closing = False
        self.generation = 0  # grows with each return: numbers of objects found before may mean something else
        self.epoch = 0
        self.token = (0, 0)
        self.configuration = memoryview(b"")
        self._heartbeat = 0.1
        self._echo = (0, 0)  # the server's last beat, and when it came here
        self._socket = self._dial(time.monotonic() + timeout)
        self._wake_read, self._wake_write = os.pipe()
        self._thread = threading.Thread(target=self._run, name=f"tessera {address}", daemon=True)
        self._thread.start()

    # ---- what any thread calls

    @property
    def over(self) -> bool:
        """The server has said that the show is over."""
        return self._over

    @property
    def connected(self) -> bool:
        return self._away is None and self._ended is None

    def settled(self) -> int:
        """The generation, once the link is there: of one that is broken, after its return."""
        deadline = time.monotonic() + self.timeout
        with self._state:
            while self._away is not None and self._ended is None:
                if not self._state.wait(max(0.0, deadline - time.monotonic())) and time.monotonic() >= deadline:
                    raise Timeout(f"the server at {self.address} did not come back in time: {self._away}")
            return self.generation

    def request(self, body: _wire.Chain, uploads: Sequence[_wire.Chain] = (), timeout: Optional[float] = None) -> "Future[dict[str, Any]]":
        """Sends it, after the return where the link is broken. The reply's members come with the future."""
        if body.size > self.schema.limits["request_bytes"]:
            raise LimitExceeded(f"the request has {body.size} bytes, and {self.schema.limits['request_bytes']} is the most")
        deadline = time.monotonic() + (self.timeout if timeout is None else timeout)
        future: Future[dict[str, Any]] = Future()
        if not self._sending.acquire(timeout=max(0.0, deadline - time.monotonic())):
            raise Timeout(f"the server at {self.address} has not taken what another thread sends it")
        try:
            with self._state:
                while self._away is not None and self._ended is None:
                    if not self._state.wait(max(0.0, deadline - time.monotonic())) and time.monotonic() >= deadline:
                        raise Timeout(f"the server at {self.address} did not come back in time: {self._away}")
                if self._ended is not None:
                    raise self._ended
                self._last_request += 1
                number = self._last_request
                self._pending[number] = future
                sock = self._socket
            try:
                for piece in uploads:
                    self._send(sock, "Upload", piece, deadline)
                self._send(sock, "Request", encode_message(self.schema.messages["Request"], {"id": number, "body": body}), deadline)
            except Timeout:
                self._break(sock)  # a message was cut off
                raise
            except OSError as error:
                self._break(sock)
                raise NetworkError(f"the connection to the server at {self.address} broke: {error}") from None
        finally:
            self._sending.release()
        return future

    def answer(self, future: "Future[dict[str, Any]]", timeout: Optional[float] = None) -> memoryview:
        """Waits for the body of a reply. Raises what the server refused with."""
        wait = self.timeout if timeout is None else timeout
        try:
            reply = future.result(wait)
        except TesseraError:
            raise
        except TimeoutError:
            raise Timeout(f"the server at {self.address} did not answer within {wait:g} s") from None
        return self.body_of(reply)

    def body_of(self, reply: dict[str, Any]) -> memoryview:
        if reply["error"]:
            codes = self.schema.errors
            raise error_of(codes[reply["code"]] if reply["code"] < len(codes) else "failed", reply["error"])
        body: memoryview = reply["body"]
        return body

    def say(self, name: str, values: dict[str, Any]) -> None:
        """Of the thread that reads: a message that nobody waits for."""
        with self._sending:
            try:
                self._send(self._socket, name, encode_message(self.schema.messages[name], values), time.monotonic() + self.timeout)
            except (OSError, TesseraError):
                self._break(self._socket)

    def open_bulk(self, deadline: float) -> socket.socket:
        """A second connection, for arrays."""
        sock = self._connect(deadline)
        self._send(sock, "Hello", self._hello(BULK), deadline)
        return sock

    def close(self) -> None:
        with self._state:
            if self._closing:
                return
            self._closing = True
            self._ended = self._ended or NetworkError("this wall has been closed")
            self._state.notify_all()
        os.close(self._wake_write)  # whoever waits for the other end wakes up
        if threading.current_thread() is not self._thread:
            self._thread.join(2.0)

    # ---- inside

    def _hello(self, channel: int) -> _wire.Chain:
        return encode_message(self.schema.messages["Hello"], {
            "protocol": self.schema.protocol, "schema": self.schema.schema, "role": _APPLICATION, "channel": channel, "name": self.name,
            "follows": self.follows, "token": self.token if channel == BULK else (0, 0), "seen_epoch": self.epoch if channel == CONTROL else 0})

    def _connect(self, deadline: float) -> socket.socket:
        try:
            sock = socket.create_connection(self._place, max(0.001, deadline - time.monotonic()))
        except OSError as error:
            raise NetworkError(f"no Tessera server at {self.address}: {error.strerror or error}") from None
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return sock

    def _send(self, sock: socket.socket, name: str, payload: _wire.Chain, deadline: float) -> None:
        header = _wire.header_of(self.schema.messages[name].number, self.epoch if name != "Hello" else 0, payload)
        send_all(sock, [header, *payload.pieces], deadline)

    def _receive(self, sock: socket.socket, deadline: float) -> tuple[str, dict[str, Any]]:
        data = memoryview(bytearray(_wire.HEADER_BYTES))
        receive_all(sock, data, deadline)
        header = self._checked(_wire.Header(data))
        payload = memoryview(bytearray(header.size))
        receive_all(sock, payload, deadline)
        return self._message(header, payload)

    def _checked(self, header: _wire.Header) -> _wire.Header:
        if header.size > self.schema.most_bytes.get(header.kind, 0):
            raise NetworkError(f"the server announced a message of type {header.kind} with {header.size} bytes")
        return header

    def _message(self, header: _wire.Header, payload: memoryview) -> tuple[str, dict[str, Any]]:
        header.check(payload)
        name = self.schema.message_names[header.kind]
        return name, decode_message(self.schema.messages[name], payload)

    def _dial(self, deadline: float) -> socket.socket:
        """A connection that has been welcomed."""
        sock = self._connect(deadline)
        try:
            self._send(sock, "Hello", self._hello(CONTROL), deadline)
            name, said = self._receive(sock, deadline)
            while name == "Heartbeat":
                name, said = self._receive(sock, deadline)
            if name == "Refused":
                code = self.schema.errors[said["code"]]
                raise Refusal(error_of(code, f"the server at {self.address} refuses: {said['reason']}"), bool(said["retry"]))
            if name != "Welcome":
                raise NetworkError(f"the server at {self.address} said {name} before Welcome")
        except Refusal as refusal:
            sock.close()
            if self.generation or self._away is not None:
                raise
            raise refusal.error from None
        except (OSError, TesseraError) as error:
            sock.close()
            kind = Timeout if isinstance(error, Timeout) else NetworkError
            raise kind(f"no Tessera server at {self.address}: {error}") from None
        self.epoch, self.token = said["epoch"], said["token"]
        self.configuration = said["configuration"]
        self._heartbeat = max(0.001, said["heartbeat_ms"] / 1000)
        sock.setblocking(True)
        return sock

    def _break(self, sock: socket.socket) -> None:
        try:
            sock.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass

    def _run(self) -> None:
        try:
            while not self._closing:
                why: TesseraError
                try:
                    self._serve()
                    break
                except TesseraError as error:
                    why = error
                except OSError as error:
                    why = NetworkError(str(error.strerror or error))
                except Exception as error:  # of a callback, or a message that makes no sense: whoever waits is told
                    why = NetworkError(f"what the server sent makes no sense: {error!r}")
                if not self._return(NetworkError(f"the connection to the server at {self.address} ended: {why}")):
                    break
        finally:
            self._finish()

    def _finish(self) -> None:
        with self._state:
            self._ended = self._ended or NetworkError(f"the connection to the server at {self.address} has ended")
            self._fail(self._ended)
            self._state.notify_all()
        self._on_end(None if self._over or self._closing else self._ended)
        self._socket.close()
        os.close(self._wake_read)

    def _fail(self, error: TesseraError) -> None:
        pending, self._pending = self._pending, {}
        for future in pending.values():
            future.set_exception(error)

    def _return(self, why: NetworkError) -> bool:
        """Dials again until somebody welcomes us. False: it is all over."""
        self._socket.close()
        with self._state:
            if self._closing or self._ended is not None:
                return False
            self._away = why
            self._fail(NetworkError(f"{why} (whether what was asked for was done is not known)"))
        since, pause = time.monotonic(), _FIRST_PAUSE
        waits = select.poll()
        waits.register(self._wake_read, select.POLLIN)
        last: TesseraError = why
        while time.monotonic() < since + self.redial and not self._closing:
            try:
                sock = self._dial(time.monotonic() + self.timeout)
            except Refusal as refusal:
                last = refusal.error
                if not refusal.retry:
                    break
            except TesseraError as error:
                last = error
            else:
                with self._state:
                    self._socket, self._away = sock, None
                    self.generation += 1
                    self._echo = (0, 0)
                    self._state.notify_all()
                self._on_back()
                return True
            if waits.poll(pause * 1000):
                return False
            pause = min(2 * pause, _LONGEST_PAUSE)
        with self._state:
            self._ended = NetworkError(f"{why}; nobody has answered there for {time.monotonic() - since:.0f} s since: {last}")
        return False

    def _serve(self) -> None:
        """Reads until it is all over (returns) or the connection breaks (raises)."""
        sock = self._socket
        waits = select.poll()
        waits.register(sock, select.POLLIN)
        waits.register(self._wake_read, select.POLLIN)
        header: Optional[_wire.Header] = None
        target, got = memoryview(bytearray(_wire.HEADER_BYTES)), 0
        beat = heard = time.monotonic()
        while not self._closing:
            now = time.monotonic()
            if now >= beat:
                beat = now + self._heartbeat
                self._beat(sock, now)
            # Where this process stood still, what the server said meanwhile lies unread in the socket.
            if not waits.poll(max(0.0, beat - now) * 1000 + 0.5):
                if time.monotonic() - heard > _SERVER_LOST_AFTER:
                    raise NetworkError(f"the server was silent for {time.monotonic() - heard:.1f} s")
                continue
            if self._closing:
                return
            try:
                count = sock.recv_into(target[got:], 0, socket.MSG_DONTWAIT) if len(target) else 0
            except (BlockingIOError, InterruptedError):
                continue
            if count == 0 and len(target):
                raise NetworkError("the server closed the connection")
            heard = time.monotonic()
            got += count
            if got < len(target):
                continue
            if header is None:
                header = self._checked(_wire.Header(target))
                target, got = memoryview(bytearray(header.size)), 0
                if header.size:
                    continue
            name, said = self._message(header, target)
            header, target, got = None, memoryview(bytearray(_wire.HEADER_BYTES)), 0
            if self._hear(name, said, heard):
                return

    def _beat(self, sock: socket.socket, now: float) -> None:
        # Whoever is sending says that we live, with each byte.
        if not self._sending.acquire(blocking=False):
            return
        try:
            echo, at = self._echo
            now_ns = int(now * 1e9)
            self._send(sock, "Heartbeat", encode_message(self.schema.messages["Heartbeat"], {
                "sent_at_ns": now_ns, "echo_ns": echo, "held_ns": now_ns - at if echo else 0}), now + self.timeout)
        finally:
            self._sending.release()

    def _hear(self, name: str, said: dict[str, Any], now: float) -> bool:
        """True: it is all over."""
        if name == "Reply":
            with self._state:
                future = self._pending.pop(said["id"], None)
            if future is not None:
                future.set_result(said)
        elif name == "Heartbeat":
            self._echo = (said["sent_at_ns"], int(now * 1e9))
        elif name == "Refused":
            raise error_of(self.schema.errors[said["code"]], said["reason"])
        elif name == "Over":
            with self._state:
                self._over = True
                self._ended = NetworkError(f"the server at {self.address} is over: {said['reason']}")
            return True
        else:
            self._on_message(name, said)
        return False
