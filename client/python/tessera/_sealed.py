"""TLS 1.3 over a socket: whom a program believes, and by which key it is known itself (common/tls has the same in
C++)."""
from __future__ import annotations

import hashlib
import os
import re
import socket
import ssl
import stat
import threading
import time
from typing import Any, Iterator, Optional, Sequence

from .errors import BadInput, NetworkError, NotFound, Refused, TesseraError, Timeout

_AT_ONCE = 1 << 16
_SERVER = re.compile("tessera://[^/]+/server")
_PERSON, _ENDING, _AUTHORITY = "person-", ".pem", "authority.crt"


class Sealed:
    """As much of a socket as channels use. One thread sends at a time, and one receives: OpenSSL itself bears one
    alone.

    What TLS has to say of itself goes with the next message that is sent."""

    def __init__(self, sock: socket.socket, context: ssl.SSLContext, host: Optional[str], deadline: float) -> None:
        """Shakes hands. NetworkError: the other side is not believed, or it speaks no TLS 1.3."""
        self.socket = sock  #: for who sends what `seal` made
        self._in, self._out = ssl.MemoryBIO(), ssl.MemoryBIO()
        self._object = context.wrap_bio(self._in, self._out, server_hostname=host)
        self._lock = threading.Lock()
        self._clear = bytearray()  # has come, and nobody has taken it
        self._over = False
        try:
            while not self._shaken(deadline):
                pass
        except TimeoutError:
            raise Timeout("it did not answer in time") from None
        sock.setblocking(True)

    def _shaken(self, deadline: float) -> bool:
        done = False
        try:
            self._object.do_handshake()
            done = True
        except ssl.SSLWantReadError:
            pass
        except ssl.SSLCertVerificationError as error:
            self._say(deadline)  # why
            raise Distrust(f"its certificate is not believed: {error.verify_message}") from None
        except ssl.SSLError as error:
            raise NetworkError(f"it does not speak TLS 1.3 ({error.reason or error})") from None
        self._say(deadline)
        if not done:
            self._socket_waits(deadline)
            data = self.socket.recv(_AT_ONCE)
            if not data:
                raise NetworkError("it ended the handshake (TLS 1.3): has the server keys, and is it a Tessera?")
            self._in.write(data)
        return done

    def _socket_waits(self, deadline: float) -> None:
        left = deadline - time.monotonic()
        if left <= 0:
            raise TimeoutError
        self.socket.settimeout(left)

    def _say(self, deadline: float) -> None:
        if self._out.pending:
            self._socket_waits(deadline)
            self.socket.sendall(self._out.read())

    def names(self) -> list[str]:
        """The URIs in the certificate of the other side, where it was looked at."""
        certificate: Any = self._object.getpeercert() or {}
        return [str(name) for kind, name in certificate.get("subjectAltName", ()) if kind == "URI"]

    @property
    def pending(self) -> bool:
        return len(self._clear) > 0

    def seal(self, pieces: Sequence[Any]) -> Iterator[bytes]:
        """What is to be sent for them, in order."""
        message = bytearray()
        for piece in pieces:
            view = memoryview(piece).cast("B")
            while len(view):
                room = _AT_ONCE - len(message)
                message += view[:room]
                view = view[room:]
                if len(message) == _AT_ONCE:
                    yield self._seal(message)
                    message = bytearray()
        if message:
            yield self._seal(message)

    def _seal(self, message: bytearray) -> bytes:
        with self._lock:
            view = memoryview(message)
            try:
                while len(view):
                    view = view[self._object.write(view):]
            except ssl.SSLError as error:
                raise NetworkError(f"nothing more can be sent (TLS: {error.reason or error})") from None
            return self._out.read()

    def recv(self, size: int, flags: int = 0) -> bytes:
        data = bytearray(size)
        return bytes(data[:self.recv_into(memoryview(data))])

    def recv_into(self, into: memoryview, size: int = 0, flags: int = 0) -> int:
        """Does not wait. BlockingIOError: nothing has come; 0: the other end has closed."""
        with self._lock:
            if self._clear:
                count = min(len(into), len(self._clear))
                into[:count] = self._clear[:count]
                del self._clear[:count]
                return count
            while not self._over and len(into):
                data = self.socket.recv(_AT_ONCE, socket.MSG_DONTWAIT)
                if not data:
                    self._over = True
                    break
                self._in.write(data)
                count = self._read(into)
                if count:
                    return count
            return 0

    def _read(self, into: memoryview) -> int:
        """All that can be read now: polling shows none of it."""
        got = 0
        reader: Any = self._object  # as annotated it wants an array of its own kind to read into
        try:
            while not self._over:
                if got < len(into):
                    count = int(reader.read(len(into) - got, into[got:]))
                    got += count
                else:
                    more = self._object.read(_AT_ONCE)
                    count = len(more)
                    self._clear += more
                self._over = not count
        except ssl.SSLWantReadError:
            pass
        except ssl.SSLError as error:
            self._over = True
            if not got:
                raise NetworkError(f"the server ended the connection (TLS: {error.reason or error})") from None
        return got

    def fileno(self) -> int:
        return self.socket.fileno()

    def getpeername(self) -> Any:
        return self.socket.getpeername()

    def getsockname(self) -> Any:
        return self.socket.getsockname()

    def shutdown(self, how: int) -> None:
        self.socket.shutdown(how)

    def close(self) -> None:
        self.socket.close()


class Distrust(NetworkError):
    """Inside: the other side is not who it has to be, which dialling again does not change."""


def _context() -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    context.check_hostname = False
    return context


def believing_nobody() -> ssl.SSLContext:
    """For what anybody may see, and is looked at afterwards."""
    context = _context()
    context.verify_mode = ssl.CERT_NONE
    return context


def believing_the_system() -> ssl.SSLContext:
    """As a browser does: the host's name is looked at, too."""
    context = ssl.create_default_context()
    context.minimum_version = ssl.TLSVersion.TLSv1_3
    return context


def believing(authority: str) -> ssl.SSLContext:
    """Whatever this wall's authority (PEM) has made, at any address."""
    context = _context()
    try:
        context.load_verify_locations(cadata=authority)
    except (ssl.SSLError, ValueError) as error:
        raise BadInput(f"the authority's certificate cannot be read: "
                       f"{getattr(error, 'reason', None) or error}") from None
    return context


def fingerprint(pem: str) -> str:
    """SHA-256, hexadecimal; empty: it is no certificate."""
    try:
        return hashlib.sha256(ssl.PEM_cert_to_DER_cert(pem.strip())).hexdigest()
    except ValueError:
        return ""


def sealed_to_server(sock: socket.socket, context: ssl.SSLContext, deadline: float) -> Sealed:
    """Its authority has made certificates for others, too: hosts and people are no servers."""
    sealed = Sealed(sock, context, None, deadline)
    names = sealed.names()
    if len(names) != 1 or not _SERVER.fullmatch(names[0]):
        raise Distrust(f"it shows the certificate of {', '.join(names) or 'somebody else than a wall'}, and not of a "
                       f"wall's server")
    return sealed


class PersonKey:
    """A person's key as `tessera-keys` wrote it: read anew for each connection, so that a renewed one counts."""

    def __init__(self, place: str) -> None:
        self._place = place
        self.context()

    def _file(self) -> str:
        name = os.path.basename(self._place)
        if name.startswith(_PERSON) and name.endswith(_ENDING):
            return self._place
        try:
            found = sorted(each for each in os.listdir(self._place) if each.startswith(_PERSON)
                           and each.endswith(_ENDING))
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or error
            raise NotFound(f"{self._place}: {why}; keys= names a folder, or the file of a person's key") from None
        if not found:
            raise NotFound(f"{self._place}: no key of a person is there: tessera-keys person NAME --role ROLE makes "
                           f"one, on the server")
        if len(found) > 1:
            raise BadInput(f"{self._place}: the keys of several people are there ({', '.join(found)}): say whose")
        return os.path.join(self._place, found[0])

    def context(self) -> ssl.SSLContext:
        file = self._file()
        authority = os.path.join(os.path.dirname(file), _AUTHORITY)
        try:
            info = os.stat(file)
            if not stat.S_ISREG(info.st_mode):
                raise BadInput(f"{file}: is no file")
            if info.st_uid not in (os.geteuid(), 0) or info.st_mode & 0o077:
                raise Refused(f"{file}: others may read this key, or it is somebody else's: chmod 600 {file}")
            with open(authority, encoding="ascii", errors="replace") as text:
                context = believing(text.read(_AT_ONCE))
            context.load_cert_chain(file, password=_no_password)
        except ssl.SSLError as error:
            raise BadInput(f"{file}: holds no key and its certificate ({error.reason or error})") from None
        except (OSError, ValueError) as error:
            if isinstance(error, TesseraError):
                raise
            raise NotFound(f"{getattr(error, 'filename', None) or file}: "
                           f"{getattr(error, 'strerror', None) or error}") from None
        return context


def _no_password() -> str:
    raise BadInput("it is locked with a password")  # nobody is asked
