"""Optimal assignment of rows to columns where everybody may also go without.

Costs are relative to going without, which costs 0: a pair with a positive cost is never better than nothing. Pairs that
are out of the question cost infinity. The problem falls apart into the connected components of the pairs that are left,
nearly always of one row and one column; the others are solved by shortest augmenting paths (the Hungarian algorithm in
the form of Jonker and Volgenant, Computing 38, 1987).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array

Row = Sequence[float]


@dataclass(frozen=True)
class Match:
    """A row and its column.

    Attributes:
        row, column: indices into the cost matrix.
        contested: by how much the best assignment costs less than the best one in which the column belongs to another
            row; infinite if none wants it.
        mistaken: likewise with the row in another column.
    """

    row: int
    column: int
    contested: float = math.inf
    mistaken: float = math.inf

    @property
    def margin(self) -> float:
        """The smaller of both. Row and column merely going without each other does not count."""
        return min(self.contested, self.mistaken)


def assign(cost: Array) -> list[Match]:
    """The assignment of least total cost.

    Args:
        cost: (N, M) cost of each pair against both going without; infinite where it is impossible.

    Returns:
        Matched pairs, by row.
    """
    possible = cost < 0.0
    matches: list[Match] = []
    for rows, columns in _components(possible):
        if len(rows) == len(columns) == 1:
            matches.append(Match(rows[0], columns[0]))
            continue
        matches += _solve(rows, columns, np.where(possible, cost, math.inf)[np.ix_(rows, columns)].tolist())
    return sorted(matches, key=lambda match: match.row)


def _components(possible: NDArray[np.bool_]) -> list[tuple[list[int], list[int]]]:
    """Rows and columns that are connected by possible pairs."""
    neighbours = [np.flatnonzero(row).tolist() for row in possible]
    takers: dict[int, list[int]] = {}
    for row, columns in enumerate(neighbours):
        for column in columns:
            takers.setdefault(column, []).append(row)
    found, seen = [], set()
    for first, columns in enumerate(neighbours):
        if first in seen or not columns:
            continue
        rows, reached, front = {first}, set(), [first]
        while front:
            for column in neighbours[front.pop()]:
                reached.add(column)
                new = [row for row in takers[column] if row not in rows]
                rows.update(new)
                front += new
        seen |= rows
        found.append((sorted(rows), sorted(reached)))
    return found


def _solve(rows: Sequence[int], columns: Sequence[int], cost: list[list[float]]) -> list[Match]:
    """One component.

    The next best assignments are shortest cycles in the residual graph (Murty's question answered as in Ahuja, Magnanti
    and Orlin, Network Flows, 1993, section 12.4): an arc from row to row says that the first takes the other's column,
    and costs what the optimal duals leave of the pair; the last node stands for columns that are nobody's.
    """
    owner, u, v = _cheapest(cost)
    n, m = len(rows), len(columns)
    column_of = {row: column for column, row in enumerate(owner) if row is not None}
    reduced = np.full((n, m + n), math.inf)
    reduced[:, :m] = np.array(cost) - np.array(u)[:, None] - np.array(v)[None, :m]
    reduced[np.arange(n), m + np.arange(n)] = -np.array(u) - np.array(v)[m:]
    mine = [column_of[row] for row in range(n)]
    free = [column for column, row in enumerate(owner) if row is None]
    arcs = np.full((n + 1, n + 1), math.inf)
    arcs[:n, :n] = reduced[:, mine]
    arcs[:n, n] = reduced[:, free].min(axis=1)
    arcs[n, :n] = [-v[column] for column in mine]
    np.fill_diagonal(arcs, 0.0)
    away = _shortest(arcs)
    matches = []
    for i, j in enumerate(mine):
        if j >= m:
            continue
        others = [r for r in range(n) if r != i]
        contested = min((arcs[r, i] + away[i, r] for r in others), default=math.inf)
        takes = [k for k in range(m) if k != j]
        back = [away[n if owner[k] is None else owner[k], i] for k in takes]
        mistaken = min((reduced[i, k] + length for k, length in zip(takes, back, strict=True)), default=math.inf)
        matches.append(Match(rows[i], columns[j], float(contested), float(mistaken)))
    return matches


def _shortest(arcs: Array) -> Array:
    """Shortest paths between all pairs of nodes (Floyd and Warshall)."""
    length = arcs.copy()
    for k in range(len(length)):
        np.minimum(length, length[:, k, None] + length[None, k], out=length)
    return length


def _cheapest(cost: list[list[float]]) -> tuple[list[int | None], list[float], list[float]]:
    """Owner of each column in the assignment of least total cost, and the dual variables of rows and columns.

    Every row gets a private column of cost 0, that of going without, behind the others; columns may be left over, so
    there is always a complete assignment. u_i + v_j <= cost_ij, equal for pairs that are assigned; v_j <= 0, equal for
    columns that are left over.
    """
    n, m = len(cost), len(cost[0])
    u, v = [0.0] * n, [0.0] * (m + n)
    owner: list[int | None] = [None] * (m + n)
    for i in range(n):
        _augment(cost, i, m, u, v, owner)
    return owner, u, v


def _augment(
    cost: list[list[float]], first: int, m: int, u: list[float], v: list[float], owner: list[int | None]
) -> None:
    """Add one row to the assignment along the shortest alternating path (Dijkstra on reduced costs)."""
    size = len(v)
    length, before, done = [math.inf] * size, [-1] * size, [False] * size
    i, j, base = first, -1, 0.0
    visited: list[tuple[int, int]] = []  # (row, column it owns) on settled columns
    while True:
        for k in range(size):
            if done[k]:
                continue
            c = cost[i][k] if k < m else (0.0 if k - m == i else math.inf)
            if base + c - u[i] - v[k] < length[k]:
                length[k], before[k] = base + c - u[i] - v[k], j
        j = min((k for k in range(size) if not done[k]), key=length.__getitem__)
        base, done[j] = length[j], True
        taken = owner[j]
        if taken is None:
            break
        visited.append((taken, j))
        i = taken
    u[first] += base
    for row, column in visited:
        u[row] += base - length[column]
        v[column] -= base - length[column]
    while j != -1:
        previous = before[j]
        owner[j] = first if previous == -1 else owner[previous]
        j = previous
