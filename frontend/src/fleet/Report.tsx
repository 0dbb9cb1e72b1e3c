/** What happened at the shown greenhouses: a row for each, and people's notes. */
import { useState, type JSX } from 'react';

import { timeOfDay, timeZone } from '../clock';
import type { Note } from '../contract/types';
import { numberText } from '../domain/format';
import { shown as shownText } from '../domain/text';
import { LANGUAGE, S } from '../strings';
import { VIEW_WORDS } from '../words/fleetViews';
import { Choice } from './Choice';
import { namesOf, type Site, timeText, words } from './sites';
import { useAnswer } from './useAnswer';

const W = VIEW_WORDS[LANGUAGE];

const HOURS = [12, 24] as const;
const EVERY_MS = 60_000;

const COUNTED = ['scans', 'failed', 'inspections', 'notes'] as const;

interface SiteReport extends Readonly<Record<(typeof COUNTED)[number], number>> {
  readonly site: string;
  readonly name: string;
  readonly active_alarms: number | null;
  /** null: it has never sent anything. */
  readonly complete_to: number | null;
  readonly report: string;
}

interface SiteNote extends Note {
  readonly site: string;
  readonly name: string;
}

export default function Report({ shown }: { shown: readonly Site[] }): JSX.Element {
  const [hours, setHours] = useState<(typeof HOURS)[number]>(HOURS[0]);
  const names = namesOf(shown);
  const from = (Math.floor(timeOfDay() / 3_600_000) - hours) * 3600;
  const path = `api/report?from=${from}${names === '' ? '' : `&sites=${names}`}`;
  const { value, message } = useAnswer<{
    sites: readonly SiteReport[];
    notes: readonly SiteNote[];
  }>(path, ['sites', 'notes'], EVERY_MS);
  const found = new Map(value?.sites.map((each) => [each.site, each]));
  const sites = new Set(shown.map(({ site }) => site));
  const notes = value?.notes.filter(({ site }) => sites.has(site)) ?? [];
  return (
    <section className="fleet-compare" aria-label={S.report}>
      <div className="fleet-head">
        <Choice
          label={S.timebarPeriod}
          options={HOURS}
          value={hours}
          onChange={setHours}
          text={W.hours}
        />
      </div>
      {message && <p className="fleet-note">{W.notFetched(message)}</p>}
      {!value && !message && <p className="fleet-empty">{S.chartLoading}</p>}
      {value && (
        <div className="fleet-report">
          <p className="fleet-note">{W.wholeHours}</p>
          <table className="fleet-table">
            <thead>
              <tr>
                <th scope="col">{words.sites}</th>
                {COUNTED.map((each) => (
                  <th key={each} scope="col">
                    {W[each]}
                  </th>
                ))}
                <th scope="col">{W.activeAlarms}</th>
                <th scope="col">{W.completeTo}</th>
              </tr>
            </thead>
            <tbody>
              {shown.map(({ site, is_live: isLive }) => {
                const row = found.get(site);
                return row && <Row key={site} row={row} isLive={isLive} />;
              })}
            </tbody>
          </table>
          {notes.length > 0 && (
            <table className="fleet-table">
              <caption className="fleet-note">{W.latestNotes}</caption>
              <tbody>
                {notes.map((note) => (
                  <NoteRow key={`${note.site} ${note.id}`} note={note} />
                ))}
              </tbody>
            </table>
          )}
        </div>
      )}
    </section>
  );
}

function NoteRow({ note }: { note: SiteNote }): JSX.Element {
  const { name, made_at: at, by, kind, subject, text, withdrawn_by: gone } = note;
  const tag = subject.startsWith('tag:') ? S.card(shownText(subject.slice(4), 24)) : '';
  const kindOf = kind === 'comment' ? '' : W.kinds[kind];
  return (
    <tr>
      <td>{timeText(at)}</td>
      <th scope="row">{name}</th>
      <td>{by}</td>
      <td className="fleet-text">
        {[tag, kindOf, text].filter(Boolean).join(': ')}
        {gone !== null && ` (${W.withdrawn(gone)})`}
      </td>
    </tr>
  );
}

/** Address of its readable report, in the reader's language and time zone. */
const pageOf = ({ report }: SiteReport): string => {
  const query = new URLSearchParams({ lang: LANGUAGE, time_zone: timeZone() });
  return `${report.replace('/api/report?', '/api/report.html?')}&${query.toString()}`;
};

function Row({ row, isLive }: { row: SiteReport; isLive: boolean }): JSX.Element {
  return (
    <tr>
      <th scope="row">
        <a href={pageOf(row)}>{row.name}</a>
      </th>
      {COUNTED.map((each) => (
        <td key={each}>{numberText(row[each], 0)}</td>
      ))}
      <td>
        {row.active_alarms ?? S.noValue}
        {!isLive && row.complete_to && ` (${W.wasLive})`}
      </td>
      <td>{row.complete_to ? timeText(row.complete_to) : S.noValue}</td>
    </tr>
  );
}
