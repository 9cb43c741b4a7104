"""What it costs to watch a run: `python -m benchmarks.viewing`. The lift with its shaft runs at 10 ms a cycle: alone,
with `llfsm view` of which no page is open, and with its page in chromium. For each it prints how late cycles began, as
the run says it, and the processor time of who watches, once the page is there.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import llfsm_verify as lv
from tools import oracles

LIFT = Path(__file__).parent.parent / "models" / "lift" / "arrangement.yaml"
NAME = "viewing"
RATE = 100
"""A cycle of the lift takes 1 s: at this rate 10 ms."""
VIEW = (
    "import sys; from llfsm_verify.extensions.view.live import view_live; "
    f"view_live({NAME!r}, None, lambda line: print(line, flush=True))"
)
PATIENCE = 30.0
"""Seconds for a process to begin."""
SETTLED = 1.0
"""Seconds until a page is drawn."""
TICKS = os.sysconf("SC_CLK_TCK")
SHOWN = """
const { shown, missed, skipped } = document.querySelector("#live").dataset;
return { shown: Number(shown), missed: Number(missed), skipped: Number(skipped) };
"""
QUIET = ("--headless=new", "--disable-gpu", "--no-sandbox", "--no-first-run", "--disable-background-networking")


@dataclass(frozen=True, slots=True)
class Watched:
    """One run."""

    how: str
    lateness: str
    viewer: float | None
    """Processor time over the time that was watched, of `llfsm view`."""
    browser: float | None
    page: dict[str, float]
    """What the page says at the end."""

    def __str__(self) -> str:
        shares = ((self.viewer, "llfsm view"), (self.browser, "chromium"))
        told = [f"{share:.1%} of a processor: {who}" for share, who in shares if share is not None]
        if self.page:
            told.append("page: {shown:,.0f} rows, {missed:,.0f} missed, {skipped:,.0f} not shown".format(**self.page))
        return "\n  ".join([f"{self.how}:", self.lateness, *told])


def watch(how: str, seconds: float) -> Watched:
    """Let the lift run so long: `alone`, `viewed` without a page, or with a `page`."""
    with ExitStack() as left:
        run = left.enter_context(running(seconds))
        viewer, driver = None, None
        if how != "alone":
            viewer = left.enter_context(begun([sys.executable, "-c", VIEW]))
            assert viewer.stdout is not None
            address = next(line.split(maxsplit=1)[0] for line in viewer.stdout if line.startswith("http"))
            if how == "page":
                driver = left.enter_context(opened(address))
            time.sleep(SETTLED)
        began, before = time.monotonic(), [_spent(viewer), _spent(driver and driver.service.process)]
        while time.monotonic() < began + 0.8 * seconds and run.poll() is None:
            time.sleep(0.05)
        after, took = [_spent(viewer), _spent(driver and driver.service.process)], time.monotonic() - began
        page = driver.execute_script(SHOWN) if driver else {}
        said = run.communicate(timeout=seconds + PATIENCE)[0]
        pairs = zip(before, after, strict=True)
        own, of_page = (None if first is None or last is None else (last - first) / took for first, last in pairs)
        late = next((line for line in said.splitlines() if line.startswith("lateness")), said)
        return Watched(how, late, own, of_page, page)


@contextmanager
def begun(command: Sequence[str]) -> Iterator[subprocess.Popen[str]]:
    """A process, which is ended if it goes on."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            yield process
        finally:
            if process.poll() is None:
                process.terminate()
                process.communicate(timeout=PATIENCE)


@contextmanager
def running(seconds: float) -> Iterator[subprocess.Popen[str]]:
    """The lift, once it runs."""
    how = ["--simulate", "--seed", "1", "--rate", str(RATE), "--for", f"{seconds * RATE:.0f}s", "--whiteboard", NAME]
    with begun([sys.executable, "-m", "llfsm_verify", "run", str(LIFT), *how]) as process:
        until = time.monotonic() + PATIENCE
        while True:
            try:
                with lv.Whiteboard(NAME) as board:
                    board.view()
                break
            except lv.WhiteboardError:
                if time.monotonic() > until or process.poll() is not None:
                    raise
                time.sleep(0.02)
        yield process


@contextmanager
def opened(address: str) -> Iterator[Any]:
    """A browser with a page."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = str(oracles.find("chromium"))
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        for argument in (*QUIET, f"--user-data-dir={folder}", "--window-size=1280,900"):
            options.add_argument(argument)
        driver = webdriver.Chrome(options=options, service=Service(str(oracles.find("chromedriver"))))
        try:
            driver.get(address)
            yield driver
        finally:
            driver.quit()


def _spent(process: subprocess.Popen[Any] | None) -> float | None:
    """Seconds of processor time of a process and all that it has started, so far."""
    if process is None:
        return None
    parents, spent = {}, {}
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
        except OSError:  # it has ended
            continue
        parents[int(entry.name)], spent[int(entry.name)] = int(fields[1]), sum(map(int, fields[11:13])) / TICKS

    def belongs(pid: int) -> bool:
        while pid and pid != process.pid:
            pid = parents.get(pid, 0)
        return pid == process.pid

    return sum(seconds for pid, seconds in spent.items() if belongs(pid))


def main(given: Sequence[str] | None = None) -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.viewing", description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="how long each run takes")
    parser.add_argument("--no-page", action="store_true", help="without a browser")
    options = parser.parse_args(given)
    for how in ("alone", "viewed", *([] if options.no_page else ["page"])):
        print(watch(how, options.seconds), flush=True)


if __name__ == "__main__":
    main()
