"""Iterators of what the server tells, frame by frame."""
from __future__ import annotations

import collections
import threading
import time
import weakref
from typing import TYPE_CHECKING, Any, Callable, Deque, Iterator, Mapping, Optional

from . import _changes
from ._described import decode, encode
from ._link import Link
from ._schema import nearest
from ._types import seconds
from .errors import BadInput, NetworkError, TesseraError, Timeout, UnknownField

if TYPE_CHECKING:
    from ._wall import Wall


class Subscription:
    """An iterator; any number of threads may take from it. Close it, or use `with`, when nothing more is wanted."""

    def __init__(self, what: str, timeout: Optional[float], most: int) -> None:
        if not isinstance(most, int) or isinstance(most, bool) or most < 1:
            raise BadInput(f"most: so many wait unread, 1 or more, and not {most!r}")
        self.what = what
        self.missed = 0  #: so many went unread because `most` waited already
        self.gaps = 0  #: so often the connection broke and came back: what happened meanwhile was not told
        self._timeout = seconds(timeout, "timeout")
        self._told: Deque[Any] = collections.deque()
        self._most = most
        self._changed = threading.Condition()
        self._ended = False
        self._why: Optional[TesseraError] = None

    def __iter__(self) -> Iterator[Any]:
        return self

    def __next__(self) -> Any:
        return self.get(self._timeout)

    def get(self, timeout: Optional[float] = None) -> Any:
        """The next one. Timeout: none came; StopIteration: the wall is over, or this was closed."""
        timeout = seconds(timeout, "timeout")
        deadline = None if timeout is None else time.monotonic() + timeout
        with self._changed:
            while not self._told:
                if self._ended:
                    if self._why is not None:
                        raise self._why
                    raise StopIteration
                if not self._changed.wait(None if deadline is None else max(0.0, deadline - time.monotonic())):
                    raise Timeout(f"nothing of \"{self.what}\" came within {timeout:g} s")
            return self._told.popleft()

    def latest(self, timeout: Optional[float] = None) -> Any:
        """The newest one; those before it are passed over."""
        newest = self.get(timeout)
        with self._changed:
            if self._told:
                newest = self._told[-1]
                self._told.clear()
        return newest

    def close(self) -> None:
        self._end(None)

    def __enter__(self) -> "Subscription":
        return self

    def __exit__(self, kind: Any, value: Any, trace: Any) -> None:
        self.close()

    def _put(self, told: Any) -> None:
        with self._changed:
            if self._ended:
                return
            if len(self._told) >= self._most:
                self._told.popleft()
                self.missed += 1
            self._told.append(told)
            self._changed.notify()

    def _end(self, why: Optional[TesseraError]) -> None:
        with self._changed:
            self._ended, self._why = True, self._why or why
            self._changed.notify_all()


class _News(Subscription):
    def __init__(self, owner: "Subscriptions", what: str, timeout: Optional[float], most: int,
                 options: Mapping[str, bool]) -> None:
        super().__init__(what, timeout, most)
        self._owner = owner
        self._wall = owner.wall()  # it stays while anybody listens
        self.wishes = {what: True, **options}

    def close(self) -> None:
        super().close()
        self._owner.forget(self)


class Subscriptions:
    """What one connection is told: the wishes of all iterators together. The thread that reads holds it, and by it no
    wall: one that nobody holds is closed."""

    def __init__(self, wall: "Wall") -> None:
        self._weak = weakref.ref(wall)
        self._schema = wall.schema
        self._lock = threading.Lock()
        self._apart: "weakref.WeakSet[Subscription]" = weakref.WeakSet()  # with connections of their own
        self._open: list[weakref.ref[_News]] = []  # weak: one that nobody holds ends, and with it its hold on the wall

    def open(self, what: str, timeout: Optional[float], most: int, options: Mapping[str, bool]) -> Subscription:
        schema = self._schema
        if not isinstance(what, str) or what not in schema.subscriptions:
            known = [*schema.subscriptions, "changes"]
            raise UnknownField(f"nothing of \"{what}\" is told; there is {', '.join(known)}{nearest(what, known)}")
        news = _News(self, what, timeout, most, options)
        encode(schema.request("SubscribeNews"), news.wishes)  # refuses unknown options before anything is changed
        with self._lock:
            self._open.append(weakref.ref(news))
        try:
            self.wall().ask("SubscribeNews", **self._wishes())
        except BaseException:
            self.forget(news, False)
            raise
        return news

    def apart(self, subscription: Subscription) -> None:
        with self._lock:
            self._apart.add(subscription)

    def close_apart(self) -> None:
        with self._lock:
            subscriptions = list(self._apart)
        for each in subscriptions:
            each.close()

    def forget(self, news: _News, say: bool = True) -> None:
        with self._lock:
            known = next((each for each in self._open if each() is news), None)
            if known is None:
                return
            self._open.remove(known)
        if say and news._wall.connected:
            try:
                news._wall.ask("SubscribeNews", **self._wishes())
            except TesseraError:
                pass  # it is told of more than it wants

    def wall(self) -> "Wall":
        wall = self._weak()
        assert wall is not None, "whoever calls this holds it"
        return wall

    def _listening(self) -> list[_News]:
        with self._lock:
            return [news for news in (each() for each in self._open) if news is not None]

    def _wishes(self) -> dict[str, bool]:
        return {name: True for news in self._listening() for name, wanted in news.wishes.items() if wanted}

    def _say_wishes(self) -> None:
        wall = self._weak()
        if wall is not None:
            wall._link.say("Request", {"id": 0, "body": encode(self._schema.request("SubscribeNews"), self._wishes())})

    # ---- of the thread that reads

    def told(self, name: str, said: Mapping[str, Any]) -> None:
        if name != "Notice" or not self._open:
            return
        schema = self._schema
        told = decode(schema.notices, said["body"])
        listening = self._listening()
        for news in listening:
            if schema.subscriptions[news.what] == told._said:
                news._put(told)
        with self._lock:
            dropped = len(self._open)
            self._open = [each for each in self._open if each() is not None]
            dropped -= len(self._open)
        if dropped:
            self._say_wishes()

    def back(self) -> None:
        """The connection broke and is there again: what was subscribed to is subscribed to."""
        listening = self._listening()
        for news in listening:
            news.gaps += 1
        if listening:
            self._say_wishes()

    def ended(self, why: Optional[TesseraError]) -> None:
        for news in self._listening():
            news._end(why)


def _of(weak: "weakref.ref[ChangesSubscription]", tell: Callable[["ChangesSubscription"], None]) -> None:
    alive = weak()
    if alive is not None:
        tell(alive)


class ChangesSubscription(Subscription):
    """Every change of the scene, in order (`_changes.Changes`). A connection of its own follows the scene, so that
    nobody else pays."""

    def __init__(self, wall: "Wall", timeout: Optional[float], most: int) -> None:
        super().__init__("changes", timeout, most)
        self._schema = wall.schema
        self._begun = threading.Event()
        self._link: Optional[Link] = None
        weak = weakref.ref(self)  # the thread that reads holds nobody: an iterator that nobody holds ends
        self._link = Link(wall.schema, wall._link.way, name=wall.name, timeout=wall.timeout, redial=wall._link.redial,
                          follows=True,
                          on_message=lambda name, said: _of(weak, lambda alive: alive._told_of(name, said)),
                          on_back=lambda: _of(weak, lambda alive: alive._back()),
                          on_end=lambda why: _of(weak, lambda alive: alive._over(why)))
        weakref.finalize(self, self._link.close).atexit = False
        wall._subscriptions.apart(self)
        if not self._begun.wait(wall.timeout):
            self.close()
            raise Timeout(f"the server at {wall.address} did not hand out its scene within {wall.timeout:g} s")

    def _told_of(self, name: str, said: Mapping[str, Any]) -> None:
        if name == "Changes":
            self._put(_changes.decode(self._schema, said["list"], said["sequence"]))
        elif name != "Snapshot":
            return
        self._begun.set()
        # What came before is not wanted: whoever asks has it from the server.
        link = self._link
        if link is not None:
            link.say("Synced", {"sequence": said["sequence"], "state_hash": said["state_hash"]})

    def _back(self) -> None:
        self.gaps += 1

    def _over(self, why: Optional[TesseraError]) -> None:
        self._begun.set()
        self._end(why)

    def close(self) -> None:
        super().close()
        if self._link is not None:
            self._link.close()
