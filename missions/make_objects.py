"""Draws the objects of the shipped inspections: a statue (a free-form surface) and a chair, both closed.

Run ``python -m missions.make_objects`` to draw them again; a test compares the shipped files with what this draws.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array

FOLDER = Path(__file__).parent / "examples" / "objects"
RINGS, CORNERS = 40, 36  # of the statue
HEIGHT = 1.0  # [m]
# height as a share, x, y, radius [m]: a foot, a waist that leans, a belly, a neck, a head.
_SPINE = (
    (0.0, 0.00, 0.00, 0.20),
    (0.12, 0.00, 0.00, 0.17),
    (0.3, 0.04, 0.00, 0.09),
    (0.5, 0.02, 0.03, 0.17),
    (0.62, -0.03, 0.02, 0.16),
    (0.76, -0.05, -0.02, 0.06),
    (0.88, -0.02, -0.03, 0.11),
    (1.0, 0.00, -0.03, 0.02),
)
# lower and upper corners of a chair's boxes [m]: seat, back, four legs.
_SEAT, _BACK, _LEG = (0.4, 0.4, 0.05), 0.9, 0.05  # sides of the seat, height of the back, side of a leg
_SEAT_HEIGHT = 0.45


def statue() -> tuple[Array, NDArray[np.intp]]:
    """A figure on a leaning spine, with a ridge that winds around it: vertices (V, 3) [m] and faces (F, 3)."""
    share = np.linspace(0.0, 1.0, RINGS)
    heights, x, y, radius = np.array(_SPINE).T
    x, y, radius = (_smooth(share, heights, values) for values in (x, y, radius))
    angle = 2.0 * math.pi * np.arange(CORNERS) / CORNERS
    ridge = 1.0 + 0.12 * np.cos(3.0 * angle[None, :] - 7.0 * share[:, None])
    ring = np.stack(
        (
            x[:, None] + radius[:, None] * ridge * np.cos(angle),
            y[:, None] + radius[:, None] * ridge * np.sin(angle),
            np.broadcast_to(HEIGHT * share[:, None], (RINGS, CORNERS)),
        ),
        axis=-1,
    )
    vertices = np.concatenate([ring.reshape(-1, 3), [[x[0], y[0], 0.0], [x[-1], y[-1], HEIGHT]]])
    ring_of, corner = np.meshgrid(np.arange(RINGS - 1), np.arange(CORNERS), indexing="ij")
    a, b = ring_of * CORNERS + corner, ring_of * CORNERS + (corner + 1) % CORNERS
    sides = np.stack((a, b, b + CORNERS, a, b + CORNERS, a + CORNERS), axis=-1).reshape(-1, 3)
    j, following = np.arange(CORNERS), (np.arange(CORNERS) + 1) % CORNERS
    bottom, top = np.full(CORNERS, len(vertices) - 2), np.full(CORNERS, len(vertices) - 1)
    last = (RINGS - 1) * CORNERS
    caps = np.concatenate(
        [np.stack((bottom, following, j), axis=1), np.stack((top, last + j, last + following), axis=1)]
    )
    return vertices, np.concatenate([sides, caps])


def chair() -> tuple[Array, NDArray[np.intp]]:
    """Seat, back and legs as boxes that touch nowhere, each closed: vertices (V, 3) [m] and faces (F, 3)."""
    side, depth, thick = _SEAT
    seat = ((-0.5 * side, -0.5 * depth, _SEAT_HEIGHT - thick), (0.5 * side, 0.5 * depth, _SEAT_HEIGHT))
    back = ((-0.5 * side, 0.5 * depth - 0.04, _SEAT_HEIGHT + 1e-3), (0.5 * side, 0.5 * depth, _BACK))
    inset, top = 0.5 * side - _LEG, _SEAT_HEIGHT - thick - 1e-3
    legs = [
        ((x - 0.5 * _LEG, y - 0.5 * _LEG, 0.0), (x + 0.5 * _LEG, y + 0.5 * _LEG, top))
        for x in (-inset, inset)
        for y in (-inset, inset)
    ]
    corner = np.array([[i & 1, (i >> 1) & 1, i >> 2] for i in range(8)], dtype=np.float64)
    quads = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    boxes = (seat, back, *legs)
    vertices = np.concatenate([np.array(low) + corner * (np.array(high) - np.array(low)) for low, high in boxes])
    return vertices, np.concatenate([faces + 8 * k for k in range(len(boxes))])


def ply(vertices: Array, faces: NDArray[np.intp]) -> str:
    """A surface as an ASCII PLY file, to a tenth of a millimetre."""
    head = (
        "ply", "format ascii 1.0", f"element vertex {len(vertices)}", "property float x", "property float y",
        "property float z", f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header",
    )  # fmt: skip
    points = (" ".join(f"{value + 0.0:.4f}" for value in point) for point in vertices)
    corners = ("3 " + " ".join(map(str, face)) for face in faces.tolist())
    return "\n".join((*head, *points, *corners)) + "\n"


def _smooth(at: Array, t: Array, values: Array) -> Array:
    """Values at heights, on half cosines from one to the next."""
    k = np.clip(np.searchsorted(t, at, side="right") - 1, 0, len(t) - 2)
    s = 0.5 - 0.5 * np.cos(math.pi * (at - t[k]) / (t[k + 1] - t[k]))
    return np.asarray(values[k] * (1.0 - s) + values[k + 1] * s)


def main() -> None:
    """Write the files."""
    FOLDER.mkdir(exist_ok=True)
    for name, surface in (("statue", statue()), ("chair", chair())):
        (FOLDER / f"{name}.ply").write_text(ply(*surface))


if __name__ == "__main__":
    main()
