import { useRef, type CSSProperties, type JSX } from 'react';

import { blocksOf, tagsText } from '../alarms/arrange';
import { timeOfDay } from '../clock';
import { minuteText } from '../domain/format';
import { byCause, isBad, isSilent, severity, todoText, type HouseHealth } from '../domain/health';
import { shown } from '../domain/text';
import { useApp } from '../store/app';
import { addressOfPage } from '../store/cycle';
import { selectCatalogue, selectHealth } from '../store/derived';
import { selectHasSnapshot } from '../store/moment';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';
import { restOf, selectIsCurrent, useSince, useUrgent, type Urgent } from './DoNow';
import { useFitting } from './fitting';
import { HealthShape } from './HealthMark';
import { Reasons, useCauseText } from './Reasons';

/** Most lines that a wall screen can hold. */
const MOST_LINES = 40;
/** Reasons shown per task. */
const MOST_REASONS = 2;

interface Line {
  readonly key: string;
  /** Null: the line is one tag's task. */
  readonly cause: string | null;
  readonly tags: readonly Urgent[];
}

/** For a wall screen: what needs attention, in the order of `useUrgent`. */
export function AttentionList(): JSX.Element {
  const urgent = useUrgent();
  const lines = useLines(urgent);
  const health = useApp(selectHealth);
  const hasSnapshot = useApp(selectHasSnapshot);
  const heading =
    urgent.length > 0
      ? isSilent(health)
        ? S.alarmsLost
        : S.attention
      : hasSnapshot
        ? noneText(health)
        : null;
  const list = useRef<HTMLUListElement>(null);
  const count = useFitting(list, lines.length);
  // A cause needs the height of two tags.
  const rows = lines.reduce((sum, { cause }) => sum + (cause === null ? 1 : 2), 0);
  const rest = restOf(
    urgent,
    lines.slice(0, count).flatMap(({ tags }) => tags),
  );
  return (
    <div className="attention">
      {heading && <h3>{heading}</h3>}
      <ul ref={list} style={{ '--rows': rows } as CSSProperties}>
        {lines.slice(0, MOST_LINES).map(({ key, ...line }, index) => (
          <Row key={key} {...line} fits={index < count} />
        ))}
      </ul>
      {rest > 0 && <p className="attention-more">{S.attentionMore(rest)}</p>}
    </div>
  );
}

/** One line per task of a tag, or per cause that more than a few share, as in the alarm list. */
function useLines(urgent: readonly Urgent[]): readonly Line[] {
  const sensors = useApp(selectCatalogue);
  const wrong = urgent.map((own) => {
    const [reason] = own.reasons;
    const id = `${own.tagId} ${reason.kind} ${reason.sensor}`;
    return { own, alarm: { id, tag_id: own.tagId, reason } };
  });
  return blocksOf(wrong, sensors).flatMap(({ key, cause, items }): Line[] =>
    cause === null
      ? items.map(({ own, alarm }) => ({ key: alarm.id, cause, tags: [own] }))
      : [{ key, cause, tags: items.map(({ own }) => own) }],
  );
}

/** Where, what is wrong and what to do; for a group: how many, the worst tag, and which tags. */
function Row({ cause, tags, fits }: Omit<Line, 'key'> & { fits: boolean }): JSX.Element {
  const badness = ({ reasons: [reason] }: Urgent): number =>
    severity({ verdict: reason.verdict, reasons: [reason] });
  const worst = tags.reduce((a, b) => (badness(b) > badness(a) ? b : a));
  const { tagId, reasons } = worst;
  const [reason] = reasons;
  const { verdict } = reason;
  const why = S.alarmWhat(
    S.card(shown(tagId, 16)),
    useCauseText(byCause(reasons)[0] ?? [], true, tagId),
  );
  const since = useSince(worst);
  const isCurrent = useApp(selectIsCurrent);
  const isOne = cause === null;
  const facts = isOne ? [since] : [why, since, tagsText(tags.map((each) => each.tagId))];
  return (
    <li data-fits={fits} {...(isOne ? { 'data-tag-id': tagId } : { 'data-cause': cause })}>
      <strong>
        {isOne && <small className="faint">{S.columns.tag}</small>}
        <bdi>{isOne ? shown(tagId, 16) : `${tags.length}\u202f×`}</bdi>
      </strong>
      <span className="attention-why">
        {isOne ? (
          <Reasons health={{ verdict, reasons }} tagId={tagId} most={MOST_REASONS} />
        ) : (
          <span>
            <HealthShape verdict={verdict} /> {cause}
          </span>
        )}
        <span className="attention-do">
          {isCurrent && <strong>{todoText(reason)}</strong>}{' '}
          <small className="faint">
            <span className="dotted">
              {facts
                .filter((fact) => fact !== null)
                .map((fact) => (
                  <span key={fact}>{fact}</span>
                ))}
            </span>
          </small>
        </span>
      </span>
    </li>
  );
}

/** Null: everything is shelved, there is no tag yet, or the greenhouse's own reason says more. */
function noneText({ verdict, reasons, counts: { unknown } }: HouseHealth): string | null {
  if (isBad(verdict) || reasons.length > 0) return null;
  // A tag without data may need attention.
  if (unknown > 0) return S.attentionNoneKnown(unknown);
  return verdict === 'healthy' ? S.attentionNone : null;
}

/** In a wall screen's header: the time, and how to leave. */
export function KioskNote(): JSX.Element {
  const time = useTicking(() => minuteText(timeOfDay()));
  return (
    <div className="kiosk-note" data-testid="kiosk-note">
      <button type="button" className="text-button" onClick={closeKiosk}>
        {S.kioskLeave} <kbd>Esc</kbd>
      </button>
      <time className="kiosk-clock">{time}</time>
    </div>
  );
}

/** Opens the same view with controls; the browser's Back returns to the wall screen. */
function closeKiosk(): void {
  const { search, hash } = window.location;
  window.location.assign(addressOfPage(search, hash));
}

/** Handles Esc, the key that `KioskNote` names. */
export function startKioskClose(): void {
  document.addEventListener('keydown', (event) => {
    if (event.key === 'Escape' && !event.defaultPrevented) closeKiosk();
  });
}
