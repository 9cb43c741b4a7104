"""The panes of `llfsm debug`, driven by their keys."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest
from textual.pilot import Pilot  # noqa: TC002 - it is what tests are driven by
from textual.widgets import Static

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.cli.debug_panes import KEYS, Panes
from llfsm_verify.runtime.debugging.commands import parse
from llfsm_verify.runtime.debugging.debugger import Debugger
from llfsm_verify.runtime.debugging.paths import Free
from llfsm_verify.runtime.debugging.session import Session
from tests.cli.running import LIGHTS

Press = Callable[..., Awaitable[None]]


def driven(check: Callable[[Panes, Press], Awaitable[None]]) -> Panes:
    """A terminal that is none, in which keys are pressed one by one, each command being waited for."""
    app = Panes(Session(Debugger(load_arrangement(LIGHTS), Free)))

    async def run() -> None:
        async with app.run_test(size=(140, 50)) as pilot:

            async def press(*keys: str) -> None:
                for key in keys:
                    await pressed(app, pilot, key)

            await check(app, press)

    asyncio.run(run())
    return app


async def pressed(app: Panes, pilot: Pilot[int], key: str) -> None:
    await pilot.press(key)
    await pilot.pause()
    while app.is_busy:
        await app.workers.wait_for_complete()
        await pilot.pause()


def shown(app: Panes, name: str) -> str:
    return str(app.query_one(f"#{name}", Static).content)


@pytest.mark.slow
def test_keys_walk_and_panes_show_where() -> None:
    async def check(app: Panes, press: Press) -> None:
        assert "at step 0" in shown(app, "where")
        assert "no step has been taken yet" in shown(app, "guards")
        await press("f10", "s")
        assert "at step 2" in shown(app, "where") and "ns@GREEN" in shown(app, "where")
        assert "turn = true, other@RED = true" in " ".join(shown(app, "guards").split())
        assert "@GREEN" in shown(app, "machines") and "ns@GREEN" in shown(app, "state")
        await press("f11", "b")
        assert "at step 2" in shown(app, "where") and "1 later step known" in shown(app, "where")
        await press("f9", *"ns@RED", "enter")
        assert "break point 1: ns@RED" in shown(app, "told")
        await press("shift+f5")
        assert "at step 0" in shown(app, "where")
        await press("colon", *"set", "space", *"car", "space", *"true", "enter")
        assert "car = true from here on" in shown(app, "told") and "set" in shown(app, "inputs")
        await press("f5")
        assert "`ns@RED` is true" in shown(app, "told")
        await press("colon", *"jump", "enter")
        assert "there is no command `jump`" in shown(app, "told")
        await press("home", "q")

    assert driven(check).return_value == 0


@pytest.mark.slow
def test_what_was_expected_and_is_not_so_is_the_exit_code() -> None:
    async def check(app: Panes, press: Press) -> None:
        await press("colon", *"expect", "space", *"ns@GREEN", "enter")
        assert "ns@GREEN: false" in shown(app, "told")
        await press("colon", "q", "enter")

    assert driven(check).return_value == 1


def test_every_key_has_a_command() -> None:
    assert all(parse(line) is not None for line, _ in KEYS.values())
