"""Which server is meant, and what lets one in."""
from __future__ import annotations

import os
from typing import Optional

from .errors import NotFound


def _credentials(address: str) -> Optional[bytes]:
    """What the server at this address wants to see of this user: the token that it has left in a file for its own user. None: it wants
    nothing. (The hook of the token file; Link keeps what this returns, and Hello is where it goes.)"""
    return None


def _discover() -> list[str]:
    """Addresses of the walls of this machine and user. (The hook of discovery.)"""
    return []


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
    raise NotFound("no wall is known: say tessera.connect(\"ADDR:PORT\") as the server prints it, or set TESSERA_SERVER")
