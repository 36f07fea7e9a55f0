"""One HTML file about a flight: what it came to, pictures, every replan, everything that happened.

Self-contained: pictures are inside, nothing is fetched, no script runs. Every text of a log is data and is escaped.
"""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from mission.flying.air import drag_words, wind_words
from mission.flying.chatter import Chatter
from mission.flying.flight_log import FlightLog
from mission.flying.summary import clearance_words
from mission.pictures.style import distance, duration
from mission.view import words_of

REPORT_NAME = "report.html"
_MOST_EVENTS = 2000
_SHOWN = ("phase", "say", "order", "answer", "push", "stall", "course")

_STYLE = """
:root { --ink: #1f2933; --soft: #616e7c; --line: #d9e0e6; --card: #f5f7fa; --good: #2b8a3e; --bad: #c92a2a; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 1120px; padding: 2rem 1.25rem 4rem; color: var(--ink);
       font: 15px/1.5 system-ui, sans-serif; }
h1 { margin: 0; font-size: 1.7rem; } h2 { margin: 2.4rem 0 .7rem; font-size: 1.15rem; }
.soft { color: var(--soft); }
.verdict { display: inline-block; margin: .8rem 0 0; padding: .3rem .8rem; border-radius: 99px; color: #fff;
           font-weight: 600; }
.good { background: var(--good); } .bad { background: var(--bad); }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(165px, 1fr)); gap: .7rem; margin-top: 1.3rem; }
.card { padding: .7rem .9rem; border-radius: 10px; background: var(--card); }
.card b { display: block; font-size: 1.25rem; } .card span { color: var(--soft); font-size: .85rem; }
figure { margin: 0; overflow-x: auto; } img { max-width: 100%; border: 1px solid var(--line); border-radius: 10px; }
.table { overflow-x: auto; } table { width: 100%; border-collapse: collapse; font-size: .88rem; }
th, td { padding: .3rem .6rem; border-bottom: 1px solid var(--line); text-align: left; vertical-align: top; }
th { color: var(--soft); font-weight: 500; } td.number, th.number { text-align: right; white-space: nowrap;
     font-variant-numeric: tabular-nums; }
.warning td { color: var(--bad); }
ul.broken { color: var(--bad); }
details summary { cursor: pointer; color: var(--soft); }
pre { overflow-x: auto; padding: .9rem; border-radius: 10px; background: var(--card); font-size: .8rem; }
"""


def write_report(folder: Path, log: FlightLog, summary: dict[str, Any], mission: dict[str, Any]) -> Path:
    """Write the report of a flight into its folder.

    Args:
        folder: Its folder; `flight.png` and `plan.png` there go into the report.
        log: What was flown.
        summary: What it came to.
        mission: The resolved mission.

    Returns:
        The file.
    """
    path = folder / REPORT_NAME
    path.write_text(report_html(folder, log, summary, mission), encoding="utf-8")
    return path


def report_html(folder: Path, log: FlightLog, summary: dict[str, Any], mission: dict[str, Any]) -> str:
    """The report as text."""
    name = _text(log.header.get("name", "flight"))
    started = _text(log.header.get("started", ""))
    parts = [
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{name}</title>',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<style>{_STYLE}</style></head><body>",
        f'<h1>{name}</h1><div class="soft">{started} · link {_text(log.header.get("link", ""))} · '
        f"{_text(log.header.get('mode', ''))}</div>",
        _verdict(summary),
        _cards(summary),
    ]
    for file, heading in (("flight.png", "The flight"), ("plan.png", "The plan it began with")):
        if (folder / file).is_file():
            parts.append(f"<h2>{heading}</h2>{_picture(folder / file, heading)}")
    parts += [_replans(log), _events(log)]
    resolved = _text(json.dumps(mission, indent=1))
    parts.append(
        f"<h2>The mission</h2><details><summary>every entry, resolved</summary><pre>{resolved}</pre></details>"
    )
    parts.append("</body></html>")
    return "\n".join(parts)


def _verdict(summary: dict[str, Any]) -> str:
    broken = summary.get("violations", [])
    good = summary.get("outcome") == "explored and landed" and not broken
    text = f'<div class="verdict {"good" if good else "bad"}">{_text(summary.get("outcome", "not finished"))}</div>'
    if broken:
        text += '<ul class="broken">' + "".join(f"<li>{_text(line)}</li>" for line in broken) + "</ul>"
    return text


def _cards(summary: dict[str, Any]) -> str:
    def number(key: str, unit: str, digits: int, scale: float = 1.0) -> str:
        value = summary.get(key)
        return "–" if value is None else f"{value * scale:.{digits}f}{unit}"

    searched = summary.get("probability_found") is not None
    cards = (
        (duration(summary["flown_s"]), "in the air"),
        (distance(summary["length_m"]), "flown"),
        (number("min_clearance_m", " m", 2), clearance_words(summary)),
        (number("max_speed_mps", " m/s", 1), "greatest speed"),
        (number("tracking_error_mean_m", " m", 2), "from the course, mean"),
        (number("tracking_error_max_m", " m", 2), "from the course, at most"),
        (number("ergodic_metric", "", 5), "ergodic metric flown"),
        *([(number("probability_found", "", 3), "probability of having found it")] if searched else []),
        (wind_words(summary), "wind, mean"),
        (drag_words(summary), "drag"),
        (number("battery_used", " %", 0, 100.0), "of the battery used"),
        (f"{summary.get('replans_taken', 0)} / {summary.get('replans_asked', 0)}", "replans taken / asked"),
        (number("setpoint_gap_max_s", " ms", 0, 1000.0), "longest gap of setpoints"),
    )
    return (
        '<div class="cards">'
        + "".join(f'<div class="card"><b>{value}</b><span>{label}</span></div>' for value, label in cards)
        + "</div>"
    )


def _picture(path: Path, alternative: str) -> str:
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return f'<figure><img alt="{_text(alternative)}" src="data:image/png;base64,{data}"></figure>'


def _replans(log: FlightLog) -> str:
    rows = []
    for event in log.of_kind("replan"):
        rows.append(
            (
                f"{event['t']:.1f}",
                str(event["number"]),
                f"{event['switch_s']:.1f}",
                f"{event['solve_s']:.2f}",
                _figure(event["objective"]),
                _figure(event["staying_objective"]),
                "taken" if event["taken"] else "not taken",
                event["reason"],
            )
        )
    if not rows:
        return ""
    heads = (
        "flight clock [s]",
        "replan",
        "takes over [s]",
        "solve [s]",
        "objective",
        "objective if nothing changed",
        "",
        "why",
    )
    return "<h2>Replans</h2>" + _table(heads, rows, numbers=6)


def _events(log: FlightLog) -> str:
    # Answers are written when they arrive, with the time they are about.
    told = sorted((event for event in log.events if event["kind"] in _SHOWN), key=lambda event: event["t"])
    chatter = Chatter()
    shown = [
        event
        for event in told
        if event["kind"] != "say" or not chatter.repeats(event["text"], event["t"]) or event["warning"]
    ]
    rows = [(f"{event['t']:.1f}", words_of(event)) for event in shown[:_MOST_EVENTS]]
    warnings = {index for index, event in enumerate(shown) if event.get("warning")}
    more = f'<p class="soft">… and {len(shown) - _MOST_EVENTS} more in the log</p>' if len(shown) > _MOST_EVENTS else ""
    return "<h2>What happened</h2>" + _table(("flight clock [s]", "event"), rows, numbers=1, warnings=warnings) + more


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]], numbers: int, warnings: Iterable[int] = ()) -> str:
    """A table whose first columns hold numbers."""
    warned = set(warnings)

    def cell(tag: str, index: int, value: str) -> str:
        return f"<{tag}{' class=number' if index < numbers else ''}>{_text(value)}</{tag}>"

    head = "".join(cell("th", index, value) for index, value in enumerate(heads))
    body = "".join(
        f"<tr{' class=warning' if line in warned else ''}>"
        + "".join(cell("td", index, value) for index, value in enumerate(row))
        + "</tr>"
        for line, row in enumerate(rows)
    )
    return f'<div class="table"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def _figure(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"


def _text(value: object) -> str:
    return html.escape(str(value))
