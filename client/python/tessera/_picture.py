"""Pictures: PNG read and written, and the tiles of a wall put together.

zlib and numpy alone: hosts filter every row by its left neighbour (common/image/Png.cpp), which numpy undoes for a
whole picture at once; python3-pil would be one more package for the same.
"""
from __future__ import annotations

import struct
import zlib
from typing import Any, NamedTuple

import numpy as np

from ._types import Array
from . import _wire
from ._described import Told
from .errors import BadInput, LimitExceeded, Unsupported

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_CHANNELS = {0: 1, 2: 3, 4: 2, 6: 4}  # by PNG's colour types
_NONE, _SUB, _UP, _AVERAGE, _PAETH = range(5)


def decode_png(data: memoryview) -> Array:
    """Height × width × 3, of 8 bits; grey as colours, alpha left away."""
    if bytes(data[:8]) != _SIGNATURE:
        raise BadInput("it is no PNG")
    at, packed, head = 8, [], None
    while at + 8 <= len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        if at + 12 + size > len(data):
            raise BadInput("a PNG is cut off")
        if kind == b"IHDR":
            head = struct.unpack(">IIBBBBB", data[at + 8:at + 8 + size])
        elif kind == b"IDAT":
            packed.append(data[at + 8:at + 8 + size])
        at += 12 + size
    if head is None:
        raise BadInput("it is no PNG")
    width, height, bits, colours, _, _, interlaced = head
    if bits != 8 or colours not in _CHANNELS or interlaced:
        raise Unsupported(f"a PNG of {bits} bits and colour type {colours}")
    each = _CHANNELS[colours]
    try:
        rows = np.frombuffer(zlib.decompress(b"".join(packed)), np.uint8)
    except zlib.error as error:
        raise BadInput(f"a PNG is damaged: {error}") from None
    if rows.size != height * (1 + width * each):
        raise BadInput("a PNG is cut off")
    rows = rows.reshape(height, 1 + width * each)
    pixels = _unfiltered(rows[:, 0], rows[:, 1:].reshape(height, width, each))
    return np.repeat(pixels[:, :, :1], 3, axis=2) if each < 3 else pixels[:, :, :3]


def _unfiltered(filters: Array, rows: Array) -> Array:
    if (filters == _SUB).all():
        return np.add.accumulate(rows, axis=1, dtype=np.uint8)
    pixels = np.zeros_like(rows)
    above = np.zeros_like(rows[0])
    for at, (kind, row) in enumerate(zip(filters.tolist(), rows)):
        if kind == _NONE:
            pixels[at] = row
        elif kind == _SUB:
            np.add.accumulate(row, axis=0, dtype=np.uint8, out=pixels[at])
        elif kind == _UP:
            np.add(row, above, out=pixels[at])
        else:
            _by_neighbours(kind, row, above, pixels[at])
        above = pixels[at]
    return pixels


def _by_neighbours(kind: int, row: Array, above: Array, out: Array) -> None:
    left = corner = np.zeros(row.shape[1], int)
    for at in range(len(row)):
        up = above[at].astype(int)
        if kind == _AVERAGE:
            guess = (left + up) // 2
        else:
            estimate = left + up - corner
            a, b, c = abs(estimate - left), abs(estimate - up), abs(estimate - corner)
            guess = np.where((a <= b) & (a <= c), left, np.where(b <= c, up, corner))
        out[at] = (row[at] + guess) & 255
        left, corner = out[at].astype(int), up


def encode_png(pixels: Array) -> bytes:
    """Of height × width × 3 (uint8)."""
    height, width, _ = pixels.shape
    rows = np.empty((height, 1 + width * 3), np.uint8)
    rows[:, 0] = _SUB
    rows[:, 1:4] = pixels[:, 0]
    rows[:, 4:] = (pixels[:, 1:] - pixels[:, :-1]).reshape(height, -1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return _SIGNATURE + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 1)) + chunk(b"IEND", b"")


# ---- the wall's tiles

class Tile(NamedTuple):
    name: str
    left: int  # of the whole picture
    top: int
    width: int
    height: int
    eye: int


def _message(view: memoryview) -> dict[int, list[Any]]:
    found: dict[int, list[Any]] = {}
    for number, _, value in _wire.fields_of(view):
        found.setdefault(number, []).append(value)
    return found


def _number(message: dict[int, list[Any]], number: int) -> int:
    return int(message.get(number, [0])[-1])


def _sizes(grid: dict[int, list[Any]], count: int, alike: int, each: int) -> list[int]:
    """Of columns or rows: all alike, or each its own."""
    own: list[int] = []
    for value in grid.get(each, []):
        if isinstance(value, int):
            own.append(value)
            continue
        at = 0
        while at < len(value):
            number, at = _wire.take_varint(value, at)
            own.append(number)
    return own or [_number(grid, alike)] * count


def layout_of(configuration: memoryview) -> tuple[int, int, list[Tile]]:
    """Width and height of the picture of all screens side by side, lower edges in line, and where its tiles are. The
    numbers are those of proto/wall.proto; the rules those of common/wall/PictureLayout.cpp."""
    wall = _message(configuration)
    screens: dict[bytes, tuple[int, list[int], list[int], int, int]] = {}
    width = height = 0
    for screen in map(_message, wall.get(2, [])):
        grid = _message(screen.get(6, [b""])[-1])
        columns = _sizes(grid, max(1, _number(grid, 1)), 3, 5)
        rows = _sizes(grid, max(1, _number(grid, 2)), 4, 6)
        across, along = _number(grid, 9), _number(grid, 10)  # shown by two neighbours
        screens[bytes(screen.get(1, [b""])[-1])] = (width, columns, rows, across, along)
        width += sum(columns) - across * (len(columns) - 1)
        height = max(height, sum(rows) - along * (len(rows) - 1))
    tiles = []
    for host in map(_message, wall.get(4, [])):
        for tile in map(_message, host.get(2, [])):
            screen_name = bytes(tile.get(1, [b""])[-1])
            left, columns, rows, across, along = screens[screen_name]
            column, row, eye = _number(tile, 2), _number(tile, 3), _number(tile, 4)
            name = f"{screen_name.decode('utf-8', 'replace')}-{column}-{row}{('', '-left', '-right')[eye]}"
            bottom = sum(rows[:row]) - along * row
            tiles.append(Tile(name, left + sum(columns[:column]) - across * column, height - bottom - rows[row],
                              columns[column], rows[row], eye))
    return width, height, tiles


def mosaic_of(configuration: memoryview, images: Told) -> Array:
    """One eye: the centre's where a tile has it, else the left one."""
    width, height, tiles = layout_of(configuration)
    if width * height > 1 << 31:
        raise LimitExceeded(f"the picture of this wall has {width} x {height} pixels")
    eye = min((tile.eye for tile in tiles), default=0)
    pictures = {told.tile: told for told in images.tiles}
    whole = np.zeros((height, width, 3), np.uint8)
    for tile in tiles:
        told = pictures.get(tile.name)
        if tile.eye != eye or told is None:
            continue
        pixels = decode_png(told.png)
        if pixels.shape[:2] != (tile.height, tile.width):
            raise BadInput(f"the image of tile {tile.name} is {pixels.shape[1]}x{pixels.shape[0]}, but the tile "
                           f"{tile.width}x{tile.height}")
        whole[tile.top:tile.top + tile.height, tile.left:tile.left + tile.width] = pixels
    return whole
