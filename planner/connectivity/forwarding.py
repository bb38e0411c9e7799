"""Store and forward: who gets whose data when, if robots pass on everything they have whenever they are in contact.

Contacts are intervals of time; passing on takes no time, so within a contact, and along a chain of contacts at one
instant, data arrive at once. A message that robot i has at the start arrives at j at the earliest by a chain of
contacts in which every contact ends no sooner than the data have arrived.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array

Table = tuple[tuple[float, ...], ...]


class Contact(NamedTuple):
    """Two robots within range.

    Attributes:
        i: robot index. j: the other's.
        begin: [s]. end: [s], included; not before ``begin``.
    """

    i: int
    j: int
    begin: float
    end: float


def by_pair(contacts: Iterable[Contact]) -> dict[tuple[int, int], list[Contact]]:
    """Contacts of each pair that has any."""
    found: dict[tuple[int, int], list[Contact]] = {}
    for contact in contacts:
        found.setdefault((contact.i, contact.j), []).append(contact)
    return found


def earliest_arrivals(robots: int, contacts: Iterable[Contact], start: float = 0.0, end: float = np.inf) -> Array:
    """Earliest times at which everybody's data of ``start`` reach everybody.

    Args:
        robots: N.
        contacts: in any order; they may overlap.
        start: when the data come into being [s]; contacts before it are of no use.
        end: contacts after it do not count [s].

    Returns:
        (N, N) arrival [i, j] of i's data at j [s]; ``start`` on the diagonal, inf where they never arrive.
    """
    usable = sorted(
        (max(c.begin, start), min(c.end, end), c.i, c.j) for c in contacts if c.end >= start and c.begin <= end
    )
    arrival = np.full((robots, robots), np.inf)
    np.fill_diagonal(arrival, start)
    while True:  # once over all contacts settles chains in order of time; chains of overlapping ones take a few rounds
        before = arrival.copy()
        for begin, last, i, j in usable:
            _pass_on(arrival, i, j, begin, last)
            _pass_on(arrival, j, i, begin, last)
        if np.array_equal(arrival, before):
            return arrival


def arrival_tables(robots: int, contacts: Sequence[Contact], edges: Sequence[float]) -> tuple[Table, tuple[Table, ...]]:
    """Arrivals of what is known at the beginning, over the whole search and within each sub-period by itself.

    Args:
        robots: N.
        contacts: of all pairs.
        edges: boundaries of the sub-periods [s].
    """
    by_period = (earliest_arrivals(robots, contacts, *span) for span in itertools.pairwise(edges))
    return _table(earliest_arrivals(robots, contacts, edges[0])), tuple(_table(values) for values in by_period)


def _table(values: Array) -> Table:
    return tuple(tuple(float(value) for value in row) for row in values)


def _pass_on(arrival: Array, giver: int, taker: int, begin: float, last: float) -> None:
    """Everything the giver has by the end of the contact goes to the taker."""
    has = arrival[:, giver]
    handed = np.where(has <= last, np.maximum(has, begin), np.inf)
    np.minimum(arrival[:, taker], handed, out=arrival[:, taker])


def sampled_contacts(t: Array, within: NDArray[np.bool_], pairs: Iterable[Sequence[int]]) -> list[Contact]:
    """Contacts of a sampled motion: runs of samples within range.

    Args:
        t: (S,) [s], increasing.
        within: (S, pairs) whether each pair is within range at each sample.
        pairs: robot indices of the columns.
    """
    found = []
    padded = np.zeros((len(t) + 2, within.shape[1]), dtype=np.int8)
    padded[1:-1] = within
    steps = np.diff(padded, axis=0)
    for column, (i, j) in enumerate(pairs):
        begins, ends = np.flatnonzero(steps[:, column] > 0), np.flatnonzero(steps[:, column] < 0) - 1
        found += [Contact(int(i), int(j), float(t[a]), float(t[b])) for a, b in zip(begins, ends, strict=True)]
    return found
