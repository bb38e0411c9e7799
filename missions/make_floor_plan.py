"""Draws ``photo_map.png``, the shipped image map: a flat of 4 × 3 m with warm spots, as a thermal camera would see it.

Run ``python -m missions.make_floor_plan`` to draw it again; a test compares the shipped file with what this draws.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

PIXELS_PER_METRE = 80
WIDTH, HEIGHT = 4.0, 3.0  # [m]
_FLOOR, _FURNITURE = 22.0, 60.0  # gray levels 0..255; walls are 0
_WALL = 0.06  # thickness [m]

# x, y, width, height [m], from the lower left corner of the flat.
_WALLS = (
    (0.0, 0.0, WIDTH, _WALL),
    (0.0, HEIGHT - _WALL, WIDTH, _WALL),
    (0.0, 0.0, _WALL, HEIGHT),
    (WIDTH - _WALL, 0.0, _WALL, HEIGHT),
    (1.7, 0.0, _WALL, 0.9),  # kitchen | living room, with a door above
    (1.7, 1.7, _WALL, 1.3),
    (1.7, 1.7, 0.7, _WALL),  # living room | bedroom, with a door to the right
    (3.1, 1.7, 0.9, _WALL),
)
_FURNITURES = ((0.15, 0.15, 1.3, 0.3), (2.3, 0.35, 0.9, 0.5), (2.9, 2.1, 0.85, 0.7), (0.2, 2.3, 0.6, 0.5))
# x, y, spread [m], brightness: cooker, two people on the sofa, sleeper, radiator.
_WARM_SPOTS = (
    (0.8, 0.55, 0.20, 230.0),
    (2.55, 0.75, 0.17, 190.0),
    (3.0, 0.8, 0.17, 170.0),
    (3.3, 2.35, 0.22, 215.0),
    (0.55, 2.2, 0.28, 120.0),
)


def draw() -> NDArray[np.uint8]:
    """Gray levels, one row of pixels a row, top row first: (240, 320)."""
    rows, columns = round(HEIGHT * PIXELS_PER_METRE), round(WIDTH * PIXELS_PER_METRE)
    x = (np.arange(columns)[None, :] + 0.5) / PIXELS_PER_METRE
    y = HEIGHT - (np.arange(rows)[:, None] + 0.5) / PIXELS_PER_METRE  # the top row is the far wall
    gray = np.full((rows, columns), _FLOOR)
    for left, bottom, width, height in _FURNITURES:
        gray[_inside(x, y, left, bottom, width, height)] = _FURNITURE
    for centre_x, centre_y, spread, brightness in _WARM_SPOTS:
        gray += brightness * np.exp(-((x - centre_x) ** 2 + (y - centre_y) ** 2) / (2.0 * spread**2))
    for left, bottom, width, height in _WALLS:
        gray[_inside(x, y, left, bottom, width, height)] = 0.0
    return np.asarray(np.clip(np.rint(gray), 0.0, 255.0), dtype=np.uint8)


def _inside(
    x: NDArray[np.float64], y: NDArray[np.float64], left: float, bottom: float, width: float, height: float
) -> NDArray[np.bool_]:
    return (left <= x) & (x < left + width) & (bottom <= y) & (y < bottom + height)


def main() -> None:
    """Write ``photo_map.png`` beside this file."""
    Image.fromarray(draw()).save(Path(__file__).with_name("photo_map.png"), optimize=True)


if __name__ == "__main__":
    main()
