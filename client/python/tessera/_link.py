"""The native link to one server: Hello and Welcome, heartbeats, requests and their replies, and the return after a
break.

A thread of its own reads, answers heartbeats and dials again; requests are written by whoever asks. Any thread may call
anything.
"""
from __future__ import annotations

import os
import select
import threading
import time
import weakref
from concurrent.futures import Future
from typing import Any, Callable, Optional, Sequence

from . import _wire
from ._channel import Channel, Refusal, Way, receive_all
from ._described import decode_message, encode_message
from ._schema import Schema
from .errors import LimitExceeded, NetworkError, TesseraError, Timeout, error_of

CONTROL, BULK = 0, 1
_APPLICATION = 1
_SERVER_LOST_AFTER = 5.0  # s of silence, as the C++ library has it
_FIRST_PAUSE, _LONGEST_PAUSE = 0.05, 1.0  # s between a dial that failed and the next


class Stale(TesseraError):
    """Inside: a request names numbers from before a return; `generation`: since the last one."""

    def __init__(self, generation: int) -> None:
        super().__init__("found before the connection broke")
        self.generation = generation


def _settle(future: "Future[dict[str, Any]]", said: Optional[dict[str, Any]] = None,
            error: Optional[TesseraError] = None) -> None:
    """Nobody may wait for it any more: asyncio cancels what is cancelled there."""
    if not future.set_running_or_notify_cancel():
        return
    if error is not None:
        future.set_exception(error)
    elif said is not None:
        future.set_result(said)


_links: "weakref.WeakSet[Link]" = weakref.WeakSet()


def _forked() -> None:
    for link in list(_links):
        link._leave_to_parent()


os.register_at_fork(after_in_child=_forked)


class Link:
    """One control connection. `on_message(name, members)` is called by the thread that reads, `on_back` there after a
    return."""

    def __init__(self, schema: Schema, way: Way, *, name: str, timeout: float, redial: float, follows: bool,
                 on_message: Callable[[str, dict[str, Any]], None], on_back: Callable[[], None],
                 on_end: Callable[[Optional[TesseraError]], None]) -> None:
        self.schema, self.way, self.name, self.timeout, self.redial, self.follows = (
            schema, way, name, timeout, redial, follows)
        self.address = way.address
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
        try:
            self._channel = self._dial(time.monotonic() + timeout)
        except Refusal as refusal:
            raise refusal.error from None
        self._wake_read, self._wake_write = os.pipe()
        self._thread = threading.Thread(target=self._run, name=f"tessera {self.address}", daemon=True)
        self._thread.start()
        _links.add(self)

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

    def request(self, body: _wire.Chain, uploads: Sequence[_wire.Chain] = (), timeout: Optional[float] = None,
                since: Optional[int] = None) -> "Future[dict[str, Any]]":
        """Sends it, after the return where the link is broken. The reply's members come with the future, and the
        `generation` of its numbers. `since`: the generation of those that the request names; where it has passed, Stale
        is raised and nothing is sent."""
        if body.size > self.schema.limits["request_bytes"]:
            raise LimitExceeded(f"the request has {body.size} bytes, and {self.schema.limits['request_bytes']} is the "
                                f"most")
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
                    raise self._ended.with_traceback(None)  # else it would grow from call to call
                if since is not None and since != self.generation:
                    raise Stale(self.generation)
                self._last_request += 1
                number = self._last_request
                self._pending[number] = future
                channel = self._channel
            try:
                for piece in uploads:
                    self._send(channel, "Upload", piece, deadline)
                self._send(channel, "Request",
                           encode_message(self.schema.messages["Request"], {"id": number, "body": body}), deadline)
            except Timeout:
                channel.abort()  # a message was cut off
                raise
            except OSError:
                # Why it ended may lie unread: whoever reads comes to the end, and settles the future.
                channel.abort()
        finally:
            self._sending.release()
        return future

    def answer(self, future: "Future[dict[str, Any]]", timeout: Optional[float] = None) -> dict[str, Any]:
        """Waits for a reply. Raises what the server refused with."""
        wait = self.timeout if timeout is None else timeout
        try:
            reply = future.result(wait)
        except TesseraError:
            raise
        except TimeoutError:
            raise Timeout(f"the server at {self.address} did not answer within {wait:g} s") from None
        return self.granted(reply)

    def granted(self, reply: dict[str, Any]) -> dict[str, Any]:
        if reply["error"]:
            codes = self.schema.errors
            raise error_of(codes[reply["code"]] if reply["code"] < len(codes) else "failed", reply["error"])
        return reply

    def say(self, name: str, values: dict[str, Any]) -> None:
        """Of the thread that reads: a message that nobody waits for."""
        with self._sending:
            try:
                self._send(self._channel, name, encode_message(self.schema.messages[name], values),
                           time.monotonic() + self.timeout)
            except (OSError, TesseraError):
                self._channel.abort()

    def open_bulk(self, deadline: float) -> Channel:
        """A second channel, for arrays."""
        try:
            channel = self.way.open(deadline)
        except Refusal as refusal:
            raise refusal.error from None
        try:
            self._send(channel, "Hello", self._hello(BULK, ""), deadline)
        except BaseException:
            channel.close()
            raise
        return channel

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

    def _leave_to_parent(self) -> None:
        """In the child of a fork: the connection is the parent's, as is the thread that reads. Locks may be held by
        threads that are not here."""
        self._sending, self._state = threading.Lock(), threading.Condition()
        self._ended = NetworkError("this wall was opened before the process forked, and is its parent's: connect anew "
                                   "in the child")
        self._closing = True
        self._pending = {}

    def _hello(self, channel: int, access: str) -> _wire.Chain:
        return encode_message(self.schema.messages["Hello"], {
            "protocol": self.schema.protocol, "schema": self.schema.schema, "role": _APPLICATION, "channel": channel,
            "name": self.name,
            "follows": self.follows, "token": self.token if channel == BULK else (0, 0),
            "seen_epoch": self.epoch if channel == CONTROL else 0,
            "access": access})

    def _send(self, channel: Channel, name: str, payload: _wire.Chain, deadline: float) -> None:
        header = _wire.header_of(self.schema.messages[name].number, self.epoch if name != "Hello" else 0, payload)
        channel.send([header, *payload.pieces], deadline)

    def _receive(self, channel: Channel, deadline: float) -> tuple[str, dict[str, Any]]:
        data = memoryview(bytearray(_wire.HEADER_BYTES))
        receive_all(channel, data, deadline)
        header = self._checked(_wire.Header(data))
        payload = memoryview(bytearray(header.size))
        receive_all(channel, payload, deadline)
        return self._message(header, payload)

    def _checked(self, header: _wire.Header) -> _wire.Header:
        if header.size > self.schema.most_bytes.get(header.kind, 0):
            raise NetworkError(f"the server announced a message of type {header.kind} with {header.size} bytes")
        return header

    def _message(self, header: _wire.Header, payload: memoryview) -> tuple[str, dict[str, Any]]:
        header.check(payload)
        name = self.schema.message_names[header.kind]
        return name, decode_message(self.schema.messages[name], payload)

    def _dial(self, deadline: float) -> Channel:
        """One that has been welcomed. Refusal: it has not, and why."""
        channel = self.way.open(deadline)
        try:
            # The word is asked for each time: another server may have come instead.
            said = self._welcome(channel, self.way.access(channel), deadline)
        except BaseException:
            channel.close()
            raise
        self.epoch, self.token = said["epoch"], said["token"]
        self.configuration = said["configuration"]
        self._heartbeat = max(0.001, said["heartbeat_ms"] / 1000)
        return channel

    def _welcome(self, channel: Channel, access: str, deadline: float) -> dict[str, Any]:
        try:
            self._send(channel, "Hello", self._hello(CONTROL, access), deadline)
            name, said = self._receive(channel, deadline)
            while name == "Heartbeat":
                name, said = self._receive(channel, deadline)
        except (OSError, TesseraError) as error:
            kind = Timeout if isinstance(error, Timeout) else NetworkError
            raise kind(f"no Tessera server at {self.address}: {error}") from None
        if name == "Refused":
            raise Refusal(error_of(self.schema.errors[said["code"]],
                                   f"the server at {self.address} refuses: {said['reason']}"), bool(said["retry"]))
        if name != "Welcome":
            raise NetworkError(f"no Tessera server at {self.address}: it said {name} before Welcome")
        return said

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
        self._channel.close()
        os.close(self._wake_read)

    def _fail(self, error: TesseraError) -> None:
        pending, self._pending = self._pending, {}
        for future in pending.values():
            _settle(future, error=error)

    def _return(self, why: NetworkError) -> bool:
        """Dials again until somebody welcomes us. False: it is all over."""
        self._channel.close()
        with self._state:
            if self._closing or self._ended is not None:
                return False
            self._away = why
            self._fail(NetworkError(f"{why} (whether what was asked for was done is not known)"))
        since, pause = time.monotonic(), _FIRST_PAUSE
        waits = select.poll()
        waits.register(self._wake_read, select.POLLIN)
        last: TesseraError = why
        refused: Optional[TesseraError] = None
        while time.monotonic() < since + self.redial and not self._closing:
            try:
                channel = self._dial(time.monotonic() + self.timeout)
            except Refusal as refusal:
                last = refusal.error
                if not refusal.retry:
                    refused = type(last)(f"{why}; {last}")
                    break
            except TesseraError as error:
                last = error
            else:
                with self._state:
                    self._channel, self._away = channel, None
                    self.generation += 1
                    self._echo = (0, 0)
                    self._state.notify_all()
                self._on_back()
                return True
            if waits.poll(pause * 1000):
                return False
            pause = min(2 * pause, _LONGEST_PAUSE)
        with self._state:
            self._ended = (refused or NetworkError(
                f"{why}; nobody has answered there for {time.monotonic() - since:.0f} s since: {last}"))
        return False

    def _serve(self) -> None:
        """Reads until it is all over (returns) or the connection breaks (raises)."""
        channel = self._channel
        waits = select.poll()
        waits.register(channel, select.POLLIN)
        waits.register(self._wake_read, select.POLLIN)
        header: Optional[_wire.Header] = None
        target, got = memoryview(bytearray(_wire.HEADER_BYTES)), 0
        beat = heard = time.monotonic()
        while not self._closing:
            now = time.monotonic()
            if now >= beat:
                beat = now + self._heartbeat
                self._beat(channel, now)
            # Where this process stood still, what the server said meanwhile lies unread in the channel.
            if not channel.pending and not waits.poll(max(0.0, beat - now) * 1000 + 0.5):
                if time.monotonic() - heard > _SERVER_LOST_AFTER:
                    raise NetworkError(f"the server was silent for {time.monotonic() - heard:.1f} s")
                continue
            if self._closing:
                return
            count = channel.some(target[got:])
            if count is None:
                continue
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

    def _beat(self, channel: Channel, now: float) -> None:
        # Whoever is sending says that we live, with each byte.
        if not self._sending.acquire(blocking=False):
            return
        try:
            echo, at = self._echo
            now_ns = int(now * 1e9)
            self._send(channel, "Heartbeat", encode_message(self.schema.messages["Heartbeat"], {
                "sent_at_ns": now_ns, "echo_ns": echo, "held_ns": now_ns - at if echo else 0}), now + self.timeout)
        except Timeout:
            raise
        except OSError:
            channel.abort()  # and then reads why
        finally:
            self._sending.release()

    def _hear(self, name: str, said: dict[str, Any], now: float) -> bool:
        """True: it is all over."""
        if name == "Reply":
            with self._state:
                future = self._pending.pop(said["id"], None)
            said["generation"] = self.generation
            if future is not None:
                _settle(future, said)
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
