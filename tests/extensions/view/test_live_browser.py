"""A live view in a real browser: a run that goes on, ends, is started again and is killed, and a foreign page."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from functools import partial
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import Any

import pytest

import llfsm_verify as lv
from tests.extensions.view.clients import wait_until
from tests.extensions.view.test_live import boards, counter, serves, started, viewed

__all__ = ["boards", "counter"]

LIVE = """
const { walk, view } = globalThis.llfsmView;
const { dataset } = document.querySelector("#live");
const said = document.querySelector("#live .lag").textContent;
return { ...dataset, said, rows: walk.run.rows.step, changes: walk.run.changes, row: walk.row, lit: view.machines.map(
  (machine) => walk.run.changes[machine.signal].values.at(-1)) };
"""
FOREIGN = """<!doctype html><script>
window.said = [];
const tell = (name) => () => window.said.push(name);
fetch("{0}/window?first=0&last=1", {{ credentials: "include" }}).then(tell("read"), tell("fetch refused"));
const hidden = async (answer) => window.said.push("opaque " + (await answer.text()).length);
fetch("{0}/", {{ mode: "no-cors", credentials: "include" }}).then(hidden, tell("no-cors refused"));
const events = new EventSource("{0}/events", {{ withCredentials: true }});
events.onopen = tell("stream read");
events.onerror = () => {{ events.close(); window.said.push("stream refused"); }};
const script = document.createElement("script");
script.src = "{0}/";
script.onload = tell("script read");
script.onerror = tell("script refused");
document.head.append(script);
</script>"""


def live(browser: Any) -> Any:
    return browser.execute_script(LIVE)


def connected(browser: Any) -> Callable[[], bool]:
    return lambda: bool(browser.execute_script("return Boolean(globalThis.llfsmView)")) and bool(live(browser)["rows"])


@pytest.mark.long
def test_a_run_is_followed_killed_and_followed_again(browser, counter, no_errors):
    command = (str(counter), "--whiteboard", "counter", "--processes", "together")
    with started(*command) as process:
        wait_until(lambda: serves("counter"))
        with viewed("counter") as address:
            browser.get(address.url)
            wait_until(lambda: len(live(browser)["rows"]) > 50)
            wait_until(lambda: live(browser)["said"] == "● follows the run")
            seen = live(browser)
            assert seen["connection"] == "live"
            assert seen["rows"] == sorted(set(seen["rows"]))
            no_errors()
            browser.execute_script("globalThis.mark = 1")
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
            wait_until(lambda: live(browser)["said"] == "■ the run is over: a process died")
            over = live(browser)
            assert over["rows"][: len(seen["rows"])] == seen["rows"], "the page keeps what it has"
            with started(*command):
                wait_until(lambda: browser.execute_script("return globalThis.mark") is None)
                wait_until(connected(browser))
                wait_until(lambda: live(browser)["said"] == "● follows the run")
            wait_until(lambda: live(browser)["said"] == "■ the run is over: stopped")
            no_errors()
        wait_until(lambda: live(browser)["said"].startswith("✗ the connection is lost"))
    browser.get("about:blank")
    browser.get_log("browser")  # the connection was refused, as it should be


@pytest.mark.long
def test_a_machine_is_replaced_before_the_eyes(browser, counter, no_errors):
    with lv.load(counter).run(whiteboard="counter") as run, viewed("counter") as address:
        browser.get(address.url)
        wait_until(connected(browser))
        assert live(browser)["lit"][0] in ("UP", "TOP")
        run.replace("count", counter.parent / "down.yaml", unchecked=True)
        wait_until(lambda: connected(browser)() and live(browser)["lit"][0] in ("DOWN", "LOW"))
        assert "count was replaced" in browser.find_element("id", "notes").text
        no_errors()
        browser.get("about:blank")


class Foreign(BaseHTTPRequestHandler):
    """A page of another server on this computer, whose requests have our cookies."""

    def __init__(self, page: str, *given: Any) -> None:
        self.page = page.encode()
        super().__init__(*given)

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(self.page)

    def log_message(self, *_: object) -> None:
        """Nothing."""


@pytest.mark.long
@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"])
def test_a_foreign_page_learns_nothing(browser, counter, host):
    """Neither from the same host, to which the browser sends our cookie, nor from another one."""
    with lv.load(counter).run(whiteboard="counter"), viewed("counter") as address:
        browser.get(address.url)
        wait_until(connected(browser))
        page = FOREIGN.format(f"http://127.0.0.1:{address.port}")
        with HTTPServer(("127.0.0.1", 0), partial(Foreign, page)) as other:
            thread = threading.Thread(target=other.serve_forever, args=(0.05,))
            thread.start()
            browser.get(f"http://{host}:{other.server_port}/")
            wait_until(lambda: len(browser.execute_script("return window.said")) == 4)
            said = set(browser.execute_script("return window.said"))
            other.shutdown()
            thread.join()
        assert {"fetch refused", "stream refused", "script refused"} < said
        assert said <= {"fetch refused", "stream refused", "script refused", "no-cors refused", "opaque 0"}
        browser.get("about:blank")
        browser.get_log("browser")
