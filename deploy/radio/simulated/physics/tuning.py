"""Parameters that clients may change in flight, as columns of the arrays that the controllers compute with.

A drone's firmware names only what differs from its airframe's defaults, so nothing happens as long as nobody changes
anything, and what is set back is forgotten.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from missions.arrays import Array


class Tuning:
    """Named columns, one number a drone each.

    Args:
        columns: parameter name to an array (N,) that this object may write; several names may share memory, a name
            may have several columns.
    """

    def __init__(self, columns: Mapping[str, Array | tuple[Array, ...]]) -> None:
        self._columns = {name: column if isinstance(column, tuple) else (column,) for name, column in columns.items()}
        self._defaults = {name: column[0].copy() for name, column in self._columns.items()}
        self._changed: dict[int, frozenset[str]] = {}

    def put(self, index: int, changed: Mapping[str, float]) -> bool:
        """Take one drone's parameters, defaults where it names none; whether any of these columns was written."""
        ours = frozenset(changed.keys() & self._columns.keys())
        stale = self._changed.get(index, frozenset()) | ours
        for name in stale:
            value = changed.get(name, self._defaults[name][index])
            for column in self._columns[name]:
                column[index] = value
        self._changed[index] = ours
        return bool(stale)


def columns(prefix: str, names: str, array: Array) -> dict[str, Array]:
    """``prefix + name`` of every name (separated by blanks) to that column of ``array`` (N, k)."""
    return {prefix + name: array[:, i] for i, name in enumerate(names.split())}


def per_drone(values: object, n: int, k: int) -> Array:
    """A writable (n, k) array of what broadcasts to it."""
    return np.array(np.broadcast_to(np.asarray(values, dtype=np.float64), (n, k)))
