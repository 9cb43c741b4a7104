"""One self-contained HTML file of a document: the template, the style and the modules of `page/`, in one text."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

import jinja2

MODULES = ("model", "transport", "drawing", "shapes", "timeline", "player", "panels", "main")
"""Each imports only from those before it; a name of a module is no name of another."""
IMPORT = re.compile(r'^import \{[^}]*\} from "\./\w+\.js";\n', re.MULTILINE)
EXPORT = re.compile(r"^export ", re.MULTILINE)


def page_html(document: Mapping[str, object], endpoints: Mapping[str, str | None] | None = None) -> str:
    """The page of a document of `view.schema.json`. A page that is served names its endpoints: `events`, `window`."""
    given = {"title": document["title"], "css": _part("page.css"), "script": _script(), "document": _embed(document)}
    template = jinja2.Template(_part("page.html.j2"), keep_trailing_newline=True)
    html = str(template.render(given, endpoints=None if endpoints is None else _embed(endpoints)))
    return html.encode("utf-8", "backslashreplace").decode("utf-8")  # names of files may have bytes that are no text


@cache
def _script() -> str:
    return "\n".join(EXPORT.sub("", IMPORT.sub("", _part(f"{name}.js"))) for name in MODULES)


@cache
def _part(name: str) -> str:
    return files(__package__).joinpath("page", name).read_text(encoding="utf-8")


def _embed(value: object) -> str:
    """JSON that cannot end the element in which it stands, or begin a comment."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")
