"""The shift report on paper: one page of HTML for A4, without scripts or external content.

Its words by language are in `report_words.json`, its style in `report.css`, the names of sensors in
the sensors file.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, tzinfo
from functools import cache, partial
from html import escape
from importlib.resources import files
from operator import itemgetter
from typing import Any, Final

import orjson

from lupin_bridge.judge.episodes import SITE
from lupin_bridge.judge.judging import Criteria, unix_s
from lupin_bridge.past.plans import Plan, of_content
from lupin_bridge.past.report import Report
from lupin_bridge.serving.admission import content_answer
from lupin_bridge.stream.state_json import by_cause, cause_of
from lupin_twin.core.diagnostics import Origin

_POLICY: Final = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src 'self'; font-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
# Decimal comma and thousands point, in all languages but English.
_COMMA: Final = str.maketrans(".,", ",.")
_EXTREMES: Final = ("sensor", "low*", "where", "mean*", "high*", "where", "count*", "bad*")
# More tags than this that share a cause and an area are below one heading, as on the page.
MOST_LOOSE: Final = 4
Words = Mapping[str, Any]
# An entry of a list in the body.
Entry = Mapping[str, Any]


@cache
def _file(name: str) -> str:
    return files("lupin_bridge.past").joinpath(name).read_text(encoding="utf-8")


@cache
def _words() -> Mapping[str, Words]:
    found: Mapping[str, Words] = orjson.loads(_file("report_words.json"))
    return found


def languages() -> Collection[str]:
    """The languages of the report."""
    return _words().keys()


@dataclass(frozen=True, slots=True)
class ReportPage(Report):
    """The report as a page in the language `lang`; times are in `zone`; None: the greenhouse's.

    `origin` is where observations come from; `site` is the greenhouse's name, if it has one.
    """

    lang: str = "en"
    zone: tzinfo | None = None
    origin: Origin = "unknown"
    site: str = ""

    def plan(self, body: dict[str, Any]) -> Plan:
        """See `Report`."""
        page = PageText(self.lang, self.criteria, self.zone).page(body, self.origin, self.site)
        written = page.encode("utf-8", "replace")
        headers = {**self._headers(), "Content-Security-Policy": _POLICY}
        return of_content(content_answer(written, "text/html; charset=utf-8", headers))


class PageText:
    """The texts of a report in a language; `words` are those of `report_words.json`."""

    def __init__(self, lang: str, criteria: Criteria, zone: tzinfo | None = None) -> None:
        self._lang = lang
        self._zone = zone or criteria.clock.zone
        self.words = _words()[lang]
        self._criteria = criteria
        self._day = ""

    def page(self, body: Entry, origin: Origin, site: str) -> str:
        """The whole page, of the body of a report."""
        say, at = self.say, self._at
        # Rows omit the date of the first day.
        day, comma, _ = at(body["from"]).rpartition(", ")
        self._day = f"{day}{comma}"
        period = say("period", **{"from": at(body["from"]), "to": self._clock(body["to"])})
        heading = f"{say('title')}: {site}" if site else say("title")
        hint = self.words["hints"].get(origin)
        known = [
            say(word, at=at(body[name]))
            for word, name in (("kept", "kept_from"), ("complete", "complete_to"))
            # If the log begins before the period, `kept_from` equals `from`.
            if body[name] is not None and (name != "kept_from" or body[name] != body["from"])
        ]
        if body["kept_from"] == body["to"]:
            known = [say("nothing_kept")]
        parts = [
            f'<!doctype html><html lang="{self._lang}"><head><meta charset="utf-8">',
            '<meta name="viewport" content="width=device-width">',
            '<link rel="icon" href="../lupin.svg">',
            f"<title>{escape(f'{heading}, {period}')}</title>",
            f"<style>{_file('report.css')}</style></head><body>",
            f'<h1><img src="../lupin.svg" alt=""> {escape(heading)}</h1>',
            f"<p><strong>{escape(hint)}</strong></p>" if hint else "",
            f"<p>{escape(period)}. ",
            f"{escape(say('zone', zone=self._zone_name(body['from'], body['to'])))}</p>",
            f'<p class="note">{escape(" ".join(known) or say("unknown"))}</p>',
            self._counts(body["counts"]),
            self._alarms(body),
            self._table(body, "extremes", "sensors", _EXTREMES, self._sensor),
            self._table(
                body, "notes", "notes", ("time", "name", "said", "about"), self._note(body)
            ),
            self._table(body, "silences", "silences", ("from", "to", "length"), self._silence),
            f"<h2>{escape(say('never'))}</h2><p>",
            escape(", ".join(body["never_scanned"]) or say("none")),
            f"</p>{self._more(body, 'never_scanned')}</body></html>",
        ]
        return "".join(parts)

    def _counts(self, counts: Mapping[str, int]) -> str:
        whole = counts["tags"]
        part = counts["tags_scanned"]
        share = 100 * part // whole if whole else 0  # 100 % only if it is all
        names = ("raised", "cleared", "active", "critical", "scans", "failed", "inspections")
        shown = {name: self._count(counts[name]) for name in names}
        shown["scanned"] = self.say(
            "of", part=self._count(part), whole=self._count(whole), share=share
        )
        cells = (
            f"<div><dt>{escape(self.say(name))}</dt><dd>{escape(text)}</dd></div>"
            for name, text in shown.items()
        )
        return f"<dl>{''.join(cells)}</dl>"

    def _alarms(self, body: Entry) -> str:
        later = ""
        if body["alarms_from"] != body["from"]:
            later = f"<p>{escape(self.say('later', at=self._at(body['alarms_from'])))}</p>"
        active = [alarm for alarm in body["alarms"] if alarm["cleared_at"] is None]
        cleared = [alarm for alarm in body["alarms"] if alarm["cleared_at"] is not None]
        return (
            later
            + self._of_alarms("active_alarms", active, ("when", "worst*"))
            + self._of_alarms("cleared", cleared, ("when", "end", "length", "worst*"))
            + self._more(body, "alarms")
        )

    def _of_alarms(self, title: str, alarms: Sequence[Entry], columns: Sequence[str]) -> str:
        """A row for each cause at a tag, below a heading if many of an area share it."""
        names = ("alarm", "point", *columns)
        if any(self._who(alarm) for alarm in alarms):
            names = (*names, "who")
        rows: dict[tuple[str, str], list[Entry]] = {}
        for entry in by_cause(alarms):
            area = self._criteria.sensors.area_of(entry["tag_id"])
            rows.setdefault((cause_of(entry), area), []).append(entry)
        groups: dict[str, list[Entry]] = {}
        for (_, area), own in rows.items():
            cause = self._cause(own) if len(own) > MOST_LOOSE else ""
            text = " · ".join(filter(None, (area, cause)))
            heading = f"{text}: {self._count(len(own))}" if cause else ""
            groups.setdefault(heading, []).extend(self._alarm(entry, cause) for entry in own)

        def cells(row: Entry) -> Iterable[str]:
            return [row[name.removesuffix("*")] for name in names]

        return self._list(title, "alarms", groups, names, cells)

    def _who(self, alarm: Entry) -> str:
        """Who has acknowledged or shelved an alarm."""
        return "; ".join(
            self.say(word, name=alarm[f"{word}_by"], at=self._clock(alarm[f"{word}_{when}"]))
            for word, when in (("acknowledged", "at"), ("shelved", "until"))
            if f"{word}_by" in alarm
        )

    def _alarm(self, entry: Entry, heading: str) -> Entry:
        """The cells of a row, by their columns; its status is that of its worst value.

        Below a heading, it has its tag where others have their cause.
        """
        reason, own = entry["reason"], [entry, *entry["also"]]
        sensor, limit = reason["sensor"], reason["limit"]
        verdict = self.words["verdicts"][reason["verdict"]]
        mine = [it for it in own if it["reason"]["sensor"] == sensor]
        values = [it["worst"] for it in mine if it["worst"] is not None]
        value = max(values, key=lambda it: abs(it - (limit or 0.0)), default=None)
        worst = self._number(value, sensor, limit)
        ends = [it["cleared_at"] for it in own if it["cleared_at"]]
        lasted_s = last_s = 0
        for from_s, to_s in sorted(
            (it["raised_at"]["sec"], it["cleared_at"]["sec"]) for it in own if ends
        ):
            lasted_s += max(0, to_s - max(from_s, last_s))
            last_s = max(to_s, last_s)
        cause, times = self._cause([entry]), f" ({len(mine)}×)" if len(mine) > 1 else ""
        worst = f"{worst} ({verdict})" if worst else verdict
        if (heading or cause) != self._what(reason):
            worst = f"{self._label(sensor)} {worst}"
        return {
            "reason": reason,
            "alarm": f"{self._where(entry['tag_id']) if heading else cause}{times}",
            "point": "" if heading else entry["tag_id"] or self.say("house"),
            "when": self._clock(min((it["raised_at"] for it in own), key=itemgetter("sec"))),
            "end": self._clock(max(ends, key=itemgetter("sec"))) if ends else "",
            "length": self._length(lasted_s) if ends else "",
            "worst": worst,
            "who": "; ".join(dict.fromkeys(filter(None, map(self._who, own)))),
        }

    def _sensor(self, of: Entry) -> Iterable[str]:
        number = partial(self._number, sensor=of["sensor_type"])

        def extreme(found: Entry | None) -> Iterable[str]:
            if found is None:
                return ("", "")
            return number(found["value"]), f"{found['tag_id']}, {self._clock(found['stamp'])}"

        return (
            self._label(of["sensor_type"]),
            *extreme(of["low"]),
            number(of["mean"]),
            *extreme(of["high"]),
            self._count(of["n"]),
            self._count(of["failed"]),
        )

    def _note(self, body: Entry) -> Callable[[Entry], Iterable[str]]:
        alarms = {f"alarm:{alarm['id']}": alarm for alarm in body["alarms"]}

        def cells(note: Entry) -> Iterable[str]:
            subject, gone = note["subject"], note["withdrawn_by"]
            kind, _, name = subject.partition(":")
            if subject in alarms:
                alarm = alarms[subject]
                about = f"{self._what(alarm['reason'])}, {self._where(alarm['tag_id'])}"
            else:
                about = self.say("alarm") if kind == "alarm" else self._where(name)
            said = self.words["kinds"].get(note["kind"], note["kind"]), note["text"]
            text = ": ".join(it for it in said if it)
            text += f" ({self.say('withdrawn', name=gone)})" if gone else ""
            return self._clock(note["made_at"]), note["by"], text, about

        return cells

    def _silence(self, silence: Entry) -> Iterable[str]:
        length = self._length(silence["to"]["sec"] - silence["from"]["sec"])
        from_, to = self._clock(silence["from"]), self._clock(silence["to"])
        return from_, to, length

    def _table(
        self,
        body: Entry,
        title: str,
        name: str,
        columns: Sequence[str],
        cells: Callable[[Entry], Iterable[str]],
    ) -> str:
        """A table of one list of the body, and how many entries are left out."""
        return self._list(title, name, {"": body[name]}, columns, cells) + self._more(body, name)

    def _list(
        self,
        title: str,
        name: str,
        groups: Mapping[str, Sequence[Entry]],
        columns: Sequence[str],
        cells: Callable[[Entry], Iterable[str]],
    ) -> str:
        """A table of entries by heading, "" for none; a column ending with `*` has numbers.

        Below a heading, the first cell takes the room of the second, which is empty.
        """
        kinds = [' class="number"' if column.endswith("*") else "" for column in columns]
        head = f"<h2>{escape(self.say(title))}</h2>"
        if not any(groups.values()):
            return f"{head}<p>{escape(self.say('none'))}</p>"
        names = "".join(
            f'<th scope="col"{kind}>{escape(self.say(column.removesuffix("*")))}</th>'
            for column, kind in zip(columns, kinds, strict=True)
        )
        rows = ""
        for heading, entries in groups.items():
            rows += "<tbody>"
            if heading:
                rows += f'<tr><th colspan="{len(columns)}">{escape(heading)}</th></tr>'
            for entry in entries:
                is_critical = entry.get("reason", {}).get("verdict") == "critical"
                rows += '<tr class="critical">' if is_critical else "<tr>"
                first, *others = zip(cells(entry), kinds, strict=True)
                rows += '<td colspan="2">' if heading else "<td>"
                rows += f"{escape(first[0])}</td>"
                for cell, kind in others[bool(heading) :]:
                    rows += f"<td{kind}>{escape(cell)}</td>"
                rows += "</tr>"
            rows += "</tbody>"
        return f'{head}<table class="{name}"><thead><tr>{names}</tr></thead>{rows}</table>'

    def _more(self, body: Entry, name: str) -> str:
        count = body["left_out"][name]
        more = self.say("more", count=self._count(count))
        return f'<p class="note">{escape(more)}</p>' if count else ""

    # --- words ------------------------------------------------------------------------------------

    def alarm(self, entry: Entry) -> str:
        """A cause at a tag on one line."""
        verdict = self.words["verdicts"][entry["reason"]["verdict"]]
        return f"{self._where(entry['tag_id'])}: {self._cause([entry])} ({verdict})"

    def say(self, word: str, **filled: object) -> str:
        """A text, its places filled."""
        text: str = self.words[word]
        for name, value in filled.items():
            text = text.replace(f"{{{name}}}", str(value))
        return text

    def _cause(self, rows: Sequence[Entry]) -> str:
        """What is wrong; damp or dry air, if several sensors tell of it."""
        sensors = {it["reason"]["sensor"] for row in rows for it in (row, *row["also"])}
        air: Words = self.words["air"]
        return self._what(rows[0]["reason"]) if len(sensors) == 1 else air[cause_of(rows[0])]

    def _what(self, reason: Entry) -> str:
        kind, sensor, value, limit = (reason[it] for it in ("kind", "sensor", "value", "limit"))
        if kind == "range" and value is not None and limit is not None:
            kind = "low" if value < limit else "high"
        elif kind == "old" and sensor:
            kind = "old_sensor"
        text: str = self.words["reasons"].get(kind, kind)
        return text.replace("{sensor}", self._label(sensor))

    def _label(self, sensor: str) -> str:
        found = self._criteria.sensors.named(sensor)
        own = (text for language, text in found.labels.items() if language == self._lang)
        return next(own, found.label)

    def _where(self, tag_id: str) -> str:
        return self.say("house") if tag_id in (SITE, "site") else self.say("tag", name=tag_id)

    def _at(self, when: Mapping[str, int]) -> str:
        """A moment as the page writes it; in a simulation, the time since its beginning."""
        sec = when["sec"]
        wall_s = unix_s(sec * 1_000_000_000)
        if wall_s is None:
            return f"sim {sec // 3600:02}:{sec // 60 % 60:02}"
        at = datetime.fromtimestamp(wall_s, self._zone)
        month = self.words["months"][at.month - 1]
        return self.say("date", day=at.day, month=month, year=at.year, clock=f"{at:%H:%M}")

    def _clock(self, when: Mapping[str, int]) -> str:
        """A moment in a row: without the date on the report's first day, and never with a year."""
        return re.sub("\u00a0\\d{4},", ",", self._at(when).removeprefix(self._day))

    def _number(self, value: float | None, sensor: str, limit: float | None = None) -> str:
        """A value as the page writes it; if it rounds to its limit, with the side that it is on."""
        if value is None:
            return ""
        known = self._criteria.sensors
        # Without a sensor, it is a number of bugs.
        number = known.text_of(sensor, value) if sensor else f"{value:.0f}"
        text = f"{self._written(number)}\u00a0{known.named(sensor).unit}".strip() if number else ""
        if limit is None or value == limit or text != self._number(limit, sensor):
            return text
        return self.say("just_below" if value < limit else "just_above", limit=text)

    def _count(self, count: int) -> str:
        return self._written(f"{count:,}")

    def _written(self, digits: str) -> str:
        """A number's text as the page writes it in this language."""
        if self._lang == "es" and len(digits.lstrip("-").partition(".")[0]) == len("1,000"):
            digits = digits.replace(",", "")
        if self._lang != "en":
            digits = digits.translate(_COMMA)
        return digits.replace("-", "\u2212")

    def _length(self, seconds: int) -> str:
        """A length of time in at most its two largest units, as the page writes it."""
        days, hours, minutes = seconds // 86_400, seconds // 3600 % 24, seconds // 60 % 60
        texts = (
            f"{days}\u00a0d" if days else "",
            f"{hours}\u00a0{self.say('hours')}" if hours else "",
            f"{minutes}\u00a0min" if minutes and not days else "",
        )
        return " ".join(filter(None, texts)) or f"{seconds}\u00a0s"

    def _zone_name(self, *moments: Mapping[str, int]) -> str:
        zone = self._zone
        offsets = {
            f"UTC{datetime.fromtimestamp(wall_s, zone).astimezone(zone).isoformat()[-6:]}"
            for when in moments
            if (wall_s := unix_s(when["sec"] * 1_000_000_000)) is not None
        }
        name = self.say("this_machine") if zone is None else str(zone)
        return f"{name} ({', '.join(sorted(offsets))})" if offsets else name
