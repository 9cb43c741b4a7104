"""The examples in Python on pages run, and print what the pages show."""

from __future__ import annotations

import doctest
import html
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

import llfsm_verify as lv
from llfsm_verify.lazily import places
from tests.outside import needs

BLOCK = re.compile(r"^```pycon\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PAGES = [
    path for path in (Path("README.md"), *sorted(Path("docs").glob("*.md"))) if "```pycon" in path.read_text("utf-8")
]
REFERENCE = re.compile(r"^::: ([\w.]+)\n    options:\n      members: \[(.*)\]$", re.MULTILINE)


def test_the_pages_are_there():
    assert {page.name for page in PAGES} >= {"README.md", "api.md"}


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_examples(page: Path) -> None:
    """All blocks of a page, in order, as one session."""
    text = page.read_text(encoding="utf-8")
    keep: list[str] = []
    place = 0
    for found in BLOCK.finditer(text):  # what is not an example becomes empty lines, so that lines keep their numbers
        keep += ["\n" * text.count("\n", place, found.start(1)), found[1]]
        place = found.end(1)
    session = doctest.DocTestParser().get_doctest("".join(keep), {}, page.name, str(page), 0)
    assert len(session.examples) >= 3
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    runner.run(session, out=said.append)
    assert runner.failures == 0, "".join(said)


def test_the_reference_lists_every_public_name():
    page = Path("docs/api.md").read_text(encoding="utf-8")
    listed = {(m.removeprefix("llfsm_verify."), n) for m, names in REFERENCE.findall(page) for n in names.split(", ")}
    assert listed == set(places(lv.__name__).values())


def call(owner: str, method: str) -> str:
    """How a method is called: what it takes, with the values that need not be given."""
    taken = inspect.signature(getattr(getattr(lv, owner), method)).parameters.values()
    shown = [str(p.replace(annotation=inspect.Parameter.empty)).replace("'", '"') for p in taken if p.name != "self"]
    first = next((i for i, p in enumerate(taken) if p.kind is p.KEYWORD_ONLY), None)
    starred = any(p.kind is p.VAR_POSITIONAL for p in taken)
    if first is not None and not starred:
        shown.insert(first - 1, "*")
    return f"{owner}.{method}({', '.join(shown)})"


def test_the_table_of_methods_has_what_they_take() -> None:
    page = Path("docs/api.md").read_text(encoding="utf-8")
    calls = re.findall(r"^\| `((\w+)\.(\w+)\(.*?\))` \|", page, re.MULTILINE)
    assert [said for said, *_ in calls] == [call(owner, method) for _, owner, method in calls]
    listed = {(owner, method) for _, owner, method in calls}
    for owner in ("Model", "LiveRun"):
        public = {n for n, m in vars(getattr(lv, owner)).items() if inspect.isfunction(m) and not n.startswith("_")}
        assert {method for o, method in listed if o == owner} == public


def test_examples_use_the_front_door_only():
    """And `testing`, where an example is about tests."""
    for path in Path("examples").glob("*.py"):
        for line in path.read_text(encoding="utf-8").splitlines():
            if re.match(r"\s*(from|import) llfsm_verify", line):
                assert line.strip() == "import llfsm_verify as lv" or line.startswith(
                    "from llfsm_verify.testing import "
                )


def test_the_site_has_every_page():
    topics = navigation()
    listed = [page for pages in topics.values() for page in pages]
    pages = {path.name for path in Path("docs").glob("*.md")} - {"index.md"}
    others = {
        "decisions/README.md",
        *(
            f"repository/{name}.md"
            for name in ("models/README", "CHANGELOG", "CONTRIBUTING", "examples/engine/README", "tests/README")
        ),
    }
    assert len(listed) == len(set(listed)) and set(listed) == pages | others


def test_the_overview_has_the_topics_of_the_site():
    text = Path("docs/index.md").read_text(encoding="utf-8")
    parts = re.split(r"^## (.*)$", text, flags=re.MULTILINE)
    shown = {
        topic: re.findall(r"\]\(([\w./-]+\.md)\)", part) for topic, part in zip(parts[1::2], parts[2::2], strict=True)
    }
    del shown["What it does not do"]
    assert shown == {
        topic: [page.replace("repository/", "../") for page in pages] for topic, pages in navigation().items()
    }


def navigation() -> dict[str, list[str]]:
    """The pages of each topic, without the overview, which is none."""
    text = Path("mkdocs.yml").read_text(encoding="utf-8")
    entries = yaml.safe_load(text.split("\nnav:\n")[1].split("\nnot_in_nav")[0])
    assert entries[0] == {"Overview": "index.md"}
    return {
        topic: [page for item in pages for page in item.values()]
        for entry in entries[1:]
        for topic, pages in entry.items()
    }


@needs("mkdocstrings", "mkdocs-material")
@pytest.mark.long
def test_the_site_builds(tmp_path):
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "site" / "api.html").read_text(encoding="utf-8")
    assert 'id="llfsm_verify.api.model.Model.check"' in page and "Steps up to which engines look" in page
    assert not dead_links(tmp_path / "site")
    first = (tmp_path / "site" / "index.html").read_text(encoding="utf-8")
    assert "pictures/traffic_lights.svg" in first and 'data-md-color-scheme="slate"' in first
    page = (tmp_path / "site" / "tutorial.html").read_text(encoding="utf-8")
    assert '<span class="nt">whiteboard</span>' in page and '<span class="nl">goes</span>' in page  # YAML, properties


def dead_links(site: Path) -> list[str]:
    """Links and pictures of the pages of a site that lead to no file of it, or to no place of a page."""
    marks = {
        path.resolve(): set(re.findall(r'\bid="([^"]+)"', path.read_text(encoding="utf-8")))
        for path in site.rglob("*.html")
    }
    dead = []
    for path in site.rglob("*.html"):
        if path.name == "404.html":  # it is shown in place of any page, so its links begin at the root of a host
            continue
        for link in re.findall(r'\b(?:href|src)="([^"]*)"', path.read_text(encoding="utf-8")):
            place, _, mark = html.unescape(link).partition("#")
            target = (path.parent / place).resolve() if place else path.resolve()
            if re.match(r"[a-z]+:", place) or (target.is_file() and (not mark or target.suffix != ".html")):
                continue
            if mark not in marks.get(target, set()):
                dead.append(f"{path.relative_to(site)}: {link}")
    return dead
