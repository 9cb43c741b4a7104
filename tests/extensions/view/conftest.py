"""A real browser, one for the tests of a module: chromium without a window, driven by its own driver."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from llfsm_verify.extensions.view.page import page_html
from tests import outside

ALONE = (
    "--headless=new",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-extensions",
    "--force-device-scale-factor=1",
)
"""It shows nothing, and asks for nothing but our pages."""


@contextmanager
def started_browser(folder: Path) -> Iterator[Any]:
    """A driver of Selenium at 1280 by 900 pixels, whose profile is in an empty folder."""
    for name in ("chromium", "chromedriver"):
        outside.demand(name)
    webdriver = outside.load("selenium", "selenium.webdriver")
    service = outside.load("selenium", "selenium.webdriver.chrome.service")
    options = webdriver.ChromeOptions()
    options.binary_location = outside.program("chromium")
    for argument in (*ALONE, f"--user-data-dir={folder}", "--window-size=1280,900"):
        options.add_argument(argument)
    if os.geteuid() == 0:
        options.add_argument("--no-sandbox")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=service.Service(outside.program("chromedriver")))
    driver.set_page_load_timeout(60)
    driver.set_script_timeout(60)
    try:
        yield driver
    finally:
        driver.quit()
        shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A browser. It keeps what pages write to the console: see `no_errors`."""
    with started_browser(tmp_path_factory.mktemp("chromium")) as driver:
        yield driver


@pytest.fixture
def no_errors(browser: Any) -> Iterator[Callable[[], None]]:
    """What fails when a page has written an error to the console; it is also asked at the end of the test."""
    browser.get_log("browser")

    def ask() -> None:
        said = [entry["message"] for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
        assert said == []

    yield ask
    ask()


@pytest.fixture
def opened(browser: Any, no_errors: Callable[[], None], tmp_path: Path) -> Callable[[str], Any]:
    """Opens a page from its HTML as a file, without a server, and gives the browser."""

    def opened(html: str) -> Any:
        path = tmp_path / "page.html"
        path.write_text(html, encoding="utf-8")
        browser.get(path.as_uri())
        no_errors()
        return browser

    return opened


@pytest.fixture
def page(opened: Callable[[str], Any]) -> Callable[[Any], Any]:
    """Opens the page of a document, and gives the browser."""
    return lambda document: opened(page_html(document))
