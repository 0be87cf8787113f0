"""Which server is meant: what servers leave for programs of their own user (common/access/README.md)."""
from __future__ import annotations

import fcntl
import os
import stat
import struct
import tempfile
from typing import Optional

from .errors import NotFound

_MOST_BYTES = 4096


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
    return os.path.join(tempfile.gettempdir(), f"tessera-{os.geteuid()}")


def _is_own(info: os.stat_result) -> bool:
    return info.st_uid == os.geteuid() and info.st_mode & 0o077 == 0


def _read(path: str) -> dict[str, str]:
    """The lines of a server that runs now; of any other nothing."""
    try:
        file = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK)
    except OSError:
        return {}
    try:
        info = os.fstat(file)
        if not stat.S_ISREG(info.st_mode) or not _is_own(info):
            return {}
        # A struct flock: who holds a lock on all of it? The server does as long as it runs.
        asked = struct.pack("hhqqi", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
        lock = struct.unpack("hhqqi", fcntl.fcntl(file, fcntl.F_OFD_GETLK, asked))
        text = os.pread(file, _MOST_BYTES, 0).decode("utf-8", "replace")
    except OSError:
        return {}
    finally:
        os.close(file)
    if lock[0] == fcntl.F_UNLCK or not text.endswith("\nend\n"):
        return {}
    return {word: rest for word, space, rest in (line.partition(" ") for line in text.split("\n")) if space}


def _discover() -> list[str]:
    """Addresses of the walls of this machine and user."""
    folder = _run_folder()
    try:
        info = os.lstat(folder)
        if not stat.S_ISDIR(info.st_mode) or not _is_own(info):
            return []
        names = sorted(name for name in os.listdir(folder) if name.endswith(".wall"))
    except OSError:
        return []
    found = [_read(os.path.join(folder, name)).get("server", "") for name in names]
    return [address for address in found if address]


def address_of(address: Optional[str]) -> str:
    """The one that is said, else TESSERA_SERVER, else the one wall of this machine."""
    said = address or os.environ.get("TESSERA_SERVER")
    if said:
        return said
    found = _discover()
    if len(found) == 1:
        return found[0]
    if found:
        raise NotFound(f"there are {len(found)} walls on this machine: {', '.join(found)}; say tessera.connect(\"ADDR:PORT\")")
    raise NotFound("no wall of this user runs on this machine: say tessera.connect(\"ADDR:PORT\") as the server prints it, or set TESSERA_SERVER")
