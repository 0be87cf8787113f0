"""The same for asyncio: `wall = await tessera.aio.connect("ADDR:PORT")`.

Thin over the same link: its thread reads and answers heartbeats; requests are awaited as its futures, and what takes
several of them runs on a thread of the wall's own. All members belong to the loop that connected.
"""
from __future__ import annotations

import asyncio
import functools
from concurrent.futures import ThreadPoolExecutor
from typing import Any, AsyncIterator, Callable, Optional, TypeVar

import numpy as np

from ._types import Array, seconds
from ._described import Told, encode
from ._subscription import Subscription
from ._wall import Wall as _Wall
from .errors import BadInput, Timeout
from .objects import Node, Nodes, Object

T = TypeVar("T")


class Wall:
    """`await wall.set("/crane", translation=(1, 2, 3))`, `await wall.fields("/crane")`, `async for frame in
    wall.follow("frames")`."""

    def __init__(self, wall: _Wall, pool: ThreadPoolExecutor) -> None:
        self.wall = wall  #: the plain one: its nodes, and what is missing here, by `await wall.run(function)`
        self._pool = pool

    async def run(self, function: Callable[..., T], *args: Any, **kwargs: Any) -> T:
        """Anything that waits, beside the loop: `await wall.run(lambda: wall.wall["/crane"].clone())`."""
        return await asyncio.get_running_loop().run_in_executor(
            self._pool, functools.partial(function, *args, **kwargs))

    async def ask(self, request: str, *, timeout: Optional[float] = None, **members: Any) -> Told:
        wall = self.wall
        body = encode(wall.schema.request(request), members)
        said = seconds(timeout, "timeout")
        wait = wall.timeout if said is None else said
        # Where the link is broken, sending waits for its return.
        future = wall._link.request(body) if wall.connected else await self.run(wall._link.request, body)
        try:
            reply = await asyncio.wait_for(asyncio.wrap_future(future), wait)
        except asyncio.TimeoutError:
            raise Timeout(f"the server at {wall.address} did not answer within {wait:g} s") from None
        return wall._told(wall._link.granted(reply))

    async def status(self) -> Told:
        return await self.ask("GetStatus")

    async def whoami(self) -> Told:
        return await self.ask("WhoAmI")

    async def node(self, path: str) -> Node:
        return await self.run(self.wall.__getitem__, path)

    async def nodes(self, which: Any) -> Nodes:
        return await self.run(self.wall.nodes, which)

    async def set(self, target: Any, **fields: Any) -> Optional[Told]:
        """Of a path, a node or many nodes."""
        def assign() -> Optional[Told]:
            found = self.wall[target] if isinstance(target, str) else target
            if not isinstance(found, (Object, Nodes)):
                raise BadInput(f"{target!r} is neither a path nor an object nor nodes")
            result: Optional[Told] = found.set(**fields)
            return result
        return await self.run(assign)

    async def get(self, path: str, field: str) -> Any:
        if not isinstance(field, str):
            raise BadInput(f"{field!r} is no name of a field")
        return await self.run(lambda: getattr(self.wall[path], field))

    async def fields(self, path: str) -> dict[str, Any]:
        return await self.run(lambda: self.wall[path].fields())

    async def create(self, path: str, type: Optional[str] = "Transform", **fields: Any) -> Node:
        return await self.run(self.wall.create, path, type, **fields)

    async def remove(self, path: str) -> Told:
        return await self.run(self.wall.remove, path)

    async def show(self, x: Any, path: Optional[str] = None, **look: Any) -> Node:
        return await self.run(self.wall.show, x, path, **look)

    async def load(self, path: str, **placing: Any) -> Node:
        return await self.run(self.wall.load, path, **placing)

    async def image(self) -> Array:
        return await self.run(self.wall.image)

    async def undo(self) -> Told:
        return await self.ask("UndoStep")

    async def redo(self) -> Told:
        return await self.ask("RedoStep")

    async def follow(self, what: str, *, timeout: Optional[float] = None, **options: bool) -> AsyncIterator[Any]:
        """As Wall.follow; it ends with the wall, or with the loop over it."""
        subscription: Subscription = await self.run(self.wall.follow, what, timeout=timeout, **options)
        waiter = ThreadPoolExecutor(1, "tessera follow")
        done = object()

        def take() -> Any:
            return next(subscription, done)
        try:
            while True:
                told = await asyncio.get_running_loop().run_in_executor(waiter, take)
                if told is done:
                    return
                yield told
        finally:
            # Whoever waits in `take` is let go by the end of the subscription.
            await self.run(subscription.close)
            waiter.shutdown(wait=False)

    async def close(self) -> None:
        await self.run(self.wall.close)
        self._pool.shutdown(wait=False)

    async def __aenter__(self) -> "Wall":
        return self

    async def __aexit__(self, kind: Any, value: Any, trace: Any) -> None:
        await self.close()


async def connect(address: Optional[str] = None, *, token_file: Optional[str] = None, keys: Optional[str] = None,
                  name: str = "python",
                  timeout: float = 10.0, redial: float = 60.0) -> Wall:
    """As tessera.connect."""
    pool = ThreadPoolExecutor(4, "tessera wall")
    loop = asyncio.get_running_loop()
    dial = functools.partial(_Wall, address, token_file=token_file, keys=keys, name=name, timeout=timeout,
                             redial=redial)
    return Wall(await loop.run_in_executor(pool, dial), pool)
