"""A page from its template: style, scripts and data inline, so that it asks for nothing."""

from __future__ import annotations

from importlib.resources import files
from string import Template

from deploy.report.packing import script_json

_SCRIPTS = ("page.js", "scene.js", "maps.js", "charts.js", "main.js")


def fill(template: str, data: object, **parts: str) -> str:
    """Fill a template of this folder; ``parts`` are markup, ``data`` is what the scripts draw."""
    own = {
        "style": _read("report.css"),
        "script": "\n".join(_read(name) for name in _SCRIPTS),
        "data": script_json(data),
        "playback": _read("playback.html"),
        "bar": _read("bar.html"),
    }
    return Template(_read(template)).substitute(own | parts)


def playback(words: str) -> str:
    """The playback's markup with other words on what is solid and what is dashed."""
    usual = "Solid: flown. Dashed and hollow: certified plan."
    before, found, after = _read("playback.html").partition(usual)
    assert found  # noqa: S101 - ours
    return before + words + after


def _read(name: str) -> str:
    return files("deploy.report").joinpath(name).read_text(encoding="utf-8")
