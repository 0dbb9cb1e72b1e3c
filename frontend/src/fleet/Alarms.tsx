/** Active alarms of the shown greenhouses, the worst first. */
import { useMemo, type JSX } from 'react';

import { type Now, valuesOf, whenText, whereText } from '../alarms/words';
import { timeOfDay } from '../clock';
import type { Alarm } from '../contract/types';
import { changeOf, hourText, type Taken } from '../domain/difference';
import type { Catalogue } from '../domain/sensors';
import { LANGUAGE, S } from '../strings';
import { HealthMark } from '../ui/HealthMark';
import { Trend } from '../ui/Trend';
import { VIEW_WORDS } from '../words/fleetViews';
import { alarmCount, namesOf, type Site, siteLink, timeText, words } from './sites';
import { useAnswer, useSensors } from './useAnswer';

interface SiteAlarm extends Alarm {
  readonly site: string;
  readonly name: string;
  readonly is_live: boolean;
  /** null: it has no value, or that is not known. */
  readonly now: Reported | null;
  /** The same an hour of that greenhouse before, and how long that is, seconds. */
  readonly hour_ago?: Reported | null;
  readonly hour_s?: number;
}

type Reported = Omit<Extract<Now, { kind: 'known' }>, 'kind' | 'trend'> &
  Pick<Taken, 'observed_at'>;

const W = VIEW_WORDS[LANGUAGE];

const EVERY_MS = 10_000;

export default function Alarms({ shown }: { shown: readonly Site[] }): JSX.Element {
  const sensors = useSensors();
  const names = namesOf(shown);
  const path = names === '' ? 'api/alarms' : `api/alarms?sites=${names}`;
  // Refetch when a count changes.
  const news = shown.map((site) => `${site.site} ${site.active_alarms ?? 0}`).join();
  const { value, message } = useAnswer<{ alarms: readonly SiteAlarm[] }>(
    path,
    ['alarms'],
    EVERY_MS,
    news,
  );
  const rows = useMemo(() => {
    const sites = new Set(shown.map(({ site }) => site));
    return value?.alarms.filter(({ site }) => sites.has(site)) ?? [];
  }, [value, shown]);
  const active = rows.filter(({ shelved_by: by }) => by === undefined);
  const shelved = rows.filter(({ shelved_by: by }) => by !== undefined);
  const all = alarmCount(shown);
  const isRead = shown.every((site) => site.active_alarms !== null);
  const listOf = (alarms: readonly SiteAlarm[]): JSX.Element => (
    <ul className="fleet-alarm-list">
      {alarms.map((alarm) => (
        <Row key={`${alarm.site} ${alarm.id}`} alarm={alarm} sensors={sensors} />
      ))}
    </ul>
  );
  return (
    <>
      {message && <p className="fleet-note">{W.notFetched(message)}</p>}
      {all === 0 && (
        <p className="fleet-empty">{isRead ? words.noAlarms : words.alarmsBeingRead}</p>
      )}
      {listOf(active)}
      {value && active.length < all && (
        <p className="fleet-note">{W.moreAlarms(all - active.length)}</p>
      )}
      {shelved.length > 0 && (
        <details className="fleet-group">
          <summary>{S.alarmGroups.shelved(String(shelved.length))}</summary>
          {listOf(shelved)}
        </details>
      )}
    </>
  );
}

function Row({ alarm, sensors }: { alarm: SiteAlarm; sensors: Catalogue }): JSX.Element {
  const state = alarm.is_live && alarm.now ? alarm.now : null;
  const trend = state && trendOf(state, alarm.hour_ago);
  const values = valuesOf(alarm, sensors, state && { kind: 'known', trend, ...state });
  const { verdict } = alarm.now ?? alarm.reason;
  return (
    <li data-live={alarm.is_live} data-shelved={Boolean(alarm.shelved_by)}>
      <a href={linkOf(alarm)}>
        <HealthMark verdict={verdict} text={verdict === 'healthy' ? S.alarmBack : undefined} />
        <strong className="fleet-alarm-site">{alarm.name}</strong>
        <span>{whereText(alarm)}</span>
        <span className="fleet-alarm-what">{values.what}</span>
        <span className="fleet-alarm-what">
          {values.now}{' '}
          {trend !== null && (
            <Trend
              sensor={sensors.named(alarm.reason.sensor)}
              by={trend}
              hour={hourText(alarm.hour_s ?? 3_600)}
            />
          )}
          {values.worst !== null && (
            <span className="fleet-line">
              {values.now !== null && <HealthMark verdict={alarm.reason.verdict} word={false} />}
              {values.worst}
            </span>
          )}
        </span>
        <span className="fleet-line">
          {S.alarmSince(whenText(alarm.raised_at, timeOfDay() / 1000))}
          {!alarm.is_live && ` (${W.wasLive})`}
          {saidOf(alarm).map((said) => (
            <span key={said} className="fleet-alarm-status">
              {said}
            </span>
          ))}
        </span>
      </a>
    </li>
  );
}

function trendOf(now: Reported, then?: Reported | null): number | null {
  const [value, before] = [now.value, then?.value ?? null];
  if (value === null || before === null) return null;
  const change = changeOf(
    { value, observed_at: now.observed_at },
    { value: before, observed_at: then?.observed_at ?? null },
  );
  return change.kind === 'by' ? change.by : null;
}

function saidOf(alarm: SiteAlarm): readonly string[] {
  const { acknowledged_by: by, acknowledged_at: at, shelved_by: who, shelved_until: until } = alarm;
  return [
    ...(by && at != null ? [S.alarmAcknowledgedBy(by, timeText(at))] : []),
    ...(who && until != null
      ? [S.alarmShelved(timeText(until), alarm.shelved_reason ?? '', who)]
      : []),
  ];
}

function linkOf(alarm: SiteAlarm): string {
  // Rounded up, to include the observation.
  const parts = new URLSearchParams({ at: String(Math.ceil(alarm.raised_at * 1000) / 1000) });
  if (alarm.tag_id) parts.set('tag', alarm.tag_id);
  return `${siteLink(alarm)}#${parts.toString()}`;
}
