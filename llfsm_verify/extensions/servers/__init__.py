"""Reports for servers: JUnit XML, which continuous integration shows, and SARIF, which code hosts show."""

from __future__ import annotations

from llfsm_verify.plug import ReportEntry

ENTRIES = {
    "llfsm_verify.reports.result": (
        ReportEntry("junit", f"{__name__}.junit:report", "JUnit XML, for continuous integration", (".xml",)),
        ReportEntry(
            "sarif",
            f"{__name__}.sarif:report",
            "SARIF 2.1.0, for code hosts",
            (".sarif",),
            failure=f"{__name__}.sarif:failure_sarif",
        ),
    ),
    "llfsm_verify.reports.lint": (ReportEntry("sarif", f"{__name__}.findings:report", "SARIF 2.1.0, for code hosts"),),
}
