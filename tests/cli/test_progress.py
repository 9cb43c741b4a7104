"""The line of progress."""

from llfsm_verify.checking.verdict import Progress
from llfsm_verify.cli.io.progress import ProgressLine, progress_text


def test_exploration_shows_rate_frontier_depth_memory_and_an_estimate():
    text = progress_text(Progress(1_000, 800, 1_000, 12, 2.0, 64 << 20), 0.5)
    assert text == (
        "1,000 configurations, 500/s, 64 MiB, 2 s, frontier 200, depth 12, about 400 to go (1 s)"
    )  # fmt: skip


def test_nothing_is_to_go_only_when_nothing_is_done():
    looking = Progress(1_000, 1_000, 1_000, 12, 2.0, 64 << 20, "looking for violations of a")
    assert progress_text(looking) == "1,000 configurations, 64 MiB, 2 s, depth 12, looking for violations of a"
    assert "to go" not in progress_text(Progress(1_000, 1_000, 1_000, 12, 2.0, 64 << 20), 0.5)


def test_of_several_engines_it_says_which_are_at_work():
    waiting = Progress(0, 0, 0, 0, 4.0, 0, "at work: pdr; done: explicit, bmc")
    assert progress_text(waiting) == "4 s, at work: pdr; done: explicit, bmc"


def test_a_second_search_does_not_count_backwards():
    line = ProgressLine()
    texts = [line.text(Progress(states, states, states + 9, 3, 1.0, 1 << 20)) for states in (10, 70, 20, 80, 5)]
    assert [text.partition(" configurations")[0] for text in texts] == [
        "10", "70", "search 2: 20", "search 2: 80", "search 3: 5",
    ]  # fmt: skip
