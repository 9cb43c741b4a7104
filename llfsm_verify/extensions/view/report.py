"""Pages as formats of reports, and the schema of what they show."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import cast

from llfsm_verify.extensions.view.document import document_of_coverage, document_of_result
from llfsm_verify.extensions.view.page import page_html
from llfsm_verify.plug import Arrangement, Coverage, Result, Style


def report(result: Result, arrangement: Arrangement, _: Style) -> str:
    """The page of a check."""
    return page_html(document_of_result(result, arrangement)).rstrip("\n")


def coverage_report(found: Coverage, arrangement: Arrangement, _: Style) -> str:
    """The page of a coverage."""
    return page_html(document_of_coverage(found, arrangement)).rstrip("\n")


def schema(_: str) -> dict[str, object]:
    """The schema of the view document as plain dictionaries."""
    text = files(__package__).joinpath("view.schema.json").read_text(encoding="utf-8")
    return cast(dict[str, object], json.loads(text))
