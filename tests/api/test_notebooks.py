"""What notebooks show of results and runs: text, and timing diagrams that need no server and no script."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from base64 import b64decode

import pytest

import llfsm_verify as lv
from llfsm_verify.plug import TIMELINES
from tests.cli.running import FAULTY, LIGHTS

PICTURE = re.compile(r'<img alt="([^"]*)" style="max-width:none" src="data:image/svg\+xml;base64,([A-Za-z0-9+/=]+)">')
ASKED = ("a: G !ns@GREEN", "b: G (ns@RED || !ns@RED)", "c: G !(ns@GREEN && ew@GREEN)")

pytestmark = pytest.mark.skipif("svg" not in TIMELINES, reason="needs the extension of timelines")


def test_a_result_shows_each_violated_property_and_no_other() -> None:
    page = lv.load(FAULTY).check("\n".join(ASKED))._repr_html_()
    assert page.startswith("<pre")
    assert [about for about, _ in PICTURE.findall(page)] == [
        "timing diagram of a run of a: G !ns@GREEN",
        "timing diagram of a run of c: G !(ns@GREEN &amp;&amp; ew@GREEN)",
    ]
    assert "<script" not in page
    for _, data in PICTURE.findall(page):
        assert ET.fromstring(b64decode(data)).tag == "{http://www.w3.org/2000/svg}svg"


def test_a_trace_and_a_simulated_run_show_their_diagrams() -> None:
    model = lv.load(LIGHTS)
    trace = model.check("a: G !ns@GREEN")["a"].trace
    assert trace is not None
    for run in (trace, model.simulate(5, seed=1)):
        ((_, data),) = PICTURE.findall(run._repr_html_())
        assert "ns" in "".join(ET.fromstring(b64decode(data)).itertext())


def test_names_are_escaped() -> None:
    text = "x: G (ns@GREEN -> ns@RED < 1)".replace("ns@RED < 1", "!(1 < 2)")
    page = lv.load(LIGHTS).check(text)._repr_html_()
    assert "1 &lt; 2" in page
    assert "1 < 2" not in page
