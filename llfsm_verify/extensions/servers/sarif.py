"""Results as SARIF 2.1.0 (OASIS standard, 2020), which code hosts show beside the lines that they are about."""

from __future__ import annotations

import json
from collections.abc import Sequence
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version

from llfsm_verify import Diagnostic, Verdict
from llfsm_verify.extensions.servers.flows import (
    ROOT,
    ending,
    location,
    name_of,
    physical_location,
    sentence,
    uri_of,
    with_flows,
)
from llfsm_verify.plug import (
    CLAIMED,
    CONTRADICTED,
    Arrangement,
    FaultFinding,
    Json,
    PropertyResult,
    Result,
    all_codes,
    asked_text,
    fault_text,
    is_contradicted,
    resumed_text,
    under_assumptions,
    vacuity_texts,
    verdict_text,
)

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"

VIOLATED, EMPTY, UNKNOWN, RESUMED = "violated", "empty", "unknown", "resumed"
RULES = {VIOLATED: "PropertyViolated", EMPTY: "EmptyPass", UNKNOWN: "VerdictUnknown", RESUMED: "ResumedPass"}
SHORT = {
    VIOLATED: "A run of the arrangement violates a property.",
    EMPTY: "A property holds, but says less than it seems to.",
    UNKNOWN: "A property was neither found to hold nor violated.",
    RESUMED: "A verdict rests on a checkpoint, but --strict needs more.",
}
HELP = {
    VIOLATED: "The code flow is a run that the executor took, step by step, to where the property can no longer hold, "
    "or round a loop forever. Mend the machine, or the property if it asks for too much. `llfsm-verify --save-traces "
    "DIR` saves the run, and `llfsm replay` runs it again.",
    EMPTY: "Something that the property speaks of never happens, or does not matter: the message says what. Mend the "
    "property or the machine; `llfsm-verify --strict` fails such a pass, and --accept-vacuity NAME accepts it.",
    UNKNOWN: "The message says why. Where no run satisfies the assumptions, correct them. Where the search ended "
    "before it was complete, raise the limit that the reason names (--max-states, --memory, --timeout), have --engine "
    "bmc look at longer runs with --depth N, or make the arrangement smaller.",
    RESUMED: "What a checkpoint says of a search cannot be checked without searching again. Search without --resume, "
    "or leave out --strict where nobody but you can have written the checkpoint.",
}


def report(result: Result, arrangement: Arrangement, *_: object) -> str:
    """A log with one run: a result for each property violated, unknown or held vacuously, each fault, and each warning.

    These stand at the property's line, a fault at the line of the machine that raises it; each run is a code flow
    through the lines of transitions and states. A pass that is empty is an error with ``--strict`` and else a note, one
    that ``--strict`` knows too little of is unknown. Places are relative to the folder that we are in.
    """
    results: list[Json] = []
    rules: list[str] = []
    notes: list[Json] = []
    for item in result.properties:
        if item.verdict is not Verdict.HOLDS:
            results.append(_property(result, arrangement, item))
            rules.append(VIOLATED if item.verdict is Verdict.VIOLATED else UNKNOWN)
        elif result.is_claimed(item.verdict) or result.is_unseen(item) or item.vacuity.findings:
            results.append(_pass(result, arrangement, item))
            rules.append(_pass_rule(result, item))
        if item.verdict is Verdict.UNKNOWN:
            notes.append(notification(f"{item.name} is unknown: {item.reason}"))
        elif result.is_unseen(item):
            notes.append(notification(f"{item.name}: {vacuity_texts(result, item)[-1]}"))
    for finding in result.faults.findings:
        results.append(_fault(arrangement, finding))
        rules.append(finding.site.code)
    if result.faults.verdict is Verdict.UNKNOWN:
        notes.append(notification(f"whether a run ends in a fault is unknown: {fault_text(result)}"))
    if result.is_claimed(result.faults.verdict):
        results.append(_claimed_faults(result, arrangement))
        rules.append(RESUMED)
    if result.exploration.resumed_from is not None:
        notes.append(notification(f"the search went on from the checkpoint {result.exploration.resumed_from}"))
    for warning in (*arrangement.warnings, *result.warnings):
        results.append(diagnostic_result(warning))
        rules.append(warning.code)
    return sarif_log(results, rules, notes, exit_code=result.exit_code, successful=not result.interrupted)


def failure_sarif(diagnostics: Sequence[Diagnostic], exit_code: int) -> str:
    """The same for wrong input: a result for each diagnostic, at its place."""
    results: list[Json] = [diagnostic_result(d) for d in diagnostics]
    return sarif_log(results, [d.code for d in diagnostics], [], exit_code=exit_code, successful=False)


# ---------------------------------------------------------------- the log around the results


def sarif_log(results: list[Json], used: list[str], notes: list[Json], *, exit_code: int, successful: bool) -> str:
    """The whole log; `used` names the rule of each result: one of ours about verdicts, or a code."""
    rules = sorted(set(used))
    for result, rule in zip(results, used, strict=True):
        assert isinstance(result, dict)
        result["ruleIndex"] = rules.index(rule)
    driver: dict[str, Json] = {"name": "llfsm-verify", "rules": [_rule(rule) for rule in rules]}
    try:
        driver["semanticVersion"] = version("llfsm-verify")
    except PackageNotFoundError:
        pass  # a source tree that is not installed has no version
    invocation: dict[str, Json] = {
        "executionSuccessful": successful,
        "exitCode": exit_code,
        "toolExecutionNotifications": notes,
    }
    run: dict[str, Json] = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "originalUriBaseIds": {ROOT: {"description": {"text": "The folder in which llfsm-verify was called."}}},
        "invocations": [invocation],
        "results": results,
    }
    return json.dumps({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}, indent=2, ensure_ascii=False)


def _rule(rule: str) -> Json:
    """What is known of a rule: ours about verdicts, or the code of a diagnostic or fault."""
    if rule in RULES:
        name, short, text = RULES[rule], SHORT[rule], HELP[rule]
    else:
        name, short = rule, all_codes()[rule]
        text = f"{short} The message says what to write instead; docs/diagnostics.md lists all codes."
    level = "warning" if rule[0] in "WL" else "error"
    return {
        "id": rule,
        "name": name,
        "shortDescription": {"text": short},
        "fullDescription": {"text": text},
        "help": {"text": text},
        "defaultConfiguration": {"level": level},
    }


def notification(text: str) -> Json:
    """Something that is worth saying beside the results."""
    return {"level": "warning", "message": {"text": text}}


# ---------------------------------------------------------------- results


def _property(result: Result, arrangement: Arrangement, item: PropertyResult) -> dict[str, Json]:
    violated = item.verdict is Verdict.VIOLATED
    assuming = f" ({under_assumptions(result)})" if violated and result.assumptions else ""
    sentences = [f"{item.name} is {item.verdict.value}{assuming}: {asked_text(item.kind, item.text)}"]
    sentences += ending(item.trace) if item.trace is not None else []
    sentences += [sentence(text) for text in (*filter(None, (item.reason, item.only)), *item.notes)]
    sentences += [sentence(CONTRADICTED)] if is_contradicted(item) else []
    traces = () if item.trace is None else (item.trace, *item.more)
    value: dict[str, Json] = {
        "ruleId": VIOLATED if violated else UNKNOWN,
        # What was not decided is no failure by the standard, and then has no level.
        "kind": "fail" if violated else "open",
        "level": "error" if violated else "none",
        "message": {"text": "\n".join(sentences)},
        **_whose(arrangement, item),
    }
    return with_flows(value, traces, arrangement)


def _pass(result: Result, arrangement: Arrangement, item: PropertyResult) -> dict[str, Json]:
    """A property that holds, and less is known of it, or said by it, than one would think."""
    rule = _pass_rule(result, item)
    fails = rule == RESUMED or result.is_empty(item)
    lines = [
        f"{item.name} {verdict_text(result, item)}: {asked_text(item.kind, item.text)}",
        *map(sentence, vacuity_texts(result, item)),
    ]
    value: dict[str, Json] = {
        "ruleId": rule,
        "kind": "open" if rule == UNKNOWN else "fail",
        "level": "none" if rule == UNKNOWN else "error" if fails else "note",
        "message": {"text": "\n".join(lines)},
        **_whose(arrangement, item),
    }
    if item.vacuity.accepted and rule == EMPTY:
        value["suppressions"] = [{"kind": "external", "justification": f"--accept-vacuity {item.name}"}]
    escape = result.escape_of(item)
    return value if escape is None else with_flows(value, (escape,), arrangement)


def _pass_rule(result: Result, item: PropertyResult) -> str:
    """The worst that is to be said of a pass."""
    if result.is_claimed(item.verdict):
        return RESUMED
    return UNKNOWN if result.is_unseen(item) and not result.is_empty(item) else EMPTY


def _claimed_faults(result: Result, arrangement: Arrangement) -> dict[str, Json]:
    """That no run ends in a fault, as a checkpoint says."""
    return {
        "ruleId": RESUMED,
        "kind": "fail",
        "level": "error",
        "message": {"text": f"{fault_text(result)}{resumed_text(result)}\n{sentence(CLAIMED)}"},
        "locations": [location(None, arrangement, name=f"{arrangement.name}.faults")],
        "partialFingerprints": _fingerprint(uri_of(arrangement.path) or arrangement.name, RESUMED, "faults"),
    }


def _whose(arrangement: Arrangement, item: PropertyResult) -> dict[str, Json]:
    """A property's place, and what it is known by when lines move."""
    return {
        "locations": [location(item.span, arrangement, name=f"{arrangement.name}.{item.name}")],
        "partialFingerprints": _fingerprint(
            uri_of(arrangement.path) or arrangement.name, item.kind, item.name, item.text
        ),
    }


def _fault(arrangement: Arrangement, finding: FaultFinding) -> dict[str, Json]:
    site = finding.site
    shown = None if site.span is None else site.span.source.excerpt(site.span.start)
    line = " ".join((shown or "").split())
    value: dict[str, Json] = {
        "ruleId": site.code,
        "kind": "fail",
        "level": "error",
        "message": {"text": f"A run ends in a fault: {site.message}\n{' '.join(ending(finding.trace))}"},
        "locations": [location(site.span, arrangement, name=f"{arrangement.name}.faults")],
        "partialFingerprints": _fingerprint(
            uri_of(arrangement.path) or arrangement.name,
            site.code,
            uri_of(name_of(site.span)) or "",
            site.message,
            line,
        ),
    }
    return with_flows(value, (finding.trace,), arrangement)


def diagnostic_result(diagnostic: Diagnostic) -> dict[str, Json]:
    """What a diagnostic says, at its place."""
    parts = [diagnostic.message, *diagnostic.notes, *([f"Hint: {diagnostic.hint}"] if diagnostic.hint else [])]
    name = name_of(diagnostic.span) or diagnostic.file or ""
    uri = uri_of(name)
    value: dict[str, Json] = {
        "ruleId": diagnostic.code,
        "level": "error" if diagnostic.is_error else "warning",
        "message": {"text": "\n".join(parts)},
        "partialFingerprints": _fingerprint(uri or name, diagnostic.code, diagnostic.message),
    }
    if uri is not None:
        value["locations"] = [{"physicalLocation": physical_location(uri, diagnostic.span)}]
    return value


def _fingerprint(*parts: str) -> dict[str, Json]:
    """The same as long as all parts are, wherever the lines have moved."""
    return {"llfsm/v1": sha256("\0".join(parts).encode()).hexdigest()[:32]}
