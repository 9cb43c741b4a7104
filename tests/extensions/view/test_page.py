"""The page in a real browser, judged by the values that it shows."""

from __future__ import annotations

import json
import random
import threading
from bisect import bisect_right
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any
from urllib.parse import parse_qsl, urlsplit

import jsonschema
import pytest
from selenium.webdriver.common.keys import Keys

from llfsm_verify.extensions.view.page import page_html
from tests import outside
from tests.extensions.view.samples import COLOURS, sample

pytestmark = [pytest.mark.slow, outside.needs("chromium", "chromedriver", "selenium")]

Open = Callable[[Any], Any]
SHOWN = """
const all = (inside, query) => [...inside.querySelectorAll(query)], one = (query) => document.querySelector(query);
const machines = all(document, '.machine');
return {
  row: Number(document.body.dataset.row), run: Number(document.body.dataset.run),
  lit: machines.map((m) => all(m, '[data-state].lit').map((s) => s.dataset.state)),
  fired: machines.map((m) => all(m, '[data-transition].lit').map((t) => Number(t.dataset.transition))),
  told: machines.map((m) => [m.dataset.state, m.dataset.fired]),
  values: all(document, '#values .value').map((cell) => cell.textContent),
  where: one('#slider').getAttribute('aria-valuetext'), slider: Number(one('#slider').value),
  ran: all(document, '.line.ran').map((line) => Number(line.dataset.line)), timing: {...one('.timing').dataset},
};
"""
FILLS = """
const fill = (path) => getComputedStyle(path).fill;
return [...document.querySelectorAll('.lanes path[data-value]')].map((p) => [p.dataset.value, fill(p)]).concat(
  [...document.querySelectorAll('[data-state].lit > path')].map((p) => [p.parentNode.dataset.state, fill(p)]));
"""
OVERLAPS = """
const texts = [...document.querySelectorAll('.timing .axis text, .timing .lanes .lane text')];
const boxes = texts.map((text) => text.getBoundingClientRect());
const meet = (a, b) => a.left < b.right - .5 && b.left < a.right - .5 && a.top < b.bottom - 3 && b.top < a.bottom - 3;
return boxes.flatMap((a, i) => boxes.slice(i + 1).filter((b) => meet(a, b))).length;
"""
FAINT = """
const light = (c) => c / 255 <= .03928 ? c / 255 / 12.92 : ((c / 255 + .055) / 1.055) ** 2.4;
const numbers = (text) => (text.match(/[\\d.]+/g) || [0, 0, 0, 0]).map(Number);
const brightness = ([r, g, b]) => .2126 * light(r) + .7152 * light(g) + .0722 * light(b);
const under = (e) => { for (; e; e = e.parentElement) {
  const colour = numbers(getComputedStyle(e).backgroundColor);
  if (colour.length < 4 || colour[3] === 1) return colour; }
  return [255, 255, 255]; };
const texts = [...document.querySelectorAll('body *')].filter((e) => e.checkVisibility() && !e.closest('svg')
  && [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim()));
return texts.map((e) => { const [a, b] = [numbers(getComputedStyle(e).color), under(e)].map(brightness);
  return [e.outerHTML.slice(0, 90), (Math.max(a, b) + .05) / (Math.min(a, b) + .05)];
}).filter(([, ratio]) => ratio < 4.5);
"""
FRAME = "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => done()));"


def shown(driver: Any) -> Any:
    """What the page shows, after the next frames."""
    driver.execute_async_script(FRAME)
    return driver.execute_script(SHOWN)


def wait_for(driver: Any, condition: str) -> None:
    """Wait until it is true in the page; the driver's limit of a script ends it."""
    script = f"const [done] = arguments; const look = () => {condition} ? done() : setTimeout(look, 20); look();"
    driver.execute_async_script(script)


def press(driver: Any, *keys: str) -> Any:
    for key in keys:
        driver.switch_to.active_element.send_keys(key)
    return shown(driver)


def slide(driver: Any, value: float) -> Any:
    script = "const s = document.querySelector('#slider'); s.value = arguments[0]; s.dispatchEvent(new Event('input'))"
    driver.execute_script(script, value)
    return shown(driver)


def value(run: Any, signal: int, row: int) -> Any:
    change = run["changes"][signal]
    return change["values"][bisect_right(change["at"], row) - 1]


def word(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def expect(document: Any, row: int, seen: Any) -> None:
    """All that the page shows of a row equals what the document says, as Python reads it."""
    run = document["runs"][0]
    states = [value(run, machine["signal"], row) for machine in document["machines"]]
    fired = [[t for r, m, t in run["fired"] if (r, m) == (row, i)] for i in range(len(document["machines"]))]
    assert seen["row"] == row
    assert seen["lit"] == [[state] for state in states]
    assert [state for state, _ in seen["told"]] == states
    assert [said for _, said in seen["told"]] == [" ".join(map(str, numbers)) for numbers in fired]
    assert seen["fired"][0] == fired[0]
    units = [f" {signal['unit']}" if "unit" in signal else "" for signal in document["signals"]]
    assert seen["values"] == [word(value(run, i, row)) + unit for i, unit in enumerate(units)]
    places = run["ran"]["sets"][run["ran"]["rows"][row]]
    assert seen["ran"] == [line for place in places for line in range(place[1], place[3] + 1)]
    assert int(seen["timing"]["first"]) <= row <= int(seen["timing"]["last"])


def test_the_slider_moves_the_whole_picture(page: Open) -> None:
    document = sample(60, seed=3)
    driver = page(document)
    expect(document, 60, shown(driver))
    for row in (0, *random.Random(1).sample(range(60), 12)):
        expect(document, row, slide(driver, row))
    assert driver.find_element("css selector", "#title").text == "Two lights"
    verdicts = driver.find_elements("css selector", "#verdicts tr[data-name]")
    assert [row.get_attribute("data-verdict") for row in verdicts] == ["violated", "holds", "unknown"]


def test_the_slider_goes_by_cycles_and_by_time(page: Open) -> None:
    document = sample(20)
    driver = page(document)
    for unit, position, row in (("cycle", 4, 7), ("time", 350, 6), ("time", 1000, 20), ("step", 3, 3)):
        driver.find_element("css selector", f"#unit option[value={unit}]").click()
        shown(driver)
        seen = slide(driver, position)
        expect(document, row, seen)
        assert (
            seen["where"] == f"step {row}, cycle {(row + 1) // 2}, {'1 s' if row >= 19 else f'{(row + 1) // 2}00 ms'}"
        )


def test_all_is_done_by_the_keyboard_and_told_in_words(page: Open) -> None:
    document = sample(12, seed=2)
    driver = page(document)
    driver.find_element("css selector", "body").send_keys(Keys.TAB)
    assert driver.switch_to.active_element.get_attribute("class") == "skip"
    press(driver, Keys.ENTER)
    press(driver, Keys.HOME)
    moves = [
        (Keys.ARROW_RIGHT, 1), (Keys.ARROW_RIGHT, 2), (Keys.SHIFT + Keys.ARROW_RIGHT + Keys.NULL, 3),
        (Keys.ARROW_LEFT, 2), ("v", 12), ("E", 6), ("E", 4), ("e", 6), (Keys.HOME, 0), (Keys.END, 12),
        (Keys.SHIFT + Keys.ARROW_LEFT + Keys.NULL, 11), ("V", 11),
    ]  # fmt: skip
    for key, row in moves:
        expect(document, row, press(driver, key))
    press(driver, "c")
    press(driver, Keys.END)
    wait_for(driver, "document.querySelector('#said').textContent.includes('Violation: safe: both are green.')")
    press(driver, "?")
    assert driver.execute_script("return document.querySelector('#help').open")
    assert "next violation" in driver.find_element("css selector", "#help").text
    assert driver.execute_script("return document.querySelector('#help').scrollTop") == 0
    press(driver, Keys.ESCAPE)
    driver.execute_script("document.querySelector('#verdicts [data-run]').focus()")
    expect(document, 12, press(driver, Keys.ENTER))
    seen = press(driver, "+")
    narrow = int(seen["timing"]["last"]) - int(seen["timing"]["first"])
    assert narrow < 12
    assert int(press(driver, "0")["timing"]["last"]) == 12
    names = driver.execute_script(
        "return [...document.querySelectorAll('button, select, input, [tabindex=\"0\"]')].filter((e) => "
        "!(e.textContent.trim() || e.getAttribute('aria-label') || e.labels?.length)).map((e) => e.outerHTML)"
    )
    assert names == []


def test_events_lanes_and_groups_are_pointed_at(page: Open) -> None:
    document = sample(12, seed=2)
    driver = page(document)
    driver.find_element("css selector", "#events li[data-row='6'] button").click()
    seen = shown(driver)
    expect(document, 6, seen)
    changed = driver.find_elements("css selector", "#values tr.changed .value")
    run = document["runs"][0]
    assert [int(cell.get_attribute("data-signal")) for cell in changed] == [
        number for number, change in enumerate(run["changes"]) if 6 in change["at"]
    ]
    signs = [sign.text for sign in driver.find_elements("css selector", "#values tr:not(.group) .sign")]
    assert signs[2] == "◆"
    point = """const field = document.querySelector('.field'), lane = document.querySelector('.lane[data-signal="0"]');
        const [box, at] = [field.getBoundingClientRect(), lane.getBoundingClientRect()];
        const x = box.left + box.width * 9.5 / 13, y = at.top + at.height / 2;
        const event = (kind, more) => field.dispatchEvent(new kind[0](kind[1], {clientX: x, clientY: y, ...more}));
        event([PointerEvent, 'pointermove'], {}); const said = document.querySelector('.readout').textContent;
        event([PointerEvent, 'pointerdown'], {buttons: 1});
        event([WheelEvent, 'wheel'], {deltaY: -1, ctrlKey: true, cancelable: true}); return said;"""
    assert driver.execute_script(point) == f"step 9, cycle 5, 500 ms: north = {value(run, 0, 9)}"
    seen = shown(driver)
    expect(document, 9, seen)
    assert int(seen["timing"]["last"]) - int(seen["timing"]["first"]) < 12
    driver.find_element("css selector", "[data-group=states]").click()
    assert not driver.find_elements("css selector", ".lane[data-signal='0']")
    driver.find_element("css selector", "[data-lane='2']").click()
    press(driver, Keys.HOME)
    expect(document, run["changes"][2]["at"][1], press(driver, "c"))


def test_a_lasso_is_played_on_and_on_and_another_run_ends(page: Open) -> None:
    play = """const done = arguments[0]; const { walk, refresh } = llfsmView; const rows = [];
        walk.speed = 200; walk.toggle(); refresh();
        const look = () => { rows.push([Number(document.body.dataset.row), walk.playing]);
          if (walk.laps > 2 || !walk.playing) { walk.playing = false; done([rows, walk.laps]); }
          else requestAnimationFrame(look); }; look();"""
    driver = page(sample(12, loop=4))
    rows, laps = driver.execute_async_script(play)
    assert laps > 2
    assert {row for row, _ in rows} <= set(range(13))
    driver = page(sample(12, loop=None))
    _, laps = driver.execute_async_script(play)
    driver.execute_async_script(FRAME)
    assert (laps, shown(driver)["row"]) == (0, 12)
    assert driver.find_element("css selector", "#play").text == "▶ Play"


def test_a_colour_is_that_of_the_document_in_light_and_in_dark(page: Open) -> None:
    driver = page(sample(12))
    papers = set()
    for theme in ("light", "dark"):
        while driver.find_element("css selector", "#theme").text != f"Theme: {theme}":
            press(driver, "t")
        # transitions of colours end
        driver.execute_async_script("const done = arguments[0]; setTimeout(done, 200)")
        found = driver.execute_script(FILLS)
        assert {name for name, _ in found} == set(COLOURS)
        for name, fill in found:
            red, green, blue = bytes.fromhex(COLOURS[name][theme][1:])
            assert fill == f"rgb({red}, {green}, {blue})"
        assert driver.execute_script(FAINT) == []
        papers.add(driver.execute_script("return getComputedStyle(document.body).backgroundColor"))
    assert len(papers) == 2
    press(driver, "t")
    for theme in ("dark", "light"):
        wanted = {"features": [{"name": "prefers-color-scheme", "value": theme}]}
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", wanted)
        wait_for(driver, f"document.documentElement.dataset.theme === '{theme}'")
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_nothing_in_names_is_taken_for_a_page(page: Open) -> None:
    bad = "<script>window.broken = 1</script>"
    names = (bad, "\"'</script><img src=x onerror='window.broken = 1'>", "G" * 1_000_000, "]]>&amp;\u2028${x}`")
    document = sample(12, states=names)
    for machine in document["machines"]:
        machine["svg"] = None
    document["machines"][1]["svg"] = (
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" onload="window.broken = 1">'
        "<script>window.broken = 1</script><a xlink:href='javascript:window.broken=1'><text>kept</text></a>"
        "<foreignObject><body xmlns='http://www.w3.org/1999/xhtml' onload='window.broken=1'/></foreignObject>"
        "<style>@import 'http://127.0.0.1:9/x.css'</style><image href='http://127.0.0.1:9/x.png'/></svg>"
    )
    document["colours"] = dict.fromkeys(names, COLOURS["RED"]) | {"__proto__": COLOURS["RED"]}
    document["title"] = document["arrangement"]["name"] = document["runs"][0]["title"] = bad
    document["notes"] = [bad, "x" * 1_000_000]
    document["files"][0] = {"name": bad, "text": f"{bad}\n{'y' * 1_000_000}\n", "cut": 12}
    document["verdicts"][0] |= {"name": bad, "text": bad, "reason": bad, "words": bad}
    document["runs"][0]["marks"][0]["text"] = bad
    driver = page(document)
    for row in range(13):
        slide(driver, row)
    assert driver.execute_script("return window.broken") is None
    assert driver.find_element("css selector", "#title").text == bad
    assert driver.find_element("css selector", "#notes li").text == bad
    assert len(driver.find_elements("css selector", "main script, main style, main img, main a, image")) == 0
    assert driver.find_elements("css selector", ".drawing text")[0].text == "kept"
    assert (
        driver.execute_script("return document.documentElement.outerHTML.length - document.scripts[0].text.length")
        < 6e6
    )


def part(first: int, last: int) -> Any:
    """A document with some rows of a run of 90 steps."""
    document = sample(90)
    (run,) = document["runs"]
    run["window"] = {"first": first, "total": 91}
    run["rows"] = {name: column[first : last + 1] for name, column in run["rows"].items()}
    for signal, change in enumerate(run["changes"]):
        pairs = [(row - first, value(run, signal, row)) for row in change["at"] if first < row <= last]
        change_here = {0: value(run, signal, first)} | dict(pairs)
        run["changes"][signal] = {"at": list(change_here), "values": list(change_here.values())}
    run["fired"] = [[row - first, *which] for row, *which in run["fired"] if first < row <= last]
    run["ran"]["rows"] = run["ran"]["rows"][first : last + 1]
    run["marks"] = [mark | {"row": mark["row"] - first} for mark in run["marks"] if first <= mark["row"] <= last]
    return document


@pytest.fixture
def windows() -> Iterator[str]:
    """The address of a server of that run, which cannot tell of rows from 60 on."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked = urlsplit(self.path)
            rows = {name: int(number) for name, number in parse_qsl(asked.query)}
            late = rows.get("first", 0) >= 60
            text = json.dumps(part(**rows)) if rows else page_html(part(0, 29), {"window": "/window"})
            self.send_response(500 if late else 200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.end_headers()
            self.wfile.write(b"they are gone" if late else text.encode())

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


def test_other_rows_of_a_long_run_are_asked_for(browser: Any, windows: str) -> None:
    browser.get(windows)
    expect(part(0, 29), 5, slide(browser, 5))
    assert not browser.find_element("css selector", "#earlier").is_enabled()
    press(browser, Keys.PAGE_DOWN)
    wait_for(browser, "document.body.textContent.includes('rows 30 to 59 of 91')")
    expect(part(30, 59), 9, slide(browser, 9))
    assert shown(browser)["where"] == "step 39, cycle 20, 2 s"
    browser.find_element("css selector", "#later").click()
    wait_for(browser, "document.body.textContent.includes('The rows could not be had: they are gone')")
    expect(part(30, 59), 9, shown(browser))
    browser.get_log("browser")


@pytest.mark.parametrize("change", [{"version": 2}, {"format": "other"}])
def test_another_document_is_refused_in_words(page: Open, change: dict[str, Any]) -> None:
    driver = page(sample() | change)
    said = driver.find_element("css selector", "#problem").text
    assert said in ("The document has version 2; this page reads version 1.",
                    "The page holds no document of the format llfsm-view.")  # fmt: skip


def test_a_document_without_runs_shows_its_verdicts(page: Open) -> None:
    driver = page(sample() | {"runs": [], "verdicts": sample()["verdicts"][1:]})
    assert driver.find_element("css selector", "#verdicts .summary").text == "1 holds, 1 unknown"
    for empty in ("player", "timing", "values"):
        assert not driver.find_element("id", empty).is_displayed()
    assert not driver.find_elements("css selector", "[data-state]:not(.visited)")


@pytest.mark.parametrize(("kind", "row"), [("violation", 40), ("fault", 40), ("reached", 0), (None, 400)])
def test_the_button_of_a_verdict_goes_to_the_row_that_violates_or_to_the_last(
    page: Open, kind: str | None, row: int
) -> None:
    document = sample(400)
    marks = [{"row": 20, "kind": "event", "text": "an event"}]
    document["runs"][0]["marks"] = marks + ([{"row": row, "kind": kind, "text": "here"}] if kind else [])
    driver = page(document)
    driver.find_element("css selector", "#verdicts [data-run]").click()
    expect(document, row, shown(driver))


def test_every_width_holds_the_page(page: Open) -> None:
    document = sample(40)
    document["signals"][2]["name"] = "navigation.lane_follower.obstacle_detected_in_front_of_the_vehicle"
    document["verdicts"][0]["name"] = "never_are_both_directions_green_at_once_or_one_after_another"
    driver = page(document)
    try:
        for width in (1280, 600):
            metrics = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
            driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
            shown(driver)
            assert driver.execute_script("return document.documentElement.scrollWidth") <= width
            overlaps = driver.execute_script(OVERLAPS)
            assert overlaps == 0
            cut = "return [...document.querySelectorAll('.label, .names')].filter((e) => e.scrollWidth > e.clientWidth)"
            assert driver.execute_script(cut) == []
    finally:
        driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


@pytest.mark.long
def test_ten_thousand_steps_are_as_fluid_as_ten(page: Open) -> None:
    document = sample(10_000)
    driver = page(document)
    for row in random.Random(4).sample(range(10_001), 5):
        expect(document, row, slide(driver, row))
    press(driver, "0")
    elements = driver.execute_script("return document.querySelectorAll('.timing *').length")
    assert elements < 3000
    work = """const done = arguments[0]; const { walk, refresh } = llfsmView; let frames = 0; let worst = 0;
        const next = () => { const start = performance.now(); walk.go((frames * 977) % 10001); refresh();
          requestAnimationFrame(() => { worst = Math.max(worst, performance.now() - start);
            frames += 1; if (frames < 60) next(); else done([frames, worst]); }); }; next();"""
    frames, _ = driver.execute_async_script(work)
    assert frames == 60


def test_the_document_is_within_its_schema() -> None:
    schema = json.loads(files("llfsm_verify.extensions.view").joinpath("view.schema.json").read_text())
    jsonschema.validate(sample(30), schema)
