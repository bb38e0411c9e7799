"""How checks are made and gathered."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal

from planner.certificate.record import Check

DISTANCE_TOLERANCE = 1e-3  # [m]


def check(
    name: str,
    value: float,
    limit: float,
    unit: str,
    relation: Literal["<=", ">="],
    where: str = "",
    time: float | None = None,
    tolerance: float = 0.0,
    severity: Literal["failure", "warning"] = "failure",
) -> Check:
    """A check that passes if value stands to limit as it should, up to the tolerance."""
    passed = value <= limit + tolerance if relation == "<=" else value >= limit - tolerance
    return Check(name, float(value), float(limit), unit, relation, bool(passed), where, time, tolerance, severity)


def room(name: str, value: float, where: str, time: float | None = None, limit: float = 0.0) -> Check:
    """A check that a distance [m] is at least a limit, up to a millimetre."""
    return check(name, value, limit, "m", ">=", where, time, DISTANCE_TOLERANCE)


def worst(checks: Iterable[Check]) -> list[Check]:
    """The worst check of each name, in the order of first appearance."""
    found: dict[str, Check] = {}
    for item in checks:
        held = found.get(item.name)
        if held is None or item.margin < held.margin:
            found[item.name] = item
    return list(found.values())


def value_of(checks: Iterable[Check], name: str) -> float:
    """Value of a check; inf if it was not made."""
    return next((item.value for item in checks if item.name == name), float("inf"))


def names_of(pair: tuple[int, int] | None, names: Sequence[str]) -> str:
    """``a–b``, or nothing."""
    return f"{names[pair[0]]}–{names[pair[1]]}" if pair else ""
