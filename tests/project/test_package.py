from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tomllib
import venv
import zipfile
from email import message_from_string
from email.message import Message
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from tests.outside import demand

HEAVY = ("llvmlite", "rich", "lark", "yaml", "numpy", "numba", "networkx", "pygraphviz", "z3", "cvc5", "hypothesis")
LATER = ("numpy", "numba", "networkx", "z3", "cvc5", "pygraphviz", "hypothesis", "pytest")
NEEDLESS = (
    "analysis.explanation.explain", "analysis.vacuity.automata", "automata.boolean", "automata.properties",
    "automata.ltl.answers", "checking.goals.automata", "engines.bounded",
    "engines.explicit.checkpoints", "engines.inductive", "kripke.chains", "logic.expressions",
    "extensions.syntaxes.reading", "report.saving", "report.json", "semantics.probes", "verification.differential",
)  # fmt: skip
"""Modules of ours that serve what a check of plain formulas which hold, without options, does not have."""


@pytest.mark.parametrize(
    ("main", "arguments"),
    [
        *(("main", f"{command} --help".split()) for command in ("", "verify", "query", "monitor", "draw", "simulate")),
        ("main", ["--version"]),
        ("main_verify", ["--help"]),
    ],
    ids=lambda value: value if isinstance(value, str) else " ".join(value),
)
def test_help_imports_nothing_heavy(main, arguments):
    code = f"""
import sys
from llfsm_verify.cli import {main} as main
try:
    main({arguments!r})
except SystemExit as leaving:
    assert leaving.code == 0
print([name for name in {HEAVY!r} if name in sys.modules], file=sys.stderr)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and done.stdout.startswith(("usage: llfsm", "llfsm")) and done.stderr == "[]\n"


@pytest.mark.slow
def test_a_small_verification_imports_only_what_it_needs():
    code = f"""
import sys
from llfsm_verify.cli import main
code = main(["verify", "models/traffic_lights/arrangement.yaml", "properties/traffic_lights.ltl", "-q"])
assert code == 0
print([name for name in {LATER!r} if name in sys.modules])
print([name for name in {NEEDLESS!r} if "llfsm_verify." + name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.splitlines()[-2:] == ["[]", "[]"]


def test_what_a_small_verification_does_without_is_there():
    assert [name for name in NEEDLESS if find_spec("llfsm_verify." + name) is None] == []


def test_every_module_says_what_idea_it_holds():
    files = [path for path in Path("llfsm_verify").rglob("*.py") if path.read_text()]
    assert len(files) > 40
    for path in files:
        assert path.read_text().startswith('"""'), path


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """Built from the sdist, and that from a copy: what earlier builds left in the work tree must not get in."""
    folder = tmp_path_factory.mktemp("built")
    for name in ("pyproject.toml", "README.md", "LICENSE", *package()):
        (folder / "tree" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(name, folder / "tree" / name)
    run(sys.executable, "-c", "from setuptools.build_meta import build_sdist as b; b('..')", cwd=folder / "tree")
    (sdist,) = folder.glob("llfsm_verify-*.tar.gz")
    pip("wheel", "--no-build-isolation", "--wheel-dir", str(folder), str(sdist))
    (built,) = folder.glob("llfsm_verify-*.whl")
    return built


def package() -> list[str]:
    """The files of the package that git knows."""
    return run("git", "ls-files", "llfsm_verify").split()


def pip(command: str, *arguments: str, python: Path = Path(sys.executable)) -> None:
    """Run pip, which downloads nothing, for an environment."""
    run(sys.executable, "-m", "pip", "--python", str(python), command, "--quiet", "--no-deps", "--no-index", *arguments)


def run(*command: str, cwd: Path | None = None, env: dict[str, str] | None = None) -> str:
    """What a command prints; it does not see the work tree, should PYTHONPATH lead to it."""
    env = {name: value for name, value in (env or os.environ).items() if name != "PYTHONPATH"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd, env=env)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_the_wheel_has_everything(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert sorted(n for n in names if n.startswith("llfsm_verify/")) == sorted(package())
    assert any(n.endswith(".lark") for n in names) and any(n.endswith("result.schema.json") for n in names)
    assert "llfsm_verify/py.typed" in names
    text = told(wheel, "entry_points.txt")
    assert "[pytest11]\nllfsm = llfsm_verify.extensions.pytest_plugin.plugin" in text
    assert "llfsm = llfsm_verify.cli:main" in text and "llfsm-verify = llfsm_verify.cli:main_verify" in text


@pytest.mark.slow
def test_the_wheel_says_whose_it_is_and_what_it_is_for(wheel):
    about = message_from_string(told(wheel, "METADATA"))
    assert about["License-Expression"] == "MIT" and about.get_all("License-File") == ["LICENSE"]
    licence = told(wheel, "licenses/LICENSE")
    assert licence == Path("LICENSE").read_text() and "2026 the llfsm-verify authors" in licence
    assert about["Author"] == "the llfsm-verify authors"
    assert about["Summary"] and about["Keywords"] and about["Description-Content-Type"] == "text/markdown"
    assert "Typing :: Typed" in about.get_all("Classifier")


def told(wheel: Path, name: str) -> str:
    """A file of the wheel that is about the package."""
    (whole,) = (n for n in zipfile.ZipFile(wheel).namelist() if n.endswith(f".dist-info/{name}"))
    return zipfile.ZipFile(wheel).read(whole).decode()


@pytest.mark.slow
def test_the_wheel_works_where_there_is_only_what_it_asks_for(wheel, tmp_path):
    """A new environment with the wheel, and with those packages of this one that it depends on."""
    venv.create(tmp_path / "empty", with_pip=False)
    programs = tmp_path / "empty" / "bin"
    pip("install", str(wheel), python=programs / "python")
    (site,) = (tmp_path / "empty" / "lib").glob("python*/site-packages")
    needed = dependencies(message_from_string(told(wheel, "METADATA")))
    for part in {part for name in needed for part in parts(name)}:
        (site / part.name).symlink_to(part)
    env = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}

    def call(program: str, *arguments: str) -> str:
        return run(str(programs / program), *arguments, cwd=tmp_path, env=env)

    assert call("python", "-c", "import llfsm_verify; print(llfsm_verify.__file__)").startswith(str(site))
    missing = "import importlib.util as u; print(u.find_spec('hypothesis'), u.find_spec('pytest'))"
    assert call("python", "-c", missing) == "None None\n"
    call("llfsm", "init", "crossing")
    files = ("crossing/arrangement.yaml", "crossing/properties.ltl")
    assert "holds  nobody_is_run_over" in call("llfsm-verify", *files, "--certificate", "certificate.json")
    call("llfsm-check-certificate", "certificate.json")
    never = "never: G !(walkers@WALK && cars@GREEN)"
    assert "holds  never" in call("llfsm-verify", files[0], "-p", never, "--engine", "induction")
    assert '"configurations"' in call("llfsm", "kripke", files[0])
    assert json.loads(call("llfsm", "schema", "arrangement"))["$schema"]


def dependencies(about: Message) -> set[str]:
    """The packages that a package depends on, and those that these depend on, without extras."""
    names: set[str] = set()
    for text in about.get_all("Requires-Dist") or ():
        wanted = Requirement(text)
        if wanted.marker is None or wanted.marker.evaluate({"extra": ""}):
            found = metadata.distribution(wanted.name)
            assert wanted.specifier.contains(found.version, prereleases=True), text
            names |= {wanted.name, *dependencies(found.metadata)}
    return names


def parts(name: str) -> set[Path]:
    """The files and folders of an installed package in the folder for packages."""
    found = metadata.distribution(name)
    tops = {file.parts[0] for file in found.files or ()} - {"..", "__pycache__"}
    assert tops, name
    return {Path(str(found.locate_file(top))) for top in tops}


@pytest.mark.slow
def test_layers_hold():
    demand("import-linter")
    code = "from importlinter.cli import lint_imports; raise SystemExit(lint_imports())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_each_ignored_rule_has_its_reason():
    lines = Path("pyproject.toml").read_text().split("ignore = [", 1)[1].split("]", 1)[0].strip().splitlines()
    assert len(lines) == len(tomllib.loads(Path("pyproject.toml").read_text())["tool"]["ruff"]["lint"]["ignore"])
    assert all(" # " in line for line in lines)


def test_nothing_of_a_machine_stands_in_the_files():
    done = subprocess.run(["git", "ls-files", "-z"], capture_output=True, text=True, check=True)
    texts = [Path(name) for name in done.stdout.split("\0") if name and Path(name).is_file()]
    assert len(texts) > 50
    home = "/" + "root/"
    for path in texts:
        assert home.encode() not in path.read_bytes(), path
