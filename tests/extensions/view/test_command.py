"""`llfsm view` and the pages of reports, as commands: what they write, serve and refuse."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from llfsm_verify.extensions.view.document import document_of_file
from tests.cli.running import COUNTER, FAULTY, LIGHTS, llfsm, llfsm_process
from tests.extensions.view.clients import Address, wait_until

BOTH = ("-p", "never: G !ns@GREEN", "-p", "both: G !(ns@GREEN && ew@GREEN)")


def document_in(html: str) -> Any:
    """The document of a page, which is one of the published schema."""
    found = re.search(r"<script(?=[^>]*application/json)(?=[^>]*view-document)[^>]*>(.*?)</script>", html, re.DOTALL)
    assert found is not None
    document = json.loads(found[1])
    jsonschema.validate(document, json.loads(llfsm("schema", "view").stdout))
    return document


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A saved trace `both.trace.yaml`, and a recording `run.rec` of `counter.yaml`."""
    made = tmp_path_factory.mktemp("shown")
    assert llfsm("verify", FAULTY, *BOTH, "-q", "--save-traces", str(made)).returncode == 1
    (made / "counter.yaml").write_text(COUNTER)
    words = ("--rate", "0", "--for", "1s", "--set", "go=true", "--record", str(made / "run.rec"))
    llfsm("run", str(made / "counter.yaml"), *words)
    return made


def test_a_report_has_the_verdicts_of_the_check(tmp_path: Path) -> None:
    page, data = tmp_path / "out.html", tmp_path / "out.json"
    done = llfsm("verify", FAULTY, *BOTH, "--report", str(page), "--report", str(data))
    assert done.returncode == 1
    assert f"{page} written\n{data} written\n" in done.stderr
    found = {item["name"]: item["verdict"] for item in json.loads(data.read_text())["properties"]}
    shown = document_in(page.read_text())
    assert {each["name"]: each["verdict"] for each in shown["verdicts"] if each["name"] != "faults"} == found
    assert [run["property"] for run in shown["runs"]] == [name for name, is_ in found.items() if is_ == "violated"]


def test_wrong_files_get_no_page(tmp_path: Path) -> None:
    page = tmp_path / "out.html"
    done = llfsm("verify", LIGHTS, "-p", "G !ns@GREN", "--report", str(page))
    assert (done.returncode, page.exists()) == (3, False)


def test_a_page_of_coverage() -> None:
    done = llfsm("coverage", LIGHTS, "--format", "html")
    assert document_in(done.stdout)["coverage"]["counts"]["state"]["reachable"] == 9


@pytest.mark.parametrize("name", ["both.trace.yaml", "run.rec"])
@pytest.mark.parametrize("steps", [(), (2, 4)])
def test_a_file_is_written_as_a_page(folder: Path, tmp_path: Path, name: str, steps: tuple[int, ...]) -> None:
    page = tmp_path / "out.html"
    words = ["--steps", f"{steps[0]}:{steps[1]}"] if steps else []
    done = llfsm("view", str(folder / name), "-o", str(page), *words)
    assert done.returncode == 0, done.stderr
    assert done.stderr.endswith(f"{page} written\n")
    shown = document_in(page.read_text())
    assert shown == json.loads(json.dumps(document_of_file(str(folder / name), None, *steps)))
    assert name != "run.rec" or [file["name"] for file in shown["files"]] == ["counter.yaml"]
    if steps:
        assert shown["runs"][0]["rows"]["step"] == [2, 3, 4]
    assert llfsm("view", str(folder / name), "-o", "-", *words).stdout == page.read_text()


@contextmanager
def viewing(*words: str, **environment: str) -> Iterator[tuple[Any, str]]:
    """`llfsm view`, and the line that tells the address."""
    command = [sys.executable, "-m", "llfsm_verify", "view", *words]
    server = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ, **environment})
    assert server.stderr is not None
    said = list[str]()
    try:
        for line in server.stderr:
            said.append(line)
            if line.startswith("http"):
                break
        assert said and said[-1].startswith("http"), said
        yield server, said[-1]
    finally:
        server.kill()
        server.wait()
        server.stderr.close()


@pytest.mark.slow
def test_a_recording_is_served_in_windows_and_a_browser_opened(folder: Path, tmp_path: Path) -> None:
    browser, opened = tmp_path / "browser", tmp_path / "opened"
    browser.write_text(f'#!/bin/sh\necho "$1" > {opened}.new\nmv {opened}.new {opened}\n')
    browser.chmod(0o755)
    file = folder / "run.rec"
    with viewing(str(file), "--steps", "3:5", "--open", BROWSER=str(browser)) as (server, line):
        assert line.endswith(f" shows {file}; Ctrl-C ends it\n")
        address = Address.of(line)
        assert document_in(address.ask("/").text)["runs"][0]["rows"]["step"] == [3, 4, 5]
        answer = address.ask("/window?first=0&last=1")
        assert answer.status == 200, answer
        window = json.loads(answer.text)
        assert window["runs"][0]["rows"]["step"] == [0, 1]
        wait_until(opened.exists)
        assert opened.read_text().strip() == address.url
        server.send_signal(signal.SIGINT)
        assert server.wait(20) == 0


@pytest.mark.slow
def test_a_run_is_shown_by_its_whiteboard_and_not_written(folder: Path, tmp_path: Path) -> None:
    words = [sys.executable, "-m", "llfsm_verify", "run", str(folder / "counter.yaml"), "--whiteboard", "shown-run"]
    run = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        wait_until(lambda: "shown-run" in llfsm("whiteboard", "list").stdout)
        with viewing("shown-run") as (_, line):
            assert "shows the run `shown-run`" in line
            assert document_in(Address.of(line).ask("/").text)["runs"][0]["kind"] == "live"
        done = llfsm("view", "shown-run", "-o", str(tmp_path / "out.html"))
        assert (done.returncode, list(tmp_path.iterdir())) == (3, [])
        assert "E553" in done.stderr
        assert "--steps is for traces" in llfsm("view", "shown-run", "--steps", "1:2").stderr
    finally:
        run.kill()
        run.wait()


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("both.trace.yml",), 3, "error[E551]: there is no whiteboard and no file `both.trace.yml`"),
        (("both.trace.yml", "-o", "x.html"), 3, "hint: did you mean `both.trace.yaml`"),
        (("run.rec", "-o", "run.rec"), 3, "error[E490]: run.rec is an input, and the page would replace it"),
        (("run.rec", "-o", "no/x.html"), 3, "error[E490]: the page cannot be written there"),
        (("run.rec", "-o", "x.html", "--steps", "9000:"), 3, "error[E555]: there is no step 9,000"),
        (("counter.yaml", "-o", "x.html"), 3, "error["),
        (("run.rec", "-o", "x.html", "--port", "80"), 2, "leave --port and --open out"),
        (("run.rec", "--steps", "5:2"), 2, "'5:2' ends before it begins"),
        (("run.rec", "--port", "70000"), 3, "error[E554]: it cannot listen on 127.0.0.1:70000"),
        ((".",), 3, "error[E551]"),
    ],
)
def test_mistakes(folder: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], code: int, said: str) -> None:
    monkeypatch.chdir(folder)
    done = llfsm("view", *words)
    assert (done.returncode, done.stdout) == (code, "")
    assert said in done.stderr
    assert not Path("x.html").exists()


@pytest.mark.parametrize("words", [("view", "{}/run.rec"), ("verify", LIGHTS, "--report", "x.html")])
def test_the_package_is_asked_for_before_the_work(folder: Path, tmp_path: Path, words: tuple[str, ...]) -> None:
    (tmp_path / "jinja2.py").write_text("raise ModuleNotFoundError(\"No module named 'jinja2'\", name='jinja2')\n")
    path = os.pathsep.join([str(tmp_path), str(Path.cwd())])
    done = llfsm_process(*(word.format(folder) for word in words), PYTHONPATH=path)
    assert (done.returncode, done.stdout) == (3, "")
    assert done.stderr.splitlines() == [
        "error[E464]: this needs the package jinja2, which is not installed",
        "  hint: install it with `pip install jinja2`, or in our folder with `pip install -e '.[view]'`",
    ]


def test_a_package_that_the_language_server_needs_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygls", None)
    done = llfsm("lsp")
    assert (done.returncode, done.stdout) == (3, "")
    assert done.stderr.startswith("error[E464]: this needs the package pygls, which is not installed\n")
