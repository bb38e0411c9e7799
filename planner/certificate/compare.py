"""Whether two certificates say the same of the same bytes."""

from __future__ import annotations

import math

from planner.certificate.record import Certificate, Check

SAME = 1e-3  # in a check's unit, and relative: above what another processor's rounding does to a bound


def differences(one: Certificate, other: Certificate) -> tuple[str, ...]:
    """Names of checks that only one of them made, or whose value, limit or outcome differ; empty if they agree.

    A certificate is computed from mission and bytes alone, so that a fresh one must repeat the one it is compared to;
    a figure that does not was edited, or made by another version of the rules.
    """
    mine, yours = ({check.name: check for check in c.checks} for c in (one, other))
    names = [*mine, *(name for name in yours if name not in mine)]
    found = [name for name in names if name not in mine or name not in yours or not _same(mine[name], yours[name])]
    if one.trajectories_sha256 != other.trajectories_sha256:
        found.append("trajectories")
    if one.mission_sha256 != other.mission_sha256:
        found.append("mission")
    return tuple(found)


def _same(a: Check, b: Check) -> bool:
    fixed = (a.unit, a.relation, a.passed, a.severity) == (b.unit, b.relation, b.passed, b.severity)
    pairs = ((a.value, b.value), (a.limit, b.limit), (a.tolerance, b.tolerance))
    return fixed and all(math.isclose(x, y, rel_tol=SAME, abs_tol=SAME) for x, y in pairs)
