/** What happened when, and how far back the history reaches. Times are ROS seconds. */
import type { Timeline as WireTimeline } from '../contract/types';
import { LOCALE } from '../strings';
import { clockText, minuteText } from './format';
import { countText, dayFormat, type Span } from './time';

/** Without empty buckets; a run is from each start of the twin's clock to the next, as it may begin anew. */
export interface Timeline extends WireTimeline {
  readonly missing: readonly Missing[];
}

/** `nowS`: the twin's time of the answer, ROS seconds. */
export const timelineOf = (wire: WireTimeline, nowS: number): Timeline => ({
  ...wire,
  missing: missingOf(wire, nowS),
});

/** A span in which data may have been received that the answer lacks; not a silence. */
export interface Missing extends Span {
  readonly why: 'not_kept' | 'not_recorded';
}

/** The twin reports its journal's progress once a second. */
const SLACK_S = 5;

/** `nowS` is the twin's time of the answer: nothing is missing after it. */
export function missingOf(
  wire: Pick<WireTimeline, 'from' | 'to' | 'complete_to' | 'kept_from'>,
  nowS: number,
): readonly Missing[] {
  const [from, to] = [wire.from, Math.min(wire.to, nowS)];
  const missing: Missing[] = [];
  if (wire.kept_from !== null) missing.push({ from, to: wire.kept_from, why: 'not_kept' });
  const complete = wire.complete_to;
  if (complete !== null && to - complete > SLACK_S) {
    missing.push({ from: Math.max(from, complete), to, why: 'not_recorded' });
  }
  return missing.filter((stretch) => stretch.to > stretch.from);
}

export interface Tick {
  /** ROS seconds. */
  readonly at: number;
  /** The time, and below it the date, if first or changed. */
  readonly text: string;
}

const MINUTE = 60;
const HOUR = 3_600;
const DAY = 86_400;
const STEPS = [
  ...[1, 2, 5, 10, 15, 30],
  ...[1, 2, 5, 10, 15, 30].map((minutes) => minutes * MINUTE),
  ...[1, 2, 3, 6, 12].map((hours) => hours * HOUR),
  ...[1, 2, 7, 14].map((days) => days * DAY),
  ...[1, 2, 3, 6, 12].map((months) => months * 30 * DAY),
];
const LONGEST = 365 * DAY;

/** The shortest round step, in seconds, of which at most `most` fit into the span. */
export function tickStep({ from, to }: Span, most: number): number {
  const fit = STEPS.find((step) => (to - from) / step <= Math.max(1, most));
  return fit ?? Math.ceil((to - from) / Math.max(1, most) / LONGEST) * LONGEST;
}

/**
 * At most about `most` ticks. A simulated clock counts from its own beginning and has no dates.
 */
export function timeTicks(span: Span, most: number, isSimulated: boolean): readonly Tick[] {
  const step = tickStep(span, most);
  const times = isSimulated ? evenTimes(span, step) : clockTimes(span, step);
  let before = '';
  return times.map((at) => {
    if (isSimulated) {
      return { at, text: countText(Math.round(at)).slice(0, step < MINUTE ? undefined : -3) };
    }
    const date = new Date(at * 1000);
    const below = step < DAY ? dayFormat.format(date) : String(date.getFullYear());
    const text = tickText(date, step);
    const isNew = below !== before;
    before = below;
    return { at, text: isNew ? `${text}\n${below}` : text };
  });
}

function evenTimes({ from, to }: Span, step: number): number[] {
  const times: number[] = [];
  for (let at = Math.ceil(from / step) * step; at <= to; at += step) times.push(at);
  return times;
}

/** Times on the operator's own clock; twice a year they are an hour closer or further apart. */
function clockTimes({ from, to }: Span, step: number): number[] {
  const times: number[] = [];
  const day = new Date(from * 1000);
  day.setHours(0, 0, 0, 0);
  if (step >= 30 * DAY) day.setMonth(0, 1);
  // Weeks begin on Mondays; other multiples of days are counted from a fixed day.
  else if (step >= DAY) day.setDate(day.getDate() - (daysOf(day) % Math.round(step / DAY)));
  while (day.getTime() / 1000 <= to) {
    const begin = day.getTime() / 1000;
    if (step >= 30 * DAY) day.setMonth(day.getMonth() + Math.round(step / (30 * DAY)));
    else day.setDate(day.getDate() + Math.max(1, Math.round(step / DAY)));
    // If daylight saving begins at midnight, that day begins at one, but the next does not.
    day.setHours(0, 0, 0, 0);
    if (step >= DAY) {
      if (begin >= from) times.push(begin);
      continue;
    }
    const end = Math.min(day.getTime() / 1000, to + 1e-6);
    const first = begin + Math.max(0, Math.ceil((from - begin) / step)) * step;
    for (let at = first; at < end; at += step) times.push(at);
  }
  return times;
}

/** Calendar days since a Monday in the past. */
const daysOf = (day: Date): number =>
  Math.round(Date.UTC(day.getFullYear(), day.getMonth(), day.getDate()) / 1000 / DAY) + 3;

const monthFormat = new Intl.DateTimeFormat(LOCALE, { month: 'short' });

function tickText(date: Date, step: number): string {
  if (step >= DAY) return (step >= 30 * DAY ? monthFormat : dayFormat).format(date);
  return (step < MINUTE ? clockText : minuteText)(date.getTime());
}
