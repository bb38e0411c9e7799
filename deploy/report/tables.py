"""Tables and moments as markup; every text that comes from outside is escaped here."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

_MOST = 30  # lines that are shown without being asked for


class Markup(str):
    """Text that is markup already, made by this package."""

    __slots__ = ()


def moment(t: float, text: str) -> Markup:
    """A button that moves the page's time cursor to mission time t [s]."""
    return Markup(f'<button type="button" class="moment" data-at="{t:.3f}">{escape(text)}</button>')


def cell(text: str) -> str:
    """A cell's content: escaped unless it is markup of ours."""
    return text if isinstance(text, Markup) else escape(text)


def table(headings: Sequence[str], rows: Iterable[Sequence[str]], caption: str, numeric: Sequence[int] = ()) -> str:
    """A table of escaped cells; ``numeric`` columns are right-aligned."""
    kind = ['class="n"' if i in numeric else "" for i in range(len(headings))]
    head = "".join(f"<th scope=col {kind[i]}>{escape(text)}</th>" for i, text in enumerate(headings))
    body = "".join(
        "<tr>" + "".join(f"<td {kind[i]}>{cell(text)}</td>" for i, text in enumerate(row)) + "</tr>" for row in rows
    )
    markup = (
        f'<div class="scroll"><table><caption>{escape(caption)}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
    )
    if body.count("<tr>") <= _MOST:
        return markup
    return f"<details><summary>{escape(caption)}: {body.count('<tr>')} lines</summary>{markup}</details>"
