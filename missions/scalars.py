"""What a YAML scalar means once the schema says what it has to be.

A plain scalar that another YAML reader would take for something else (``on``, ``0012``, ``1:30``, ``2026-01-31``) is
refused everywhere, so that every tool that opens a mission sees the same mission.
"""

from __future__ import annotations

import math
import re
import unicodedata

from missions.yamltree import ScalarNode

_INTEGER = re.compile(r"[-+]?(0|[1-9][0-9]*)")
_FLOAT = re.compile(r"[-+]?((0|[1-9][0-9]*)(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")
_NULL = frozenset(("", "~", "null", "Null", "NULL"))
_TRUE = frozenset(("true", "True", "TRUE"))
_FALSE = frozenset(("false", "False", "FALSE"))
_YAML_1_1_BOOLEANS = frozenset(("y", "n", "yes", "no", "on", "off"))
_NUMBER_LIKE = re.compile(
    r"""[-+]?(0[xX][0-9a-fA-F_]+|0[oO]?[0-7_]+|0[bB][01_]+     # hexadecimal, octal, binary
        |[0-9][0-9_]*(:[0-5]?[0-9])+(\.[0-9_]*)?                # sexagesimal
        |(\.[0-9]|[0-9])[0-9_]*(\.[0-9_]*)?([eE][-+]?[0-9]+)?   # decimal, with leading zeros or underscores
        |\.(inf|Inf|INF|nan|NaN|NAN))""",
    re.VERBOSE,
)
_DATE_LIKE = re.compile(r"[0-9]{4}-[0-9]{1,2}-[0-9]{1,2}([Tt ].*)?")
_MAX_NUMBER_LENGTH = 64  # int() refuses thousands of digits with an exception of its own


class ScalarError(ValueError):
    """A scalar is not what is needed; str() says what was found and what is allowed."""


def is_null(node: ScalarNode) -> bool:
    """Whether the scalar stands for 'nothing'."""
    return node.plain and node.text in _NULL


def describe(node: ScalarNode) -> str:
    """What the scalar looks like, for messages."""
    text = node.text if len(node.text) <= _MAX_NUMBER_LENGTH else node.text[: _MAX_NUMBER_LENGTH - 3] + "..."
    if not node.plain:
        return f"the text {text!r}"
    if node.text in _NULL:
        return "nothing"
    if node.text in _TRUE | _FALSE:
        return f"the boolean {text}"
    if _FLOAT.fullmatch(node.text):
        return f"the number {text}"
    return repr(text)


def to_float(node: ScalarNode) -> float:
    """A finite number; ``1e-3`` is one, ``0012``, ``1:30``, ``1_000``, ``.inf`` and quoted text are not."""
    if not node.plain or len(node.text) > _MAX_NUMBER_LENGTH or not _FLOAT.fullmatch(node.text):
        raise ScalarError(f"got {describe(node)}; allowed: a number{_number_hint(node)}")
    value = float(node.text)
    if not math.isfinite(value):
        raise ScalarError(f"got {node.text}; allowed: a finite number")
    return value


def to_int(node: ScalarNode) -> int:
    """A whole number in decimal digits."""
    if not node.plain or len(node.text) > _MAX_NUMBER_LENGTH or not _INTEGER.fullmatch(node.text):
        raise ScalarError(f"got {describe(node)}; allowed: a whole number{_number_hint(node)}")
    return int(node.text)


def to_bool(node: ScalarNode) -> bool:
    """``true`` or ``false``; not ``on``, ``yes`` or 1."""
    if node.plain and node.text in _TRUE | _FALSE:
        return node.text in _TRUE
    raise ScalarError(f"got {describe(node)}; allowed: true or false")


def to_text(node: ScalarNode) -> str:
    """Text; plain scalars that some YAML reader takes for a number, date, boolean or null have to be quoted."""
    text = node.text
    if node.plain and _ambiguous(text):
        shown = f"write '{text}' in quotes" if text else "write '' for empty text"
        raise ScalarError(f"got {describe(node)}; allowed: text ({shown} if you mean the text)")
    for character in text:
        if unicodedata.category(character) in ("Cc", "Cs") and character not in "\n\t":
            raise ScalarError(f"got a control character (U+{ord(character):04X}); allowed: printable text")
    return text


def _ambiguous(text: str) -> bool:
    return (
        text in _NULL | _TRUE | _FALSE
        or text.lower() in _YAML_1_1_BOOLEANS
        or _NUMBER_LIKE.fullmatch(text) is not None
        or _DATE_LIKE.fullmatch(text) is not None
    )


def _number_hint(node: ScalarNode) -> str:
    if not node.plain:
        return " without quotes" if _FLOAT.fullmatch(node.text) else ""
    if re.fullmatch(r"[-+]?0[0-9_]+.*", node.text):
        return " without leading zeros"
    if ":" in node.text and _NUMBER_LIKE.fullmatch(node.text):
        return " in decimal notation, not minutes:seconds"
    return ""
