"""Which server is meant, and what lets us in there: what servers leave for programs of their own user
(common/access/README.md)."""
from __future__ import annotations

import fcntl
import ipaddress
import os
import re
import stat
import struct
from typing import NamedTuple, Optional

from .errors import BadInput, NotFound

_MOST_BYTES = 4096
_SERVICE_FOLDER = "/run/tessera"  # of a server that the system runs
_TOKEN = re.compile("[A-Za-z0-9_-]{16,128}")


class LocalWall(NamedTuple):
    """A server of this user that runs now on this machine."""

    address: str
    token: str  #: an operator's


def is_token(word: str) -> bool:
    return _TOKEN.fullmatch(word) is not None


def _run_folder() -> str:
    """Where a server of this user tells of itself; it need not be there."""
    said = os.environ.get("XDG_RUNTIME_DIR", "")
    if said.startswith("/"):
        return os.path.join(said, "tessera")
    users = f"/run/user/{os.geteuid()}"
    try:
        info = os.lstat(users)
        if stat.S_ISDIR(info.st_mode) and info.st_uid == os.geteuid():
            return os.path.join(users, "tessera")
    except OSError:
        pass
    return f"/tmp/tessera-{os.geteuid()}"


def _lines(text: str) -> dict[str, str]:
    """Lines "word rest", the last one "end": what is torn is as if it were not there."""
    if not text.endswith("\nend\n"):
        return {}
    return {word: rest for word, space, rest in (line.partition(" ") for line in text.split("\n")) if space}


def _read(path: str, owner: int) -> dict[str, str]:
    """The lines of a server of `owner` that runs now; of any other nothing."""
    try:
        file = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK)
    except OSError:
        return {}
    try:
        info = os.fstat(file)
        # A group may read it, and nobody but its owner has written it.
        if not stat.S_ISREG(info.st_mode) or info.st_uid != owner or info.st_mode & 0o037:
            return {}
        # A struct flock: who holds a lock on all of it? The server does as long as it runs.
        asked = struct.pack("hhqqi", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
        lock = struct.unpack("hhqqi", fcntl.fcntl(file, fcntl.F_OFD_GETLK, asked))
        text = os.pread(file, _MOST_BYTES, 0).decode("utf-8", "replace")
    except OSError:
        return {}
    finally:
        os.close(file)
    return {} if lock[0] == fcntl.F_UNLCK else _lines(text)


def _walls_in(folder: str, owner: Optional[int]) -> list[LocalWall]:
    """`owner`: of all of them; none: that of the folder."""
    try:
        info = os.lstat(folder)
        if not stat.S_ISDIR(info.st_mode) or owner not in (None, info.st_uid) or info.st_mode & 0o026:
            return []
        names = sorted(name for name in os.listdir(folder) if name.endswith(".wall"))
    except OSError:
        return []
    told = [_read(os.path.join(folder, name), info.st_uid) for name in names]
    return [LocalWall(each["server"], each["token"]) for each in told if "server" in each
            and is_token(each.get("token", ""))]


def local_walls() -> list[LocalWall]:
    """Those of this machine and user, in the order of their names; then those of the system's service, where this user
    may read them."""
    folder = _run_folder()
    own = _walls_in(folder, os.geteuid())
    return own if folder == _SERVICE_FOLDER else own + _walls_in(_SERVICE_FOLDER, None)


def server_file() -> str:
    """Where this user may name a server: `$XDG_CONFIG_HOME/tessera/server`, else `~/.config/tessera/server`; empty:
    this user has no home."""
    folder = os.environ.get("XDG_CONFIG_HOME", "")
    if not folder.startswith("/"):
        home = os.environ.get("HOME", "")
        folder = home + "/.config" if home.startswith("/") else ""
    return folder and folder + "/tessera/server"


def _named_in_file(path: str) -> Optional[str]:
    """A line ADDR:PORT, and lines that begin with #; None: there is no such file. BadInput: it names no server."""
    if not path:
        return None
    advice = "; write a line ADDR:PORT, or take the file away"
    try:
        file = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
        try:
            text = os.pread(file, _MOST_BYTES + 1, 0)
        finally:
            os.close(file)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror}{advice}") from None
    if len(text) > _MOST_BYTES:
        raise BadInput(f"{path}: it has more than {_MOST_BYTES} bytes{advice}")
    lines = [line.strip() for line in text.decode("utf-8", "replace").split("\n")]
    named = [line for line in lines if line and not line.startswith("#")]
    if len(named) != 1:
        raise BadInput(f"{path}: it names {'more than one' if named else 'no'} server{advice}")
    if ":" not in named[0]:
        raise BadInput(f"{path}: \"{named[0]}\" is not an address{advice}")
    return named[0]


def address_of(address: Optional[str]) -> str:
    """The one that is said, else TESSERA_SERVER, else that in this user's file, else the one wall of this machine."""
    said = address or os.environ.get("TESSERA_SERVER") or _named_in_file(server_file())
    if said:
        return said
    found = [wall.address for wall in local_walls()]
    if len(found) == 1:
        return found[0]
    if found:
        raise NotFound(f"there are {len(found)} walls on this machine: {', '.join(found)}; say "
                       f"tessera.connect(\"ADDR:PORT\")")
    raise NotFound("no wall of this user runs on this machine: say tessera.connect(\"ADDR:PORT\") as the server "
                   "prints it, or set TESSERA_SERVER")


def read_token(path: str) -> str:
    """The word in a file: its first line, or in what a server has left for its own user that of an operator."""
    try:
        file = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
        try:
            text = os.pread(file, _MOST_BYTES, 0).decode("utf-8", "replace")
        finally:
            os.close(file)
    except (OSError, ValueError) as error:
        raise BadInput(f"the file with a token {path}: {getattr(error, 'strerror', None) or error}") from None
    word = _lines(text).get("token", "")
    if not is_token(word):
        word = re.split("[\r\n]", text, maxsplit=1)[0]
    if not is_token(word):
        raise BadInput(f"the file with a token {path}: its first line is no token (16 to 128 letters, digits, - and _)")
    return word


def _leads_to(peer: str, port: int, listening: str, near: bool) -> bool:
    """Whether a connection to `peer` ends at who listens there, all addresses of this machine among them."""
    host, _, number = listening.rpartition(":")
    host = host.strip("[]")
    if number != str(port):
        return False
    if host in ("0.0.0.0", "::"):
        return near
    try:
        here = ipaddress.ip_address("127.0.0.1" if host == "localhost" else host)
        there = ipaddress.ip_address(peer.partition("%")[0])
    except ValueError:
        return False
    return (getattr(there, "ipv4_mapped", None) or there) == here


def access_to(peer: str, port: int, near: bool, token_file: Optional[str] = None) -> str:
    """What lets a program of this user in at a server: the word in `token_file`, else TESSERA_TOKEN, else the word in
    the file that TESSERA_TOKEN_FILE names, else that of the server of this user that listens at that very address.
    `peer`: the other end of a connection; `near`: it is one of this machine's own addresses. Empty: it goes without
    one."""
    word = os.environ.get("TESSERA_TOKEN")
    if word and not token_file:
        if not is_token(word):
            raise BadInput("TESSERA_TOKEN is no token (16 to 128 letters, digits, - and _)")
        return word
    named = token_file or os.environ.get("TESSERA_TOKEN_FILE")
    if named:
        return read_token(named)
    return next((wall.token for wall in local_walls() if _leads_to(peer, port, wall.address, near)), "")
