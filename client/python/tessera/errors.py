"""What may go wrong, as exceptions. Each message is for a person: what was wrong, where, and what to do."""
from __future__ import annotations


class TesseraError(Exception):
    """Any failure of this package; `code` is the server's word for its kind."""

    code = "failed"


class BadInput(TesseraError, ValueError):
    """A value that makes no sense: a wrong type, length or number. Nothing was changed."""

    code = "bad_input"


class UnknownField(BadInput, AttributeError):
    """There is no field, member or type of that name; the message has the nearest ones."""


class NotFound(TesseraError, LookupError):
    """A node, file, host or asset that does not exist."""

    code = "not_found"


class Refused(TesseraError):
    """Well said, but not allowed at present, or not to this user."""

    code = "refused"


class LimitExceeded(TesseraError):
    """More than is taken at once."""

    code = "limit"


class Unsupported(TesseraError):
    """The other side does not know it, or its system lacks what is needed."""

    code = "unsupported"


class NetworkError(TesseraError, ConnectionError):
    """No server there, or the connection broke. What was under way may have been done or not."""

    code = "network"


class Timeout(NetworkError, TimeoutError):
    """No answer in time. What was asked for may still be done."""


_BY_CODE: dict[str, type[TesseraError]] = {
    kind.code: kind for kind in (BadInput, NotFound, Refused, LimitExceeded, Unsupported, NetworkError)
}


def error_of(code: str, message: str) -> TesseraError:
    """The exception for a code of the wire."""
    return _BY_CODE.get("bad_input" if code == "usage" else code, TesseraError)(message)
