"""The browser that shows our pages is there, runs scripts, and tells errors."""

from __future__ import annotations

import pytest

PAGE = "<!doctype html><title>x</title><p id=p>not yet</p><script>{}</script>"


@pytest.mark.slow
def test_scripts_run_and_their_errors_are_seen(browser, tmp_path):
    path = tmp_path / "page.html"
    path.write_text(PAGE.format("document.getElementById('p').textContent = 6 * 7"))
    browser.get(path.as_uri())
    assert browser.find_element("id", "p").text == "42"
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    path.write_text(PAGE.format("nothing.here()"))
    browser.get(path.as_uri())
    (said,) = (entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE")
    assert "nothing is not defined" in said["message"]
