"""One self-contained HTML file from a recording: template, style, scripts and data joined; it asks no other host."""

import html
import json
from collections.abc import Mapping
from importlib.resources import files

_SCRIPTS = (
    *("decode", "matrix", "camera", "pointer", "moment", "model", "surface", "cells", "shaders"),
    *("webgl", "canvas", "chart", "panel", "shell"),
)
_KINDS = {"replay": ("main", ("replay",)), "pair": ("pair", ("replay", "pair"))}  # last script, and styles


def build_page(replay: Mapping[str, object], kind: str = "replay") -> str:
    """The page as text, of one `replay` or of a "pair" of them side by side (see `dirt_env.render.pair`).

    `replay` is JSON-able; no text in it can end the element that carries it.
    """
    main, styles = _KINDS[kind]
    web = files("dirt_env.render").joinpath("web")

    def read(name: str) -> str:
        return web.joinpath(name).read_text(encoding="utf-8")

    data = json.dumps(replay, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    parts = {
        "TITLE": html.escape(str(replay["title"])),
        "STYLE": "\n".join(read(f"{name}.css") for name in styles),
        "DATA": data.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029"),
        "SCRIPT": "\n".join(read(f"{name}.js") for name in (*_SCRIPTS, main)),
    }
    return _fill(read(f"{kind}.html"), parts)


def _fill(template: str, parts: Mapping[str, str]) -> str:
    """Replace each `{{NAME}}` of the template once; what was filled in is not looked at again."""
    pieces = template.split("{{")
    out = [pieces[0]]
    for piece in pieces[1:]:
        name, rest = piece.split("}}", 1)
        out += [parts[name], rest]
    return "".join(out)
