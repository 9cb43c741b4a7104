"""The panes of `llfsm debug`, driven by their keys."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable

import pytest
from textual.containers import VerticalScroll
from textual.pilot import Pilot  # noqa: TC002 - it is what tests are driven by
from textual.widgets import Static

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.extensions.debugger.commands import parse
from llfsm_verify.extensions.debugger.debugger import Debugger
from llfsm_verify.extensions.debugger.paths import Free
from llfsm_verify.extensions.debugger.session import Session
from llfsm_verify.extensions.terminal.panes import KEYS, Panes
from tests.cli.running import LIGHTS

Press = Callable[..., Awaitable[None]]


def driven(check: Callable[[Panes, Press], Awaitable[None]], size: tuple[int, int] = (140, 50)) -> Panes:
    """A terminal that is none, in which keys are pressed one by one, each command being waited for."""
    app = Panes(Session(Debugger(load_arrangement(LIGHTS), Free)))

    async def run() -> None:
        async with app.run_test(size=size) as pilot:

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
    while app.is_running and not app.is_shown:
        await pilot.pause()


def shown(app: Panes, name: str) -> str:
    return str(app.query_one(f"#{name}", Static).content)


@pytest.mark.long
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


def visible(app: Panes, name: str) -> str:
    """The lines of a pane that its place on the screen has room for."""
    pane = app.query_one(f"#{name}").parent
    assert isinstance(pane, VerticalScroll)
    lines = [strip.text for strip in app.screen._compositor.render_strips()]
    x, y, width, height = pane.content_region
    return "\n".join(line[x : x + width] for line in lines[y : y + height])


@pytest.mark.slow
@pytest.mark.parametrize("size", [(160, 45), (100, 24)])
def test_panes_follow_the_present_step(size: tuple[int, int]) -> None:
    async def check(app: Panes, press: Press) -> None:
        for _ in range(16):
            await press("f11")
        pane = app.query_one("#steps").parent
        assert isinstance(pane, VerticalScroll) and pane.max_scroll_y > 0, "the steps do not fit"
        for keys, step in (((), 48), (("b", "b"), 46), (("n",), 48), (("s",), 49)):
            await press(*keys)
            assert f"at step {step}," in shown(app, "where")
            assert f"\n{step} " in visible(app, "steps").replace("\n ", "\n")
            assert f"step {step} was a ringlet" in " ".join(visible(app, "guards").split())
        guards = app.query_one("#guards").parent
        assert isinstance(guards, VerticalScroll)
        guards.scroll_end(animate=False)
        await press("s")
        assert "step 50 was a ringlet" in " ".join(visible(app, "guards").split())

    driven(check, size)


@pytest.mark.slow
@pytest.mark.parametrize("width", [63, 72, 120])
def test_panes_follow_where_a_scroll_bar_wraps_lines(width: int) -> None:
    """The lines of the steps have just room without the scroll bar: the end that it was scrolled to was not the end."""

    async def check(app: Panes, press: Press) -> None:
        for step in (3, 6, 9):
            await press("f11")
            assert f"\n{step} " in visible(app, "steps").replace("\n ", "\n").replace("\n ", "\n")

    driven(check, (width, 30))


def test_every_key_has_a_command() -> None:
    assert all(parse(line) is not None for line, _ in KEYS.values())
