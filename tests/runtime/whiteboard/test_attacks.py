"""What unprivileged machines, programs and people try, what comes of it, and what the audit log says."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path

import pytest

from llfsm_verify.arrangement.granting import policy_digest
from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.report.access import access_text
from llfsm_verify.runtime.recording.file import HEAD, Recording
from llfsm_verify.runtime.whiteboard.audit import verify
from llfsm_verify.runtime.whiteboard.client import PostRefused, Whiteboard, WhiteboardError
from llfsm_verify.runtime.whiteboard.permissions import user_name
from llfsm_verify.runtime.whiteboard.places import socket_path
from tests.cli.running import llfsm
from tests.runtime.recording.forging import begin_of, entries_of, sealed

ARRANGEMENT = """\
name: guarded
cycle_ms: 2
whiteboard:
  pedal: {type: 0..9, role: input}
  wish: {type: 0..9}
  alarm: {type: bool}
  speed: {type: 0..9, role: output, safe: 0}
machines:
  driver: {file: driver.yaml, on_fault: unload}
  trojan: {file: quiet.yaml, on_fault: unload}
  monitor: {inline: {machine: Monitor, states: [{name: M, internal: "if (wish > 5) alarm = true;", stays: true}]}}
  switch: {inline: {machine: Switch, states: [{name: S, internal: "speed = alarm ? 0 : wish;", stays: true}]}}
schedule: [driver, trojan, monitor, switch]
operators: {replace: [driver, trojan], suspend: [driver], restart: [monitor], write: [wish]}
access: {file: policy.yaml}
"""
POLICY = """\
levels: [public, safety]
machines: {monitor: safety, switch: safety}
write: {speed: safety, alarm: safety}
users: {safety_officer: safety}
"""
MACHINES = {
    "driver": ("", "wish = min(pedal, 5);"),
    "quiet": ("", ""),
    "writes": ("", "speed = 9;"),
    "resets": ("", "alarm = false;"),
    "suspends": ("", "suspend(monitor);"),
    "hides": ("parameters: {out: {whiteboard: 0..9}}\n", "out = 9;"),
    "divides": ("variables: {n: {type: 0..9}}\n", "wish = 9 / n;"),
    "fast": ("", "wish = pedal;"),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(tmp_path / "boards"))
    (tmp_path / "a.yaml").write_text(ARRANGEMENT)
    (tmp_path / "policy.yaml").write_text(POLICY)
    for name, (head, action) in MACHINES.items():
        internal = f", internal: {json.dumps(action)}" if action else ""
        text = f"machine: {name.title()}\n{head}states:\n  - {{name: S{internal}, stays: true}}\n"
        (tmp_path / f"{name}.yaml").write_text(text)
    return tmp_path


@contextmanager
def running(folder: Path, *options: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "llfsm_verify", "run", str(folder / "a.yaml"), "--whiteboard", "attacked"]
    process = subprocess.Popen([*command, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def called(process: subprocess.Popen[str]) -> Whiteboard:
    while True:
        assert process.poll() is None, process.communicate()
        try:
            board = Whiteboard("attacked")
            board.view()
        except WhiteboardError:
            time.sleep(0.01)
        else:
            return board


@pytest.mark.slow
def test_what_a_run_refuses_is_in_its_log(folder: Path) -> None:
    """A Trojan loaded later, suspending the monitor, resetting its alarm, a division by zero, a replayed command."""
    log, record = folder / "log", folder / "r"
    with running(folder, "--audit", str(log), "--record", str(record), "-p", "slow: G speed < 6") as process:
        with called(process) as board:
            for name, why in {
                "writes": "may not write `speed`", "resets": "may not write `alarm`",
                "suspends": "may not suspend `monitor`", "hides": "parameter `out`",
            }.items():  # fmt: skip
                with pytest.raises(PostRefused) as refused:
                    board.replace("trojan", folder / f"{name}.yaml")
                assert why in str(refused.value), name
            with pytest.raises(PostRefused, match=r"may not restart `monitor`: that needs `safety`"):
                board.command("restart", "monitor")
            for name, why in (("empty.yaml", r"^empty\.yaml: the file is empty"), ("\x1b[31m.yaml", "can be printed")):
                (folder / name).write_text("")
                with pytest.raises(PostRefused, match=why):
                    board.replace("trojan", folder / name)
            frame, _ = board.replace("trojan", folder / "divides.yaml")
        with called(process) as board:
            while board.view().number < frame + 3:
                time.sleep(0.002)
            board.post(pedal=9)
            while board.get("wish") != 5:
                time.sleep(0.002)
            assert board.get("speed") <= 5 and board.get("alarm") is False
        asked = b'{"command": ["restart", "monitor"]}\n'
        for _ in range(2):  # the bytes of somebody else are asked by who sends them
            with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
                client.connect(str(socket_path("attacked")))
                client.sendall(asked)
                answers = b""
                while b"may not restart" not in answers:
                    answers += client.recv(1 << 16)
        process.send_signal(signal.SIGTERM)
        process.communicate()
    entries = [json.loads(line) for line in log.read_bytes().splitlines()]
    refused = [entry.get("why", "") for entry in entries if entry.get("what") == "refused"]
    assert sum("may not" in why for why in refused) >= 6, refused
    assert all(entry["uid"] == os.getuid() for entry in entries if entry.get("what") == "refused")
    assert any(entry.get("what") == "replaced" for entry in entries)
    assert entries[0]["policy"] == policy_digest(load_arrangement(str(folder / "a.yaml")))
    assert verify(log).entries == len(entries)
    lines = log.read_bytes().splitlines(keepends=True)
    log.write_bytes(b"".join(lines[:2] + lines[3:]))
    with pytest.raises(DiagnosticError):
        verify(log)


def test_a_machine_does_not_hide_a_write_in_a_parameter(folder: Path) -> None:
    text = ARRANGEMENT.replace("{file: quiet.yaml,", "{file: hides.yaml, parameters: {out: speed},")
    (folder / "a.yaml").write_text(text)
    with pytest.raises(DiagnosticError) as refused:
        load_arrangement(str(folder / "a.yaml"))
    (found,) = refused.value.diagnostics
    assert found.code == "E157" and "may not write `speed`" in found.message
    assert found.span is not None and found.span.source.name.endswith("hides.yaml")


def test_a_policy_is_the_same_in_a_file_of_its_own(folder: Path) -> None:
    own = load_arrangement(str(folder / "a.yaml"))
    inline = "".join(f"  {line}\n" for line in POLICY.splitlines())
    (folder / "b.yaml").write_text(ARRANGEMENT.replace("access: {file: policy.yaml}\n", f"access:\n{inline}"))
    assert policy_digest(load_arrangement(str(folder / "b.yaml"))) == policy_digest(own)
    (folder / "policy.yaml").write_text(POLICY.replace("alarm: safety", "alarm: public"))
    assert policy_digest(load_arrangement(str(folder / "a.yaml"))) != policy_digest(own)


def test_wrong_policies_are_diagnosed_where_they_stand(folder: Path) -> None:
    for old, new, code, line in (
        ("alarm: safety", "alarm: safty", "E099", 3),
        ("levels:", "level:", "E033", 1),
        ("users:", "user:", "E033", 4),
        ("monitor: safety", "monitr: safety", "E099", 2),
        ("levels:", "format: 9\nlevels:", "E097", 1),
    ):
        (folder / "policy.yaml").write_text(POLICY.replace(old, new))
        with pytest.raises(DiagnosticError) as wrong:
            load_arrangement(str(folder / "a.yaml"))
        (found,) = (d for d in wrong.value.diagnostics if d.code == code)
        assert found.span is not None and found.span.source.name.endswith("policy.yaml")
        assert str(found.span).split(":")[-2] == str(line), found
        assert not {"E157", "E158"} & {d.code for d in wrong.value.diagnostics}, "nothing is judged by a wrong policy"
    (folder / "policy.yaml").write_text("secret:x:0:0\n")
    with pytest.raises(DiagnosticError) as wrong:
        load_arrangement(str(folder / "a.yaml"))
    assert "E019" in {d.code for d in wrong.value.diagnostics} and "secret" not in str(wrong.value)
    (folder / "a.yaml").write_text(ARRANGEMENT.replace("operators: {", "operators: {policy: [root], "))
    for text, code in (("levels: [a", "E010"), ("", "E019")):
        (folder / "policy.yaml").write_text(text)
        with pytest.raises(DiagnosticError) as wrong:
            load_arrangement(str(folder / "a.yaml"))
        assert [d.code for d in wrong.value.diagnostics] == [code]
    (folder / "policy.yaml").write_text(POLICY)
    (folder / "a.yaml").write_text(ARRANGEMENT)
    (folder / "quiet.yaml").write_text("")
    with pytest.raises(DiagnosticError) as wrong:
        load_arrangement(str(folder / "a.yaml"))
    assert [d.code for d in wrong.value.diagnostics] == ["E011"], "of the machine, and not of those who name it"
    (folder / "policy.yaml").unlink()
    os.mkfifo(folder / "policy.yaml")
    with pytest.raises(DiagnosticError, match="it is a pipe"):
        load_arrangement(str(folder / "a.yaml"))


@pytest.mark.slow
def test_a_policy_that_was_edited_in_a_recording_is_noticed(folder: Path) -> None:
    record = folder / "r"
    done = llfsm("run", str(folder / "a.yaml"), "--rate", "0", "--for", "20ms", "--record", str(record))
    assert done.returncode == 0, done.stderr
    assert llfsm("replay", str(record)).returncode == 0
    data, entries = record.read_bytes(), entries_of(record)
    edited = data.replace(b"alarm: safety", b"alarm: public")
    record.write_bytes(edited)
    done = llfsm("replay", str(record))
    assert done.returncode == 3 and "E481" in done.stderr and "its header was changed" in done.stderr
    record.write_bytes(sealed(edited[: begin_of(data) - HEAD], entries))  # with checksums that fit
    done = llfsm("replay", str(record))
    assert done.returncode == 3 and "E482" in done.stderr


@pytest.mark.slow
def test_a_link_in_the_place_of_the_socket_is_not_followed(folder: Path) -> None:
    """Nor does its target change."""
    target = folder / "target"
    target.write_text("as it was")
    place = socket_path("attacked")
    place.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    place.symlink_to(target)
    done = llfsm("run", str(folder / "a.yaml"), "--whiteboard", "attacked", "--rate", "0", "--for", "20ms")
    assert target.read_text() == "as it was"
    assert done.returncode in (0, 3), done.stderr
    with suppress(OSError):
        assert not place.is_socket()


@pytest.mark.slow
def test_what_may_be_done_is_said(folder: Path) -> None:
    done = llfsm("access", str(folder / "a.yaml"))
    assert done.returncode == 0
    assert done.stdout.splitlines()[:-1] == [
        "levels, the lowest first: public, safety",
        "machine driver (public)",
        "  does write wish",
        "machine trojan (public)",
        "machine monitor (safety)",
        "  does write alarm",
        "  may also write speed",
        "  may also suspend, resume, restart, load, unload switch",
        "machine switch (safety)",
        "  does write speed",
        "  may also write alarm",
        "  may also suspend, resume, restart, load, unload monitor",
        "user safety_officer (safety)",
        "  may write wish",
        "  may suspend, replace driver",
        "  may restart monitor",
        "  may replace trojan",
        "other users (public)",
        "  may write wish",
        "  may suspend, replace driver",
        "  may replace trojan",
    ]
    told = json.loads(llfsm("access", str(folder / "a.yaml"), "--format", "json").stdout)
    assert told["policy"] == policy_digest(load_arrangement(str(folder / "a.yaml")))
    assert {"who": "driver", "what": "write", "target": "wish", "may": True, "does": True} in told["rights"]
    drawing = folder / "a.dot"
    assert llfsm("access", str(folder / "a.yaml"), "--draw", str(drawing)).returncode == 0
    assert "m0 -> w1;" in drawing.read_text() and "style=dashed" in drawing.read_text()
    assert llfsm("access", str(folder / "a.yaml"), "--draw", "a.gif").returncode == 2


OWN = user_name(os.getuid())
LOCKED = f"""\
levels: [public, safety]
machines: {{monitor: safety, switch: safety}}
write: {{speed: safety, alarm: safety, wish: safety}}
users: {{safety_officer: safety, {OWN}: safety}}
on_violation: refuse
"""
"""The driver may not wish for a speed any more."""


@pytest.fixture
def governed(folder: Path) -> Path:
    """An arrangement whose policy the user of the tests may change."""
    text = ARRANGEMENT.replace("operators: {", f"operators: {{policy: [{OWN}], ")
    (folder / "a.yaml").write_text(text)
    (folder / "policy.yaml").write_text(POLICY.replace("users: {", f"users: {{{OWN}: safety, "))
    (folder / "locked.yaml").write_text(LOCKED)
    return folder


@pytest.mark.slow
def test_a_policy_takes_the_place_of_another_in_a_run(governed: Path) -> None:
    log, record = governed / "log", governed / "r"
    began = load_arrangement(str(governed / "a.yaml"))
    with running(governed, "--audit", str(log), "--record", str(record), "-p", "slow: G speed < 6") as process:
        with called(process) as board:
            board.post(pedal=4)
            while board.get("speed") != 4:
                time.sleep(0.002)
        done = llfsm("send", "attacked", "policy", str(governed / "locked.yaml"))
        assert done.returncode == 0, done.stderr
        assert "note: checked: " in done.stdout and "the policy is the one in" in done.stdout
        with called(process) as board:
            board.post(pedal=2)
            frame = board.view().number
            while board.view().number < frame + 20:
                time.sleep(0.002)
            assert board.get("wish") == 4, "the driver's writes are refused"
            board.command("write", "wish", 1)  # the user may write it
            board.policy(governed / "policy.yaml")
        with called(process) as board:
            while board.get("wish") != 2:
                time.sleep(0.002)
        process.send_signal(signal.SIGTERM)
        process.communicate()
        assert process.returncode == 0
    (governed / "a.yaml").write_text((governed / "a.yaml").read_text().replace("policy.yaml", "locked.yaml"))
    locked = load_arrangement(str(governed / "a.yaml"))
    for number, arrangement in enumerate([began, locked, began]):
        path = f"{record}.{number + 1}" if number else str(record)
        done = llfsm("replay", path)
        assert done.returncode == 0 and "the same bit for bit" in done.stdout, done
        with Recording(path) as recording:
            assert recording.header["policy"] == policy_digest(arrangement)
    done = llfsm("debug", f"{record}.2", "--command", "expect wish == 4", "--command", "continue")
    assert done.returncode == 0 and "The recording ends here: replaced." in done.stdout, done
    entries = [json.loads(line) for line in log.read_bytes().splitlines()]
    asked = [entry for entry in entries if entry["what"] == "policy"]
    assert [entry["sha256"] for entry in asked] == [
        sha256((governed / name).read_bytes()).hexdigest() for name in ("locked.yaml", "policy.yaml")
    ]
    in_force = [entry["policy"] for entry in entries if entry["what"] == "replaced"]
    assert in_force == [policy_digest(locked), policy_digest(began)]
    assert verify(log).entries == len(entries)


@pytest.mark.slow
def test_policies_that_are_refused(governed: Path) -> None:
    """Each gives a machine more, or somebody else less than he needs; the place of what is wrong is said."""
    policy = (governed / "policy.yaml").read_text()
    log = governed / "log"
    with running(governed, "--audit", str(log)) as process, called(process) as board:
        digest = policy_digest(load_arrangement(str(governed / "a.yaml")))
        for old, new, why in (
            ("machines: {", "machines: {trojan: safety, ", r"evil\.yaml:2:20: machine `trojan` gets a higher"),
            ("speed: safety", "speed: public", r"evil\.yaml:3:16: machine `driver` may write `speed`"),
            ("speed: safety, ", "", "E158|to which `access` gives no class|may write `speed`"),
            ("users:", "command: {monitor: public}\nusers:", r"evil\.yaml:4:20: machine `driver` may command"),
            ("[public, safety]", "[safety, public]", r"evil\.yaml:1:9: .*write `levels: \[public, safety\]`"),
            ("[public, safety]", "[public, safety, god]", "has its levels, in their order"),
            (f"{OWN}: safety, ", "", "may not change the policy: that needs `safety`"),
            ("monitor: safety, ", "", "may not write `alarm`: that needs `safety`"),
            ("alarm: safety", "alarm: safty", r"evil\.yaml:3:31: there is no level `safty`"),
            ("levels:", "level:", "`access` has no key `level`"),
        ):  # fmt: skip
            assert old in policy
            (governed / "evil.yaml").write_text(policy.replace(old, new))
            with pytest.raises(PostRefused, match=why):
                board.policy(governed / "evil.yaml")
        (governed / "evil.yaml").write_text("file: policy.yaml\n")
        with pytest.raises(PostRefused, match="is not a policy file"):
            board.policy(governed / "evil.yaml")
        (governed / "policy.yaml").write_text(policy.replace("speed: safety", "speed: public"))  # nobody reads it again
        with pytest.raises(PostRefused, match="may not write `speed`"):
            board.replace("trojan", governed / "writes.yaml", unchecked=True)
    entries = [json.loads(line) for line in log.read_bytes().splitlines()]
    assert entries[0]["policy"] == digest
    assert sum(entry["what"] == "refused" and "evil.yaml" in entry["request"] for entry in entries) == 11
    assert not any(entry["what"] == "replaced" for entry in entries)


@pytest.mark.slow
def test_a_policy_that_would_violate_a_property_is_refused(governed: Path) -> None:
    """The driver brakes by itself; without its writes it would not."""
    (governed / "a.yaml").write_text((governed / "a.yaml").read_text().replace(", write: [wish]", ""))
    options = "--record", str(governed / "r"), "-p", "brakes: G (pedal == 0 -> X X wish == 0)"
    with (
        running(governed, *options) as process, called(process) as board,
        pytest.raises(PostRefused, match=r"`brakes` would be violated .*r\.refused\.1"),
    ):  # fmt: skip
        board.policy(governed / "locked.yaml")
    done = llfsm("replay", str(governed / "r.refused.1"))
    assert done.returncode == 0 and "violated" in done.stdout, done


@pytest.mark.slow
def test_an_operator_without_the_right_sends_a_policy(folder: Path) -> None:
    (folder / "open.yaml").write_text(POLICY.replace("safety_officer", OWN))
    for users, why in (("", "allows it to nobody"), ("policy: [safety_officer], ", "allows it to safety_officer")):
        (folder / "a.yaml").write_text(ARRANGEMENT.replace("operators: {", f"operators: {{{users}"))
        log = folder / f"log{len(users)}"
        with running(folder, "--audit", str(log)) as process:
            with called(process):
                done = llfsm("send", "attacked", "policy", str(folder / "open.yaml"))
            assert done.returncode == 3 and "may not change the policy" in done.stderr and why in done.stderr
        (entry,) = [e for e in map(json.loads, log.read_bytes().splitlines()) if e["what"] == "refused"]
        assert "may not change the policy" in entry["why"] and entry["uid"] == os.getuid()


@pytest.mark.slow
def test_a_file_that_is_edited_after_it_was_sent(governed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was sent is checked, loaded and recorded, whatever stands in the file by then."""
    path, ask = governed / "locked.yaml", Whiteboard._ask

    def edited(board: Whiteboard, *given: object, **options: object) -> object:
        path.write_text(LOCKED.replace("speed: safety", "speed: public"))
        return ask(board, *given, **options)

    with running(governed, "--record", str(governed / "r")) as process:
        with called(process) as board:
            monkeypatch.setattr(Whiteboard, "_ask", edited)
            board.policy(path)
            monkeypatch.undo()
        with Recording(f"{governed / 'r'}.2") as recording:
            assert recording.header["loaded"] == [["locked.yaml", LOCKED, False]]


def test_who_may_change_the_policy_is_checked_when_it_is_loaded(governed: Path) -> None:
    text = (governed / "a.yaml").read_text()
    told = access_text(load_arrangement(str(governed / "a.yaml")), "")
    assert f"user {OWN} (safety)\n" in told and told.count("  may change the policy\n") == 1
    for old, new, code in (
        (f"policy: [{OWN}]", "policy: [nobody]", "E157"),
        ("access: {file: policy.yaml}\n", "", "E098"),
    ):
        (governed / "a.yaml").write_text(text.replace(old, new))
        with pytest.raises(DiagnosticError) as wrong:
            load_arrangement(str(governed / "a.yaml"))
        (found,) = wrong.value.diagnostics
        assert found.code == code and "policy" in found.message and found.span is not None
