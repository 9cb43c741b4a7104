"""The pictures of pages are what `llfsm draw` makes today."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.extensions.graphs.pictures import svg
from llfsm_verify.report.drawing.extract import arrangement_graph
from tests.outside import load

PICTURES = {"docs/pictures/traffic_lights.svg": "models/traffic_lights/arrangement.yaml"}


def test_every_picture_is_shown_and_compared():
    """Those of pages in the browser are compared by the tests of the extension that makes them."""
    assert {str(path) for path in Path("docs/pictures").glob("*.svg")} == set(PICTURES)
    for page, wanted in (
        ("README.md", ["docs/pictures/traffic_lights.svg", "docs/pictures/report.png"]),
        ("docs/index.md", ["pictures/traffic_lights.svg"]),
    ):
        shown = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", Path(page).read_text(encoding="utf-8"))
        assert shown == wanted


@pytest.mark.parametrize("picture", PICTURES)
def test_a_picture_is_what_draw_makes(picture):
    """Up to where things stand, which fonts and the version of Graphviz decide."""
    load("pygraphviz")
    drawn = svg(arrangement_graph(load_arrangement(PICTURES[picture])))
    assert content(drawn) == content(Path(picture).read_text(encoding="utf-8")), (
        f"write it again: llfsm draw {PICTURES[picture]} -o {picture}"
    )


def content(text: str) -> list[tuple[str | None, list[str], list[str]]]:
    """Of each node and edge its name, its texts, and the shapes with their colours and lines."""
    root = ET.fromstring(text)
    groups = [group for group in root.iter("{http://www.w3.org/2000/svg}g") if group.get("class") in ("node", "edge")]
    return sorted(
        (
            group.findtext("{*}title"),
            [text.text for text in group.iter() if text.tag.endswith("text")],
            sorted(
                " ".join((shape.tag.rpartition("}")[2], *(shape.get(key, "") for key in ("fill", "stroke"))))
                for shape in group.iter()
                if shape.get("stroke")
            ),
        )
        for group in groups
    )
