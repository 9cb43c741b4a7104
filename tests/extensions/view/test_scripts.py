"""The page's modules by themselves: their unit tests by node's runner, eslint, and that they fit into one file."""

from __future__ import annotations

import json
import random
import re
import subprocess
from pathlib import Path

import pytest

from llfsm_verify.extensions.view import page
from llfsm_verify.extensions.view.shapes import shapes
from tests import outside
from tests.extensions.view.samples import sample

HERE = Path(__file__).with_name("js")
PAGE = Path(page.__file__).with_name("page")


@pytest.mark.slow
@outside.needs("node")
def test_units_of_the_page_by_node() -> None:
    node = outside.program("node")
    version = subprocess.run([node, "--version"], capture_output=True, text=True, check=True).stdout
    if int(version[1:].split(".")[0]) < 18:
        pytest.skip(f"node {version.strip()} has no runner of tests")
    tests = [str(path) for path in sorted(HERE.glob("*.test.mjs"))]
    done = subprocess.run([node, "--test", *tests], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert re.search(r"^# pass [1-9]\d+$", done.stdout, re.MULTILINE), done.stdout


@pytest.mark.slow
@outside.needs("node", "eslint")
def test_eslint_finds_nothing() -> None:
    files = [*PAGE.glob("*.js"), *HERE.glob("*.mjs")]
    command = [outside.program("node"), outside.program("eslint"), "-c", HERE / "eslint.config.mjs", *sorted(files)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=Path(__file__).parents[3])
    assert (done.returncode, done.stdout) == (0, ""), done.stdout + done.stderr


@pytest.mark.slow
@outside.needs("node")
def test_python_and_node_draw_the_same_of_random_timelines() -> None:
    chance = random.Random(11)
    cases = []
    for number in range(60):
        document = sample(chance.choice([1, 5, 60, 900]), seed=number)
        if number % 3 == 0:
            document["runs"][0]["rows"]["time_ms"] = None
        if number % 4 == 1:
            document["arrangement"]["cycle_ms"] = chance.choice([0.37, 250, 1000, 40])
            period, zero = document["arrangement"]["cycle_ms"], chance.randrange(2)
            times = [period * max(0, i - zero) for i in document["runs"][0]["rows"]["cycle"]]
            document["runs"][0]["rows"]["time_ms"] = times
        if number % 5 == 0:
            document["runs"][0]["rows"]["cycle"] = [3 * i for i in document["runs"][0]["rows"]["cycle"]]
        first = chance.randrange(len(document["runs"][0]["rows"]["step"]) - 1)
        last = chance.randrange(first + 1, len(document["runs"][0]["rows"]["step"]))
        cases.append((document, first, last, chance.choice([97, 333, 900, 1234])))
    node, given = outside.program("node"), json.dumps(cases)
    done = subprocess.run([node, HERE / "shapes.mjs"], input=given, capture_output=True, text=True, check=True)
    for (document, first, last, width), drawn in zip(cases, json.loads(done.stdout), strict=True):
        assert drawn == shapes(document, document["runs"][0], first, last, width)


def test_modules_are_all_in_the_page_and_import_only_those_before_them() -> None:
    assert {path.stem for path in PAGE.glob("*.js")} == set(page.MODULES)
    for number, name in enumerate(page.MODULES):
        imported = re.findall(r'^import .*"\./(\w+)\.js";$', (PAGE / f"{name}.js").read_text(), re.MULTILINE)
        assert set(imported) <= set(page.MODULES[:number])


def test_names_of_modules_are_unique() -> None:
    declared = re.compile(r"^(?:export )?(?:async )?(?:function|const|let|class) (\w+)", re.MULTILINE)
    names = [name for path in PAGE.glob("*.js") for name in declared.findall(path.read_text())]
    assert sorted(names) == sorted(set(names))


def test_nothing_of_a_document_ends_its_element() -> None:
    text = page.page_html({"title": "</script>", "x": "<!-- </script> <script>"}, {"events": "</script>"})
    assert len(re.findall("</script", text)) == 3
    assert "<!--" not in text
    assert not re.search(r"^(import|export) ", text, re.MULTILINE)
    assert "https://" not in text.replace("http://www.w3.org", "")
    assert text.startswith("<!DOCTYPE html>")
