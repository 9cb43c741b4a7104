"""Extensions enter by the registries: what they bring is there, and the core does without them."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import jsonschema
import pytest
import yaml

from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.extensions.mqtt.kind import Mqtt
from llfsm_verify.registry import extensions
from llfsm_verify.runtime.ports.file import PORT, schema
from llfsm_verify.yaml.tables import rows
from tests.runtime.ports.bench import declared

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "llfsm_verify" / "extensions"
GOOD = [
    "{kind: serial, device: /dev/ttyS0, baud: 9600, format: json-lines, outputs: [drive], safe: {drive: -0.5}}",
    "{kind: mqtt, host: h, port: 1884, client_id: c, username: u, password_env: P, outputs: {kept: a/b}}",
    "{kind: mqtt, host: h, qos: 2, retain: false, keepalive: 3, outputs: {kept: a/b}}",
]
WRONG = [
    ("ports: {a: {kind: mqtt, host: h, outputs: {m: §a/#}}}", "E493", "another name"),
    ("ports: {a: {kind: mqtt, host: h, outputs: {m: a}, qos: §3}}", "E493", "from 0 to 2"),
    ("ports: {a: {kind: mqtt, host: h, outputs: {m: a}, password_env: §P}}", "E493", "username"),
    ("ports: {a: {kind: serial, device: d, outputs: [m], baud: §fast}}", "E493", "from 50"),
    ("ports: {a: {kind: serial, device: d, outputs: [m], format: §xml}}", "E035", "json-lines"),
    ("ports: {a: §{kind: mqtt, outputs: [m]}}", "E034", "host"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "code", "hint"), WRONG)
def test_what_is_wrong_with_a_port_is_said_at_its_place(text: str, code: str, hint: str, tmp_path: Path) -> None:
    with pytest.raises(DiagnosticError) as caught:
        declared(text.replace("§", ""), tmp_path)
    place = Source("x", text.replace("§", "")).position(text.index("§"))
    (found,) = caught.value.diagnostics
    assert (found.code, found.span and (found.span.line, found.span.column)) == (code, place)
    assert hint in (found.hint or "")


@pytest.mark.parametrize("port", GOOD)
def test_the_schema_takes_what_the_reader_takes(port: str, tmp_path: Path) -> None:
    text = f"ports: {{a: {port}}}\n"
    (spec,) = declared(text, tmp_path)
    assert spec.outputs
    jsonschema.Draft202012Validator(schema("ports")).validate(yaml.safe_load(text))


def test_the_page_says_of_keys_what_their_table_says() -> None:
    page = (ROOT / "docs/ports.md").read_text("utf-8").splitlines()
    kind = [field for field in PORT.fields if field.name == "kind"]
    assert [row for row in rows((*kind, *Mqtt.table.fields)) if row not in page] == []


def test_every_entry_of_an_extension_is_there() -> None:
    folders = {path.parent.name for path in FOLDER.glob("*/__init__.py")}
    entries = [entry for group in extensions().values() for entry in group]
    assert {entry.place.split(".")[2] for entry in entries} == folders - {"pytest_plugin"}  # pytest finds it
    for entry in entries:
        assert entry.about and entry.load() is not None


def test_what_an_extension_needs_is_an_extra() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    needed = [entry for group in extensions().values() for entry in group if entry.package is not None]
    assert {entry.place.split(".")[2] for entry in needed} == {
        "bags", "cluster", "editor", "mqtt", "parquet", "ros", "rosmonitoring", "serial", "terminal", "timelines",
        "view",
    }  # fmt: skip
    for entry in needed:
        assert entry.package is not None
        assert any(word.startswith(f"{entry.package.name}>=") for word in extras[entry.package.extra])


def test_every_room_is_closed_to_extensions() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (contract,) = (c for c in contracts if c.get("source_modules") == ["llfsm_verify.extensions"])
    rooms = {path.stem for path in FOLDER.parent.iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()}
    closed = rooms - {"__init__", "extensions", "plug", "testing"}
    assert contract["forbidden_modules"] == sorted(f"llfsm_verify.{room}" for room in closed)


WITHOUT = """
import gc
import pkgutil
from importlib import import_module
from pathlib import Path
import llfsm_verify
from llfsm_verify.registry import Registry, Unregistered

assert Path(llfsm_verify.__file__).parent == Path.cwd() / "llfsm_verify"
for module in pkgutil.walk_packages(llfsm_verify.__path__, "llfsm_verify."):
    if not module.name.endswith("__main__") and "pytest_plugin" not in module.name:
        import_module(module.name)

for registry in [one for one in gc.get_objects() if isinstance(one, Registry)]:
    for name in registry:
        assert registry.load(name) is not None
from llfsm_verify.plug import FRONT_ENDS, LOGS, MODELS, PORTS, TARGETS, TIMELINES, WORLDS
print(" | ".join(", ".join(each) for each in (PORTS, LOGS, TIMELINES, FRONT_ENDS, MODELS, WORLDS, TARGETS)))
try:
    PORTS.load("mqtt")
except Unregistered as error:
    print(error)
"""


@pytest.mark.long
def test_the_core_does_without_extensions(tmp_path: Path) -> None:
    """In a copy without their folder every module is imported, every registry read, and some tests pass."""
    shutil.copytree(ROOT / "llfsm_verify", tmp_path / "llfsm_verify", ignore=lambda *_: {"extensions"})
    for name in ("benchmarks", "docs", "examples", "tests", "tools", "models", "properties", "pyproject.toml"):
        (tmp_path / name).symlink_to(ROOT / name)
    # An editable installation finds the modules of this tree that are not in the copy.
    (tmp_path / "sitecustomize.py").write_text(
        "import sys\nsys.meta_path[:] = [f for f in sys.meta_path if 'editable' not in repr(f).lower()]\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}

    def python(*words: str) -> str:
        command = [sys.executable, *words]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    assert python("-c", WITHOUT).splitlines() == [
        "callback, process, stream, whiteboard |  | csv |  |  |  | ",
        "there is no kind of port `mqtt`; there are: callback, process, stream, whiteboard",
    ]
    folders = (
        "tests/runtime/ports", "tests/runtime/deciding", "tests/runtime/recording", "tests/test_registry.py",
        "tests/report/test_codes_explained.py", "tests/project/test_diagnostics_page.py",
    )  # fmt: skip
    python("-m", "pytest", "-q", "-p", "no:llfsm", "-p", "no:cacheprovider", "-m", "not slow and not long", *folders)
