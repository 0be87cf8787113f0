"""Tessera: move what a display wall shows, from your own program.

    import tessera
    wall = tessera.connect("127.0.0.1:7000")
    wall.create("/crane", "Transform", translation=(0, 1, -2))
    wall["/crane"].translation = (1, 1, -2)      # returns when it is granted, raises when it is refused

README.md beside the sources has the rest; `help(tessera.Wall)` what a wall can do.
"""
from __future__ import annotations

from typing import Optional

from . import aio, colours
from ._described import Told
from ._edit import Edit
from ._subscription import Subscription
from ._wall import Wall
from .errors import (BadInput, LimitExceeded, NetworkError, NotFound, Refused, TesseraError, Timeout, UnknownField,
                     Unsupported)
from .objects import Node, Nodes, Object
from .shapes import Shape

__all__ = ["BadInput", "Edit", "LimitExceeded", "NetworkError", "Node", "Nodes", "NotFound", "Object", "Refused",
           "Shape", "Subscription",
           "TesseraError", "Timeout", "Told", "UnknownField", "Unsupported", "Wall", "aio", "colours", "connect"]


def connect(address: Optional[str] = None, *, token_file: Optional[str] = None, keys: Optional[str] = None,
            name: str = "python",
            timeout: float = 10.0, redial: float = 60.0) -> Wall:
    """A running wall: its server's "ADDR:PORT", or the link of its console ("http://127.0.0.1:PORT/?token=…",
    "https://…&authority=…"; `tessera-ctl link`); without one TESSERA_SERVER, `~/.config/tessera/server`, or the one
    wall of this machine. `token_file`: whose first line lets this program in; without it TESSERA_TOKEN,
    TESSERA_TOKEN_FILE, or what the server of this user has left on this machine. `keys`: the folder with a person's
    key, or that key's file (`tessera-keys person`): for servers of other machines, and instead of a token. `name`: for
    the server's log. `timeout`: of each answer, s. `redial`: for how long a connection that broke is dialled again,
    s."""
    return Wall(address, token_file=token_file, keys=keys, name=name, timeout=timeout, redial=redial)
