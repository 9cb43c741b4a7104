"""The page's modules by themselves: their unit tests by node's runner, eslint, and that they fit into one file."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from llfsm_verify.extensions.view import page
from tests import outside

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
