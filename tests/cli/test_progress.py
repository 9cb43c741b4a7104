"""The line of progress."""

from llfsm_verify.checking.verdict import Progress
from llfsm_verify.cli.io.progress import progress_text


def test_exploration_shows_rate_frontier_depth_memory_and_an_estimate():
    text = progress_text(Progress(1_000, 800, 1_000, 12, 2.0, 64 << 20), 0.5)
    assert text == (
        "1,000 configurations, 500/s, 64 MiB, 2 s, frontier 200, depth 12, about 400 to go (1 s)"
    )  # fmt: skip


def test_nothing_is_to_go_only_when_nothing_is_done():
    looking = Progress(1_000, 1_000, 1_000, 12, 2.0, 64 << 20, "looking for violations of a (1 of 2)")
    assert progress_text(looking) == "1,000 configurations, 64 MiB, 2 s, looking for violations of a (1 of 2)"
    assert "to go" not in progress_text(Progress(1_000, 1_000, 1_000, 12, 2.0, 64 << 20), 0.5)
