"""The pictures of docs/viewing.md: what the browser shows, with the words on them beside the pixels.

    python -m tests.extensions.view.pictures

writes them anew. A test makes them again and compares the words: which pixels there are, fonts decide.
"""

from __future__ import annotations

import struct
import tempfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import llfsm_verify as lv
from llfsm_verify.extensions.view.document import document_of_result
from llfsm_verify.extensions.view.live import view_live
from llfsm_verify.extensions.view.page import page_html
from tests.extensions.view.clients import served, wait_until
from tests.extensions.view.conftest import started_browser

FOLDER = Path("docs/pictures")
WIDTH, HEIGHT = 1280, 1180
WORDS = """
const words = [...document.querySelectorAll('h1, h2, h3, th, #run-text, #verdicts td, #said, .machine title')];
return words.filter((one) => one.checkVisibility()).map((one) => one.textContent.trim().replace(/\\s+/g, ' '))
"""
KEY = b"Description"


def report(driver: Any) -> list[str]:
    """The faulty traffic lights, where both are green."""
    model = lv.load("models/traffic_lights/faulty.yaml")
    result = model.check(Path("properties/traffic_lights.ltl"))
    document = document_of_result(result.wrapped, model.wrapped)
    document["statistics"] = []  # how long it took
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "out.html")
        path.write_text(page_html(document), encoding="utf-8")
        driver.get(path.as_uri())
        driver.execute_script("document.querySelector('#verdicts [data-run]').click()")
        wait_until(lambda: driver.execute_script("return document.body.dataset.row !== '0'"))
        driver.execute_script("document.querySelector('.timing').scrollIntoView({ block: 'end' })")
        return list(driver.execute_script(WORDS))


def live(driver: Any) -> list[str]:
    """The lift, while a simulation of its surroundings runs."""
    model = lv.load("models/lift/arrangement.yaml")
    with (
        model.run(simulate=True, seed=4, hold="10s", rate=50, whiteboard="lift", processes="together") as run,
        served(lambda tell, ended: view_live("lift", None, tell, ended=ended)) as address,
    ):
        driver.get(address.url)
        wait_until(lambda: driver.execute_script("return (globalThis.llfsmView?.walk.run.rows.step.length ?? 0) > 300"))
        words = list(driver.execute_script("return [...document.querySelectorAll('h1, h2')].map((h) => h.textContent)"))
        driver.execute_script("globalThis.scrollTo(0, 0)")
        picture = driver.get_screenshot_as_png()
        run.stop()
    driver.get("about:blank")
    driver.picture = picture
    return words


PICTURES: dict[str, Callable[[Any], list[str]]] = {"report.png": report, "live.png": live}


def words_of(picture: bytes) -> list[str]:
    """What is written beside the pixels."""
    for kind, data in _chunks(picture):
        if kind == b"iTXt" and data.startswith(KEY):
            return data.split(b"\0", 5)[5].decode().split("\n")
    return []


def with_words(picture: bytes, words: list[str]) -> bytes:
    """A PNG with a text (PNG 1.2, iTXt), and its pixels as small as they get."""
    chunks = list(_chunks(picture))
    pixels = zlib.decompress(b"".join(data for kind, data in chunks if kind == b"IDAT"))
    told = KEY + b"\0\0\0\0\0" + "\n".join(words).encode()
    made = [chunks[0], (b"iTXt", told), (b"IDAT", zlib.compress(pixels, 9)), (b"IEND", b"")]
    return picture[:8] + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in made
    )


def _chunks(picture: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = 8
    while at < len(picture):
        (length,) = struct.unpack_from(">I", picture, at)
        yield picture[at + 4 : at + 8], picture[at + 8 : at + 8 + length]
        at += 12 + length


@contextmanager
def browser() -> Iterator[Any]:
    """One whose pages have the size of the pictures."""
    with tempfile.TemporaryDirectory() as folder, started_browser(Path(folder)) as driver:
        yield sized(driver)


def sized(driver: Any) -> Any:
    """Let what pages show be as large as a picture."""
    metrics = {"width": WIDTH, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    return driver


def main() -> None:
    with browser() as driver:
        for name, make in PICTURES.items():
            driver.picture = None
            words = make(driver)
            picture = driver.picture or driver.get_screenshot_as_png()
            (FOLDER / name).write_bytes(with_words(picture, words))
            print(FOLDER / name)  # noqa: T201


if __name__ == "__main__":
    main()
