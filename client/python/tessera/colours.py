"""Numbers as colours."""
from __future__ import annotations

from typing import Any, Optional

import numpy as np

from ._types import Array, as_array
from ._schema import nearest
from .errors import BadInput

# Nine colours of each, evenly spaced; between them straight lines. viridis: matplotlib's, by Smith and van der Walt
# (CC0).
_MAPS: dict[str, list[int]] = {
    "viridis": [0x440154, 0x472D7B, 0x3B528B, 0x2C728E, 0x21918C, 0x28AE80, 0x5EC962, 0xADDC30, 0xFDE725],
    "grey": [0x000000, 0x202020, 0x404040, 0x606060, 0x808080, 0xA0A0A0, 0xC0C0C0, 0xE0E0E0, 0xFFFFFF],
    "blue-red": [0x3B4CC0, 0x6788EE, 0x9ABBFF, 0xC9D7F0, 0xDDDDDD, 0xF7B89C, 0xEE8468, 0xD65244, 0xB40426],
}
NAMES = tuple(_MAPS)


def _table(name: str) -> Array:
    if not isinstance(name, str) or name not in _MAPS:
        raise BadInput(f"there is no colour map \"{name}\"; there is {', '.join(_MAPS)}{nearest(name, _MAPS)}")
    stops = np.array([[colour >> 16, colour >> 8 & 255, colour & 255] for colour in _MAPS[name]], float)
    at = np.linspace(0, len(stops) - 1, 256)
    return np.stack([np.interp(at, np.arange(len(stops)), stops[:, each]) for each in range(3)],
                    1).round().astype(np.uint8)


def of_scalars(scalars: Any, cmap: str = "viridis", clim: Optional[tuple[float, float]] = None) -> Array:
    """N × 4 (uint8, sRGB and alpha). `clim`: what the first and last colour stand for; None: the least and greatest.
    NaN is grey."""
    values = as_array(scalars, "scalars", float).reshape(-1)
    good = np.isfinite(values)
    if clim is not None:
        ends = as_array(clim, "clim", float).reshape(-1)
        if len(ends) != 2 or not np.isfinite(ends).all():
            raise BadInput(f"clim: {clim!r} is no pair of numbers")
        low, high = ends.tolist()
    else:
        low, high = (values[good].min(), values[good].max()) if good.any() else (0.0, 1.0)
    place = (values - low) / (high - low) if high > low else np.zeros_like(values)
    colours = np.full((len(values), 4), 255, np.uint8)
    colours[:, :3] = 128
    colours[good, :3] = _table(cmap)[(np.clip(place[good], 0, 1) * 255).round().astype(int)]
    return colours


def of_any(colours: Any, rows: int, where: str) -> Array:
    """N × 3 or N × 4, floats from 0 to 1 or bytes, as N × 4 bytes; without a copy where it is that already."""
    given = as_array(colours, where)
    if given.dtype.kind not in "fiu":
        raise BadInput(f"{where}: {given.dtype} is no type of numbers")
    if given.ndim != 2 or given.shape[0] != rows or given.shape[1] not in (3, 4):
        raise BadInput(f"{where}: colours of shape {given.shape} for {rows} of them; wanted is {rows} × 3 or {rows} × "
                       f"4")
    if given.dtype.kind == "f":
        if not np.isfinite(given).all():
            raise BadInput(f"{where}: not all colours are finite")
        given = (np.clip(given, 0, 1) * 255).round().astype(np.uint8)
    elif given.dtype != np.uint8:
        if given.size and (given.min() < 0 or given.max() > 255):
            raise BadInput(f"{where}: whole numbers of colours go from 0 to 255")
        given = given.astype(np.uint8)
    if given.shape[1] == 3:
        given = np.concatenate([given, np.full((rows, 1), 255, np.uint8)], 1)
    return np.ascontiguousarray(given)


def linear(colour: Any) -> tuple[float, float, float, float]:
    """A single colour, sRGB from 0 to 1 or "#rrggbb", as a Material has it."""
    if isinstance(colour, str):
        digits = colour.lstrip("#")
        try:
            colour = [int(digits[at:at + 2], 16) / 255 for at in range(0, 6, 2)]
        except ValueError:
            raise BadInput(f"\"{colour}\" is no colour; write \"#rrggbb\" or (r, g, b) from 0 to 1") from None
    numbers = as_array(colour, "color", float).reshape(-1).tolist()
    if len(numbers) not in (3, 4) or not np.isfinite(numbers).all():
        raise BadInput(f"{colour!r} is no colour; write \"#rrggbb\" or (r, g, b) from 0 to 1")
    light = [each / 12.92 if each <= 0.04045 else ((each + 0.055) / 1.055) ** 2.4 for each in numbers[:3]]
    return (light[0], light[1], light[2], numbers[3] if len(numbers) == 4 else 1.0)
