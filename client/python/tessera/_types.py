"""Short names for annotations, and what people give as an array."""
from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from .errors import BadInput

Array: TypeAlias = "np.ndarray[Any, np.dtype[Any]]"
DType: TypeAlias = "np.dtype[Any]"


def as_array(value: Any, where: str, dtype: Any = None) -> Array:
    """Without a copy where it is one. BadInput: rows of different lengths, or what is no number where numbers are wanted."""
    try:
        given: Array = np.asarray(value, dtype)
    except (ValueError, TypeError, OverflowError) as error:
        raise BadInput(f"{where}: {error}") from None
    return given
