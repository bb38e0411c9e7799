"""What a study file says of its results, checked against the columns its table will have."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from planner.study.record import COLUMNS, Claim, Points, StudyError, Value

OVER_A_COLUMN = ("rises", "falls")
BETWEEN_GROUPS = ("below", "above")


def read_claims(items: Value, sweep: Mapping[str, Points], where: str) -> tuple[Claim, ...]:
    """Read the list of claims.

    Args:
        items: as in the file.
        sweep: the study's axes.
        where: the list, for messages.

    Raises:
        StudyError: a claim that names no such column, axis or value, or is neither a trend nor a ratio.
    """
    if not isinstance(items, list):
        raise StudyError(f"{where}: got {items!r}; allowed: a list of claims")
    return tuple(_claim(item, sweep, f"{where}[{number}]") for number, item in enumerate(items))


def _claim(item: Value, sweep: Mapping[str, Points], where: str) -> Claim:
    known = [field.name for field in dataclasses.fields(Claim)]
    if not isinstance(item, dict) or not {"text", "y", "trend"} <= set(item) <= set(known):
        raise StudyError(f"{where}: got {str(item)[:60]!r}; allowed: text, y, trend, and of {', '.join(known)}")
    claim = Claim(**{**item, "within": _axes(item.get("within", []), sweep, f"{where}.within")})
    for field in ("where", "of", "to"):
        _check_values(getattr(claim, field), sweep, f"{where}.{field}")
    columns = (*sweep, "seed", *COLUMNS)
    if claim.trend in OVER_A_COLUMN:
        _check_columns({"x": claim.x, "y": claim.y}, columns, where)
    elif claim.trend in BETWEEN_GROUPS:
        _check_columns({"y": claim.y}, columns, where)
        if not claim.of or not claim.to:
            raise StudyError(f"{where}: a ratio needs both 'of' and 'to': values of axes")
    else:
        allowed = ", ".join((*OVER_A_COLUMN, *BETWEEN_GROUPS))
        raise StudyError(f"{where}.trend: got {claim.trend!r}; allowed: {allowed}")
    return claim


def _check_columns(given: Mapping[str, str], columns: tuple[str, ...], where: str) -> None:
    for field, column in given.items():
        if column not in columns:
            raise StudyError(f"{where}.{field}: got {column!r}; allowed: {', '.join(columns)}")


def _axes(value: Value, sweep: Mapping[str, Points], where: str) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(axis in sweep for axis in value):
        raise StudyError(f"{where}: got {value!r}; allowed: a list of axes of the sweep: {', '.join(sweep)}")
    return tuple(value)


def _check_values(value: Value, sweep: Mapping[str, Points], where: str) -> None:
    if not isinstance(value, dict):
        raise StudyError(f"{where}: got {value!r}; allowed: a mapping of axes to values")
    for axis, label in value.items():
        labels = [str(known) for known, _ in sweep.get(axis, ())]
        if not labels:
            raise StudyError(f"{where}: got axis {axis!r}; allowed: {', '.join(sweep)}")
        if str(label) not in labels:
            raise StudyError(f"{where}.{axis}: got {label!r}; allowed: {', '.join(labels)}")
