"""A chain of theories, each of which asks for the one before it twice, stays linear wherever its last one is shown."""

from __future__ import annotations

from pathlib import Path

import pytest

from llfsm_verify.cli import main

LENGTH = 40
ONE_OF_TWO = """\
input {a, b}.
P: a, ~b => q.
Q: ~a, b => q.
R: {} => ~q. P > R. Q > R.
output {b q, "q"}.
"""
ARRANGEMENT = """\
name: chain
cycle_ms: 100
whiteboard:
  x: {type: bool, role: input}
  z: {type: bool}
  out: {type: bool, role: output, safe: false}
knowledge:
  e0: {file: x.d, inputs: {a: FIRST, b: z}}
ENTRIES
machines:
  m:
    inline:
      machine: M
      states:
        - name: S
          internal: z = x; out = LAST;
          stays: true
schedule: [m]
"""


@pytest.fixture(params=["x", "out"])
def chain(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Of inputs, and of variables only."""
    entries = [f'  e{i}: {{file: x.d, inputs: {{a: e{i - 1}, b: "e{i - 1} == z"}}}}' for i in range(1, LENGTH)]
    text = ARRANGEMENT.replace("FIRST", request.param).replace("ENTRIES", "\n".join(entries))
    (tmp_path / "x.d").write_text(ONE_OF_TWO)
    (tmp_path / "a.yaml").write_text(text.replace("LAST", f"e{LENGTH - 1}"))
    return str(tmp_path / "a.yaml")


SHOWN = ("-p", f"G (e{LENGTH - 1} -> z)")


@pytest.mark.slow
@pytest.mark.parametrize("form", ["promela", "smv", "json"])
def test_other_checkers_are_given_each_definition_once(form: str, chain: str, tmp_path: Path) -> None:
    model = tmp_path / "model"
    assert main(["kripke", chain, *SHOWN, "--format", form, "-o", str(model)]) == 0
    assert model.stat().st_size < 200_000


@pytest.mark.slow
def test_monitors_in_c_have_each_definition_once(chain: str, tmp_path: Path) -> None:
    assert main(["build", chain, "--target", "c", "--for", "none", *SHOWN, "-o", str(tmp_path / "c")]) == 0
    assert sum(file.stat().st_size for file in (tmp_path / "c").iterdir()) < 400_000


@pytest.mark.slow
def test_checkers_of_certificates_compute_each_definition_once(chain: str, tmp_path: Path) -> None:
    proof = str(tmp_path / "proof.json")
    main(["verify", chain, *SHOWN, "-q", "--certificate", proof])
    assert main(["verify", chain, *SHOWN, "-q", "--check-certificate", proof]) == 0
