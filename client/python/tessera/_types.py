"""Short names for annotations, and what people give as an array."""
from __future__ import annotations

from typing import Any, Optional, TypeAlias

import numpy as np

from .errors import BadInput

Array: TypeAlias = "np.ndarray[Any, np.dtype[Any]]"
DType: TypeAlias = "np.dtype[Any]"


def utf8(value: Any, where: str) -> bytes:
    """A text as it travels. BadInput: it is none, or half of a surrogate pair is in it, which UTF-8 has no place
    for."""
    if not isinstance(value, str):
        raise BadInput(f"{where}: {value!r} is no text")
    try:
        return value.encode()
    except UnicodeEncodeError:
        raise BadInput(f"{where}: {value!r} has a letter that is none in Unicode") from None


def whole(value: Any, most: int, what: str) -> int:
    """A whole number from 0 to `most`; `what` says what it is."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)) or not 0 <= value <= most:
        raise BadInput(f"{what}, from 0 to {most}, and not {value!r}")
    return int(value)


def seconds(value: Any, what: str) -> Optional[float]:
    """How long somebody waits; None: however long."""
    if value is not None and (isinstance(value, (bool, np.bool_))
                              or not isinstance(value, (int, float, np.integer, np.floating)) or not 0 <= value < 1e9):
        raise BadInput(f"{what}: a number of seconds below 10^9, and not {value!r}")
    return None if value is None else float(value)


def items_of(value: Any, where: str) -> list[Any]:
    """Of a list, a tuple, an array; a text is none of them."""
    if isinstance(value, (str, bytes, bytearray)):
        raise BadInput(f"{where}: {value!r} is no list")
    try:
        return list(value)
    except (TypeError, NotImplementedError):
        raise BadInput(f"{where}: {value!r} is no list") from None


def written(value: Any) -> str:
    """What somebody gave, in a message: numbers of numpy as people write them."""
    if not isinstance(value, (np.ndarray, np.generic)):
        return repr(value)
    if isinstance(value, np.ndarray) and value.ndim:
        if value.size >= 20:
            return f"an array of {value.size} numbers"
        return f"[{', '.join(written(each) for each in value)}]"
    return str(value).removesuffix(".0") if value.dtype.kind in "fiub" else repr(value.tolist())


def as_array(value: Any, where: str, dtype: Any = None) -> Array:
    """Without a copy where it is one. BadInput: rows of different lengths, masked values, or what is no number where
    numbers are wanted."""
    if isinstance(value, np.ma.MaskedArray) and np.any(value.mask):
        raise BadInput(f"{where}: {np.count_nonzero(value.mask)} values are masked: leave these out, or fill them "
                       f"(`filled`)")
    try:
        given: Array = np.asarray(value, dtype)
    except (ValueError, TypeError, OverflowError) as error:
        raise BadInput(f"{where}: {error}") from None
    return given


def finite(given: Array, dtype: Any, where: str) -> Array:
    """Numbers as they lie on the wire, without a copy where they do. BadInput: one is not finite, or more than that
    type holds."""
    with np.errstate(over="ignore"):
        cast = np.ascontiguousarray(given, dtype)
    if not np.isfinite(cast).all():
        wrong = f"more than a {cast.dtype} holds" if np.isfinite(given).all() else "not finite"
        raise BadInput(f"{where}: {written(given)} is {wrong}" if given.size < 20
                       else f"{where}: not all numbers are finite, as a {cast.dtype}")
    return cast
