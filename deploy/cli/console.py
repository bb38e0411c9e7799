"""What every command prints with: errors on stderr in one line, tables, numbers for people."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Literal

from rich.console import Console
from rich.table import Table

out = Console(highlight=False)
err = Console(stderr=True, highlight=False)

_NO_WIDTHS: Mapping[int, int] = MappingProxyType({})


def fail(error: object, code: int = 2) -> int:
    """Say in one line what is wrong; return the exit code."""
    line = " ".join(str(error).split())
    print(f"ergoflie: {line}", file=sys.stderr)
    return code


def number(value: float) -> str:
    """A number as a person wants to read it."""
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "none" if value > 0 else "-inf"
    if value and (abs(value) < 1e-3 or abs(value) >= 1e5):
        mantissa, exponent = f"{value:.3e}".split("e")
        return f"{float(mantissa):g}e{int(exponent)}"
    return f"{value:.4g}"


def table(
    title: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    right: Sequence[int] = (),
    whole: Sequence[int] = (),
    least: Mapping[int, int] = _NO_WIDTHS,
) -> None:
    """Print a table.

    Args:
        title: above it.
        columns: headings.
        rows: cells, with markup.
        right: columns that are aligned to the right.
        whole: columns that are never wrapped.
        least: smallest width of columns that are.
    """
    view = Table(title=title, title_justify="left", title_style="bold", header_style="bold", pad_edge=False)
    for index, column in enumerate(columns):
        justify: Literal["left", "right"] = "right" if index in right else "left"
        view.add_column(column, justify=justify, no_wrap=index in whole, min_width=least.get(index))
    for row in rows:
        view.add_row(*row)
    out.print(view)


def print_json(value: object) -> None:
    """Print a machine's answer; numbers that JSON does not know become null."""

    def clean(item: object) -> object:
        if isinstance(item, float) and not math.isfinite(item):
            return None
        if isinstance(item, dict):
            return {str(key): clean(part) for key, part in item.items()}
        if isinstance(item, (list, tuple)):
            return [clean(part) for part in item]
        return item

    print(json.dumps(clean(value), indent=2, ensure_ascii=False))
