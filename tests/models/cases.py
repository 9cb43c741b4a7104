"""The case studies: what the tests of this folder, and the table in `models/README.md`, know of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tests.quick import examples


@dataclass(frozen=True, slots=True)
class CaseStudy:
    model: str
    """Its folder in `models/`, and its file in `properties/`."""
    configurations: int
    properties: int
    violated: Mapping[str, frozenset[str]] = field(default_factory=dict)
    """Faulty version to the properties that it violates (`faults`: it ends in a fault); the others hold."""
    unnoticed: frozenset[str] | None = None
    """The mutants that violate nothing, each with the reason why that is right. None: they are not listed, because many
    machines of the model are surroundings, and not every change of these is a mistake."""
    smaller: Mapping[str, str] = field(default_factory=dict)
    """What to replace when mutants are tried, where the model itself takes too long for that."""

    walked: int = examples(320)
    """Configurations of the walk beside the direct interpreter, which tries many values of an input from each."""

    @property
    def arrangement(self) -> Path:
        return Path("models", self.model, "arrangement.yaml")

    @property
    def property_file(self) -> Path:
        return Path("properties", f"{self.model}.ltl")


_FRESH = frozenset({"fresh_0", "fresh_1", "fresh_2", "fresh_3"})
"""What the arbiter counts as fresh."""

_FOLLOWS = frozenset({f"follows_{state}" for state in ("INITIAL", "READY", "SET", "PLAYING", "FINISHED")})
"""What is said of packets that are obeyed."""

_GAME = frozenset({"game_INITIAL", "game_SET", "game_FINISHED"})
"""What is said of states of the game in which nobody may move."""

CASES: tuple[CaseStudy, ...] = (
    CaseStudy(
        "microwave",
        configurations=3_041,
        properties=23,
        violated={
            "faulty_R1": frozenset({"R1_one_press_one_minute"}),
            "faulty_R2": frozenset({"R2_extra_minute", "R2_then_opened"}),
            "faulty_R3": frozenset({"R3_no_effect"}),
            "faulty_R4": frozenset({"R4_door"}),
            "faulty_R5": frozenset({"R5_stops_cooking", "R5_does_not_start"}),
            "faulty_R5_timer": frozenset({"R5_keeps_the_time", "R2_then_opened"}),
            "faulty_R6": frozenset({"R6_light_off"}),
            "faulty_R7": frozenset({"R7_beeps", "R7_after_the_tube", "R7_no_early_beep", "R7_one_beep"}),
        },
        unnoticed=frozenset(
            {
                # The time left grows from 0 to a whole minute at once, so 1 is met only when the light is on already.
                "light OFF/0: door_open || time_left > 1",
                # The same for the beeper.
                "beeper SILENT/0: time_left > 1",
            }
        ),
        # A minute of six seconds, three of which fit in.
        smaller={"60": "6", "180": "18", "120": "12", "121": "13", "59": "5"},
    ),
    CaseStudy(
        "reasoned_lights",
        configurations=98_048,
        properties=7,
        violated={"faulty_hasty": frozenset({"mutual_exclusion", "lamps_exclusive"})},
        # A turn of two seconds, and amber for one.
        smaller={"8": "2", "3": "1"},
    ),
    CaseStudy(
        "ball_conditions",
        configurations=34_271,
        properties=15,
        violated={
            "faulty_vision": frozenset({"faults", "whole_blobs", "no_blob"}),
            "faulty_BC2": frozenset({"BC2"}),
            "faulty_ratio": frozenset({"BC1"}),
        },
    ),
    CaseStudy(
        "colour_follower",
        configurations=9_692,
        properties=13,
        violated={
            "faulty_sign": frozenset({"steers_right", "steers_left", "full_speed", "never_lost", "follows", "settles"}),
            "faulty_start": frozenset({"knows_width", "never_lost"}),
        },
        smaller={"start: {type: 4..12": "start: {type: 7..9"},
    ),
    CaseStudy(
        "fruit_picking",
        configurations=94,
        properties=26,
        violated={
            "faulty_reach": frozenset({"skips", "ends", "places"}),
            "faulty_pause": frozenset({"paused_still", "dropped_still"}),
            "faulty_recovery": frozenset({"new_image", "ends", "places", "full_hand"}),
            "faulty_inside": frozenset({"paused_still", "anew"}),
        },
        smaller={"PENDING, ACTIVE, PREEMPTED, RECALLED, REJECTED, LOST": "PENDING, PREEMPTED"},
    ),
    CaseStudy(
        "turtle",
        configurations=1_844,
        properties=18,
        violated={
            "faulty_hasty": frozenset(
                {"never_hits", "keeps_away", "knows_where", "stands_still", "afraid_of_walls", "turns_at_walls"}
                | {f"moves_{direction}" for direction in ("east", "north", "west", "south")}
            ),
            "faulty_dithering": frozenset({"gets_away", "walks_on", "left", "right"}),
        },
    ),
    CaseStudy(
        "distance_sensor",
        configurations=549,
        properties=13,
        violated={
            "faulty_order": frozenset({"sees_stop", "sees_slow", "waits"}),
            "faulty_brake": frozenset({"stops", "slows"}),
        },
        walked=10,
    ),
    CaseStudy(
        "xray",
        configurations=1_649,
        properties=11,
        violated={
            "faulty_edit": frozenset({"no_overdose", "no_underdose", "as_shown"}),
            "faulty_counter": frozenset({"no_overdose", "no_underdose"}),
            "faulty_door": frozenset({"door_stops"}),
        },
        # Magnets that take three seconds, and a turntable that takes five.
        smaller={"7": "2", "9": "4"},
    ),
    CaseStudy(
        "takeover",
        configurations=815,
        properties=8,
        violated={
            "faulty_one_sided": frozenset({"caught", "brief", "never_again", "for_good"}),
            "faulty_right": frozenset({"brief", "never_again", "served"}),
        },
    ),
    CaseStudy(
        "komodo_region",
        configurations=4_075,
        properties=5,
        violated={
            "faulty_unguarded": frozenset({"region"}),
            "faulty_order": frozenset({"region"}),
            "faulty_edge": frozenset({"region"}),
        },
    ),
    CaseStudy(
        "komodo_arm",
        configurations=247_698,
        properties=5,
        violated={
            "faulty_hasty": frozenset({"steady", "region", "fast"}),
            "faulty_backwards": frozenset({"steady", "region"}),
            "faulty_one_monitor": frozenset({"steady", "slow"}),
        },
    ),
    CaseStudy(
        "level_crossing",
        configurations=27,
        properties=6,
        violated={"faulty_late": frozenset({"safe"}), "faulty_timer": frozenset({"safe", "opens"})},
        walked=43,
    ),
    CaseStudy(
        "lift",
        configurations=1_983,
        properties=6,
        violated={
            "faulty_brake": frozenset({"in_shaft", "level_open", "answered_0", "answered_1", "answered_2"}),
            "faulty_hurry": frozenset({"answered_0", "answered_1", "answered_2"}),
            "faulty_favourite": frozenset({"answered_0"}),
        },
    ),
    CaseStudy(
        "vacuum",
        configurations=24_378,
        properties=24,
        violated={
            "faulty_reserve": frozenset({"never_empty", "covered"}),
            "faulty_lanes": frozenset({"from_none", "faults"}),
            "faulty_count": frozenset({"counts", "last", "faults"}),
            "faulty_brush": frozenset({"never_empty", "brush_on", "brush_off", "soon"}),
            "faulty_order": frozenset({"never_empty", "inside", "bump", "lifted_stops"}),
        },
        unnoticed=frozenset(),
    ),
    CaseStudy(
        "batman",
        configurations=4_081,
        properties=28,
        violated={
            "faulty_order": frozenset({"fresh_1", "fresh_2", "steps_right", "steps_left"}),
            "faulty_stale": frozenset({"wish_1", "wish_0", "inhibited", "nobody", "dead_charge", "dead_avoid"}),
            "faulty_patience": _FRESH | {"dead_charge", "dead_avoid", "dead_halt"},
            "faulty_inhibit": frozenset({"inhibited", "rests"}),
            "faulty_guard": frozenset({"wish_3", "guarded", "dead_halt"}),
            "faulty_schedule": _FRESH
            | {"wish_3", "wish_2", "wish_1", "wish_0", "inhibited", "nobody", "wanders", "approaches", "rests"}
            | {"steps_right", "steps_left", "stops", "dead_charge", "dead_avoid", "dead_halt"},
            "faulty_bypass": frozenset({"stops"}),
        },
        unnoticed=frozenset(
            {
                # Wandering that has stopped for good is one of those that are allowed.
                "wander ANY.internal: without posts = choose(bool);",
                # The wish of a slot is to stand before anybody has written it.
                "halt WATCH.internal: without slots[level].wish = STAND;",
            }
        ),
    ),
    CaseStudy(
        "robocup",
        configurations=29_759,
        properties=33,
        violated={
            "faulty_silence": _FOLLOWS | _GAME | {"penalty", "silence", "arrives"},
            "faulty_late": frozenset({f"stands_{state}" for state in ("SET", "FINISHED", "PENALISED", "LOST")})
            | {"penalty", "game_SET", "game_FINISHED", "waits"},
            "faulty_back": _FOLLOWS | _GAME | {"arrives"},
            "faulty_pardon": frozenset({"punished", "pressed"}),
            "faulty_button": frozenset({"once"}),
        },
        unnoticed=frozenset(
            {
                # A packet names one state of the game, and there is none where it is silent: any order does the same.
                "player INITIAL/2: before 1",
                "player READY/2: before 1",
                "player SET/2: before 1",
                "player PLAYING/2: before 1",
                "player PLAYING/3: before 2",
                "player FINISHED/2: before 1",
            }
            | {f"player {state}/{n}: before {n - 1}" for state in ("PENALISED", "LOST") for n in range(2, 6)}
        ),
    ),
    CaseStudy(
        "press",
        configurations=3_736,
        properties=18,
        violated={
            "faulty_tied": frozenset({"operator", "together", "tied", "single"}),
            "faulty_start": frozenset({"operator", "tied"}),
            "faulty_clock": frozenset({"together"}),
            "faulty_curtain": frozenset({"helper", "held"}),
            "faulty_repeat": frozenset({"single", "starts", "order"}),
            "faulty_brake": frozenset({"operator", "helper", "held", "brakes", "presses", "lowest"}),
        },
        unnoticed=frozenset(
            {
                # A cycle later in RELEASED; there are no promises for a button that is released for one cycle.
                "two_hand ONE/0: to LOCKED",
                # The same, where both are released at the moment at which the time is over.
                "two_hand ONE/1: before 0",
                # When the time is over, ONE waits for both buttons to be released as LOCKED does.
                "two_hand ONE/1: to ONE",
                # Times are multiples of 100 ms here.
                "two_hand ONE/1: after_ms(401)",
                "press PRESSED/0: after_ms(201)",
            }
        ),
    ),
    CaseStudy(
        "line_follower",
        configurations=2_479,
        properties=13,
        violated={
            "faulty_side": frozenset(
                {"gives_up", "kept", "sees", "on_track", "goes_on", "left_of", "right_of", "small"}
            ),
            "faulty_memory": frozenset({"kept", "sees", "on_track", "between", "small"}),
            "faulty_fast": frozenset({"kept", "sees", "on_track", "between", "small"}),
            "faulty_search": frozenset({"found_right"}),
        },
        unnoticed=frozenset(
            {
                # What the turtle sees first while it turns to the left is on its left, and to the right on its right.
                "follower LOOK_LEFT/0: to LEFT",
                "follower LOOK_RIGHT/0: to RIGHT",
                # It sees the line before the time is over, or not at all.
                "follower LOOK_LEFT/1: before 0",
                "follower LOOK_RIGHT/1: before 0",
                # Times are multiples of 100 ms here.
                "follower LOOK_LEFT/1: after_ms(701)",
                "follower LOOK_RIGHT/1: after_ms(1601)",
                # A little faster does as well.
                "follower LOOK_RIGHT.on_entry: turn = -0.6;",
                # The two guards exclude each other.
                "follower STRAIGHT/1: before 0",
            }
        ),
    ),
)
