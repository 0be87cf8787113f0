"""How bytes reach a server: a channel of the link (plain TCP here, `_tunnel` has the other kind), and the ways that
open one."""
from __future__ import annotations

import abc
import ipaddress
import select
import socket
import time
from typing import Any, Optional, Sequence, Union

from . import _door
from ._sealed import Distrust, PersonKey, Sealed, sealed_to_server
from .errors import BadInput, NetworkError, TesseraError, Timeout

_MOST_PIECES = 256  # of one sendmsg


class Refusal(TesseraError):
    """Inside: the server has refused in words. `retry`: it may take us later."""

    def __init__(self, error: TesseraError, retry: bool) -> None:
        super().__init__(str(error))
        self.error, self.retry = error, retry


Stream = Union[socket.socket, Sealed]


class Channel:
    """Bytes in both directions, over TCP. One thread sends at a time, and one receives; any may abort."""

    def __init__(self, sock: Stream) -> None:
        self._socket = sock

    def fileno(self) -> int:
        """Readable: `some` has something, or raises."""
        return self._socket.fileno()

    @property
    def pending(self) -> bool:
        """Bytes have come that polling does not show."""
        return isinstance(self._socket, Sealed) and self._socket.pending

    @property
    def peer(self) -> str:
        """The number of the other end; empty: it has gone."""
        try:
            return str(self._socket.getpeername()[0])
        except OSError:
            return ""

    @property
    def near(self) -> bool:
        """The other end is on this machine."""
        try:
            peer, own = self._socket.getpeername()[0], self._socket.getsockname()[0]
        except OSError:
            return False
        return bool(peer == own or ipaddress.ip_address(peer.partition("%")[0]).is_loopback)

    def send(self, pieces: Sequence[Any], deadline: float) -> None:
        """Raises Timeout where the peer does not take it by then: what was begun is then cut off, and the link is
        useless."""
        send_all(self._socket, pieces, deadline)

    def some(self, into: memoryview) -> Optional[int]:
        """How many bytes of what has come now lie in `into`; None: nothing has. NetworkError: the other end has
        closed."""
        try:
            count = self._socket.recv_into(into, 0, socket.MSG_DONTWAIT)
        except (BlockingIOError, InterruptedError):
            return None
        if count == 0 and len(into):
            raise NetworkError("the server closed the connection")
        return count

    def abort(self) -> None:
        """Whoever waits here is told that it has ended."""
        try:
            self._socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass

    def close(self) -> None:
        self._socket.close()


def _polled(sock: Union[Stream, Channel], for_what: int) -> select.poll:
    poll = select.poll()
    try:
        poll.register(sock, for_what)
    except ValueError:  # another thread has closed it
        raise NetworkError("the connection has been closed") from None
    return poll


def send_all(sock: Stream, pieces: Sequence[Any], deadline: float) -> None:
    if isinstance(sock, Sealed):
        for sealed in sock.seal(pieces):
            send_all(sock.socket, [sealed], deadline)
        return
    left = [memoryview(piece).cast("B") for piece in pieces]
    ready = _polled(sock, select.POLLOUT)
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


def receive_all(channel: Channel, into: memoryview, deadline: float) -> None:
    ready = _polled(channel, select.POLLIN)
    got = 0
    while got < len(into):
        count = channel.some(into[got:])
        if count is not None:
            got += count
        elif not ready.poll(max(0.0, deadline - time.monotonic()) * 1000) and time.monotonic() >= deadline:
            raise Timeout("it did not answer in time")


class Way(abc.ABC):
    """How a server is reached: what `tessera.connect` was told."""

    address: str  #: for messages: no secret is in it

    @abc.abstractmethod
    def open(self, deadline: float) -> Channel:
        """A fresh channel. NetworkError: nobody is there; Refusal: who is there says no."""

    @abc.abstractmethod
    def access(self, channel: Channel) -> str:
        """The word that lets us in at the other end of a channel that was opened; empty: there is none."""


def connected(place: tuple[str, int], deadline: float) -> socket.socket:
    sock = socket.create_connection(place, max(0.001, deadline - time.monotonic()))
    sock.setblocking(True)
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return sock


def split_address(address: str) -> tuple[str, int]:
    host, colon, port = address.rpartition(":")
    if not colon or not port.isdecimal() or not 0 < int(port) < 65536:
        raise BadInput(f"\"{address.partition('?')[0]}\" is no address; write HOST:PORT, as the server prints it")
    return host.strip("[]") or "127.0.0.1", int(port)


class ByPort(Way):
    """Over TCP, to the port where a server listens; sealed where there is a key."""

    def __init__(self, address: str, token_file: Optional[str], keys: Optional[str] = None) -> None:
        self.address = address
        self._place = split_address(address)
        self._token_file = token_file
        self._key = PersonKey(keys) if keys else None

    def open(self, deadline: float) -> Channel:
        try:
            sock = connected(self._place, deadline)
        except OSError as error:
            raise NetworkError(f"no Tessera server at {self.address}: {error.strerror or error}") from None
        if self._key is None:
            return Channel(sock)
        try:
            return Channel(sealed_to_server(sock, self._key.context(), deadline))
        except BaseException as error:
            sock.close()
            if isinstance(error, Distrust):
                raise Refusal(NetworkError(f"no way in at the server at {self.address}: {error}"), False) from None
            if isinstance(error, OSError):
                kind = Timeout if isinstance(error, Timeout) else NetworkError
                raise kind(f"no Tessera server at {self.address}: {error}") from None
            raise

    def access(self, channel: Channel) -> str:
        if self._key is not None:
            return ""
        # Of the connection that there is, not of a name: a token of this machine goes nowhere else, where others could
        # read it.
        word = _door.access_to(channel.peer, self._place[1], channel.near, self._token_file)
        return word if channel.near else ""
