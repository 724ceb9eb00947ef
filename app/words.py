"""Small pieces of HTML for the dashboard's panels. Whatever comes from people or files is escaped here."""

from html import escape

from app.clicks import listening, saying
from app.spots import spot_of
from core.findings import Finding
from core.wording import as_sentence

STYLE = """<style>
.ta{font-size:13px;line-height:1.45;padding:0 10px;overflow-wrap:anywhere}
.ta h3{margin:0 0 4px;font-size:15px}.ta p{margin:4px 0}
.ta table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}
.ta th{font-weight:600;text-align:left;border-bottom:1px solid var(--mantine-color-default-border);padding:2px 4px;
overflow-wrap:normal}[data-testid=table1] th{white-space:nowrap}
.ta td{padding:2px 4px;border-bottom:1px solid var(--mantine-color-default-border)}
.ta td:first-child{overflow-wrap:normal}
.ta td.n,.ta th.n{text-align:right}.ta td.n,.ta td.key{white-space:nowrap}
.ta tr.more td{border:0;padding-top:0}.ta tr.led td{border-bottom:0}
.ta tr.now td{font-weight:700;background:rgba(0,114,178,.13)}
.ta .ok{color:#009E73}.ta .doubt{color:#B07A00}.ta .bad{color:#D55E00}.ta .soft{opacity:.7}
.ta code{font-size:12px;user-select:all;overflow-wrap:anywhere}
.ta .verdict{font-size:16px;font-weight:700}
.ta abbr{text-decoration:underline dotted;text-underline-offset:2px;cursor:help}
.ta .ta-copy{font:inherit;font-size:11px;line-height:1;padding:2px 7px;margin-left:4px;border-radius:3px;cursor:pointer;
color:inherit;background:none;border:1px solid var(--mantine-color-default-border)}
.ta .value{white-space:nowrap}.ta td.name{min-width:7.2em}
.ta table[data-testid=table1] :is(td,th){padding-inline:2px}
div:has(> .ta-big)+div button{height:42px!important;font-size:17px;font-weight:700}
div:has(> .ta-big)+div button .mantine-Button-label{padding-inline-start:6px}
.ta[data-testid=seat]{margin-bottom:9px}
[data-dock-area^=gui-tabs] [data-dock-tab]{padding:0 .45em!important}
.ta dt{font-weight:600;margin-top:6px}.ta dd{margin:0 0 2px}
</style>"""
BIG = "<i class='ta-big' hidden></i>"
"""Stands before a button that is to be larger than others."""


def block(inner: str, test_id: str) -> str:
    """A piece of the page with the common look and an anchor for tests."""
    return f"<div class='ta' data-testid='{escape(test_id)}'>{inner}</div>"


def findings_words(findings: tuple[Finding, ...]) -> str:
    """Findings as a list, significant ones marked by sign and colour; a click shows where it is."""
    told = _list([finding for finding in findings if finding.significant])
    quiet = [finding for finding in findings if not finding.significant]
    if quiet:
        count = "1 value is" if len(quiet) == 1 else f"{len(quiet)} values are"
        told += f"<details><summary class='soft'>{count} not significantly off</summary>{_list(quiet)}</details>"
    return block(listening(told), "findings")


def _list(findings: list[Finding]) -> str:
    return f"<ul style='padding-left:18px;margin:4px 0'>{''.join(map(_finding, findings))}</ul>"


def _finding(finding: Finding) -> str:
    spot = spot_of(finding)
    where = "" if spot is None else saying(spot.word, "Show it in 3-D")
    look, sign = ("bad", "▲") if finding.significant else ("soft", "○")
    return f"<li class='{look}' {where}>{sign} {escape(as_sentence(finding.text))}</li>"
