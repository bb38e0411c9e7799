"""A page from templates: style, scripts and data inline, so that it asks for nothing."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from string import Template

from deploy.report.packing import script_json

PLAYED = tuple(f"report/{name}.js" for name in ("page", "scene", "maps", "charts", "main"))  # pages that play flights


@dataclass(frozen=True)
class Kind:
    """What all pages of a kind are made of; files are named from the folder ``deploy``.

    Attributes:
        main: template of what stands below the heading.
        scripts: in the order in which they run. style: what they look like besides ``report.css``; empty: nothing.
        body: attributes of the body, with a blank before each.
        sources: what the content security policy allows besides what is inline, with a semicolon before it.
    """

    main: str
    scripts: tuple[str, ...]
    style: str = ""
    body: str = ""
    sources: str = ""


def fill(page: Kind, data: object, *, title: str, kind: str, name: str, under: dict[str, str], **parts: str) -> str:
    """Write a page.

    Args:
        page: what it is made of.
        data: what its scripts draw.
        title: of the window.
        kind: what it is, above its name.
        name: its heading.
        under: paragraphs below the heading, by their class.
        parts: the rest of the template; ``playback`` and ``bar`` are the files of those names if they are not given.
            All texts are markup.
    """
    usual = {"playback": _read("report/playback.html"), "bar": _read("report/bar.html")}
    return Template(_read("report/frame.html")).substitute(
        title=title,
        kind=kind,
        name=name,
        under="\n".join(f'    <p class="{which}">{text}</p>' for which, text in under.items()),
        main=Template(_read(page.main)).substitute(usual | parts),
        style=_read("report/report.css") + (_read(page.style) if page.style else ""),
        script="\n".join(_read(script) for script in page.scripts),
        data=script_json(data),
        body=page.body,
        sources=page.sources,
    )


def playback(words: str) -> str:
    """The playback's markup with other words on what is solid and what is dashed."""
    usual = "Solid: flown. Dashed and hollow: certified plan."
    before, found, after = _read("report/playback.html").partition(usual)
    assert found  # noqa: S101 - ours
    return before + words + after


def _read(name: str) -> str:
    return files("deploy").joinpath(name).read_text(encoding="utf-8")
