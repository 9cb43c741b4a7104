"""Parts of the page by themselves: ticks, coverage, texts that quote, sources and drawings that are wide."""

from __future__ import annotations

import pytest

from tests import outside
from tests.extensions.view.samples import sample
from tests.extensions.view.test_page import Open, shown, slide, wait_for

pytestmark = [pytest.mark.slow, outside.needs("chromium", "chromedriver", "selenium")]


def test_ticks_under_the_slider_stay_at_their_rows_when_rows_come(page: Open) -> None:
    driver = page(sample(12))
    left = "return document.querySelector('.strip .violation').style.left"
    assert (shown(driver)["row"], driver.execute_script(left)) == (12, "100%")
    driver.execute_script(
        "const { walk, refresh } = llfsmView; const { rows } = walk.run;"
        "for (let i = 0; i < 36; i += 1) for (const column of Object.values(rows)) column.push(column.at(-1));"
        "refresh()"
    )
    shown(driver)
    assert driver.execute_script(left) == "25%"


def test_what_is_not_covered_is_listed_and_drawn_so(page: Open) -> None:
    document = sample() | {"runs": [], "verdicts": [], "source": "coverage"}
    north, west = document["machines"]
    goals = [
        {"kind": kind, "status": "covered" if i != 1 else "reachable", "name": f"{name}: {i}", "span": item["place"]}
        for name, kind, items in (("north", "state", north["states"]), ("west", "state", west["states"]))
        for i, item in enumerate(items)
    ]
    goals[5]["status"] = "unreachable"
    north["transitions"][2]["place"] = place = [0, 6, 1, 6, 9]
    goals.append({"kind": "transition", "status": "reachable", "name": "north: AMBER -> RED when turn", "span": place})
    document["coverage"] = {"counts": {"state": {"covered": 3, "reachable": 3}}, "goals": goals}
    driver = page(document)
    listed = driver.find_elements("css selector", "#coverage [aria-label='Goals that are not covered'] tbody tr")
    assert [row.text.split()[0] for row in listed] == ["north:", "west:", "west:", "north:"]
    assert all(row.is_displayed() and row.find_element("css selector", "button").text for row in listed)
    folded = driver.find_elements("css selector", "#coverage [aria-label='Goals that are covered'] tbody tr")
    assert [row.is_displayed() for row in folded] == [False] * 3
    missing = driver.find_elements("css selector", ".machine [data-state]:not(.visited)")
    assert [item.get_attribute("data-state") for item in missing] == ["GREEN", "GREEN", "AMBER"]
    edges = driver.find_elements("css selector", ".machine [data-transition]:not(.visited)")
    assert [item.get_attribute("data-transition") for item in edges] == ["2"]
    said = "Machines: covered are 3 of 6 states, 0 of 1 transitions; what is not is dashed"
    assert driver.find_element("id", "machines-title").text == said
    coverage, run = (driver.find_element("id", name).rect["y"] for name in ("coverage", "run"))
    assert coverage < run
    listed[0].find_element("css selector", "button").click()
    assert driver.execute_script("return document.querySelector('.line.chosen').dataset.line") == "2"


def test_only_machines_that_are_known_are_counted(page: Open) -> None:
    document = sample(12)
    document["machines"][1]["signal"] = None
    driver = page(document)
    shown(driver)
    assert driver.find_element("id", "machines-title").get_attribute("data-visits").split()[1::2] == ["3", "3"]
    assert not driver.find_elements("css selector", "[data-machine='1'] [data-state]:not(.visited)")


def test_what_a_text_quotes_is_code(page: Open) -> None:
    document = sample(12)
    document["notes"] = ["`<b>` is not `", "plain"]
    document["verdicts"][0]["reason"] = document["runs"][0]["title"] = "`north@GREEN` and `west` are"
    document["runs"][0]["marks"][-1]["text"] = "safe: `north@GREEN`"
    driver = page(document)
    shown(driver)
    wait_for(driver, "document.querySelector('#said code')")
    places = ("#notes li", "#verdicts td p", "#run-text", "#said", "#events .violation button")
    codes = {place: [one.text for one in driver.find_elements("css selector", f"{place} code")] for place in places}
    assert list(codes.values()) == [
        ["<b>"], ["north@GREEN", "west"], ["north@GREEN", "west"], ["north@GREEN"], ["north@GREEN"],
    ]  # fmt: skip
    assert [one.text for one in driver.find_elements("css selector", "#notes li")] == ["<b> is not `", "plain"]


def test_long_lines_of_a_source_are_scrolled_to(page: Open) -> None:
    document = sample(12)
    document["files"][0]["text"] = f"short\n{'long ' * 100}\n"
    driver = page(document)
    shown(driver)
    driver.execute_script("document.querySelector('.text').scrollIntoView()")
    shown(driver)
    wide = "const text = document.querySelector('.text'); return text.scrollWidth - text.clientWidth"
    assert driver.execute_script(wide) > 1000


def test_where_lines_that_ran_are_unknown_the_transition_that_fired_is_marked(page: Open) -> None:
    document = sample(12)
    (run,) = document["runs"]
    run["ran"] = None
    row, machine, transition = run["fired"][0]
    document["machines"][machine]["transitions"][transition]["place"] = [1, 1, 1, 1, 5]
    driver = page(document)
    assert slide(driver, row)["ran"] == [1]
    assert driver.execute_script("return document.querySelector('.text').dataset.file") == "props.ltl"
    assert slide(driver, 0)["ran"] == []


def test_letters_of_all_drawings_have_one_size(page: Open) -> None:
    document = sample(12)
    wide = document["machines"][0]["svg"]
    document["machines"][1]["svg"] = wide.replace('viewBox="0 0 100', 'viewBox="0 0 500').replace("60 ", "600 ")
    driver = page(document)
    scales = "return [...document.querySelectorAll('.drawing svg')].map((s) => Math.round(100 * s.getScreenCTM().a))"
    assert driver.execute_script(scales) == [100, 100]
