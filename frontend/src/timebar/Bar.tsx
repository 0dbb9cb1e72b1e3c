import { type JSX, memo } from 'react';

import { hasDate } from '../domain/time';
import { type Timeline, timeTicks } from '../domain/timeline';
import { type Axis, type Column, runStarts, stretchesOf, xOf } from './axis';

/** Heights from the top, CSS pixels: pest marks, scan bars, failure bars, times. */
const MARKS_PX = 14;
const SCANS_PX = 24;
const FAILURES_PX = 8;
const TICKS_PX = 16;
export const BAR_PX = MARKS_PX + SCANS_PX + FAILURES_PX + TICKS_PX;

const BASE_PX = MARKS_PX + SCANS_PX;
const FLOOR_PX = BASE_PX + FAILURES_PX;
const MARK_WIDTH_PX = 10;
/** Room for one time, CSS pixels; and the width of one of its characters, rem. */
const TICK_ROOM_PX = 76;
const LETTER = 0.4;

/** The time bar's picture. Marks differ by shape and place, not by colour alone. */
export const Bar = memo(function Bar({
  axis,
  timeline,
  columns,
}: {
  axis: Axis;
  /** Null: not loaded yet. */
  timeline: Timeline | null;
  columns: readonly Column[];
}): JSX.Element {
  const { from, to, width } = axis;
  const unknown = timeline && [{ from, to: timeline.reach?.from ?? to }, ...timeline.missing];
  return (
    <svg className="timebar-picture" width={width} height={BAR_PX} aria-hidden="true">
      {hatching('unknown', 'M-1 1l2-2M0 6l6-6M5 7l2-2')}
      {hatching('silence', 'M-1 5l2 2M0 0l6 6M5-1l2 2')}
      {(['unknown', 'silence'] as const).map((kind) =>
        stretchesOf((kind === 'silence' ? timeline?.silences : unknown) ?? [], axis).map(
          (each, index) => (
            <rect
              key={`${kind} ${index}`}
              {...each}
              y={MARKS_PX}
              height={FLOOR_PX - MARKS_PX}
              fill={`url(#timebar-${kind})`}
              data-mark={kind}
            />
          ),
        ),
      )}
      {timesOf(axis).map(({ at, x, text, left }) => (
        <g key={at}>
          <path className="timebar-tick" d={`M${x} ${MARKS_PX}V${FLOOR_PX + 3}`} />
          {left !== null && (
            <text x={left} y={BAR_PX - 3}>
              {text}
            </text>
          )}
        </g>
      ))}
      <path className="timebar-base" d={`M0 ${BASE_PX + 0.5}H${width}`} />
      {columns.map((column) => (
        <Counts key={column.start} column={column} />
      ))}
      {marksOf(columns, width).map(({ kind, at }) =>
        kind === 'pest' ? (
          <path key={at} d={`M${at - 5} 2.5h10l-5 ${MARKS_PX - 4.5}Z`} data-mark={kind} />
        ) : (
          <circle key={at} cx={at} cy={MARKS_PX / 2} r={4} data-mark={kind} />
        ),
      )}
      {(timeline ? runStarts(timeline, axis) : []).map((x, index) => (
        <path key={index} d={`M${x} 0V${FLOOR_PX}`} data-mark="run" />
      ))}
    </svg>
  );
});

const hatching = (kind: 'unknown' | 'silence', lines: string): JSX.Element => (
  <pattern id={`timebar-${kind}`} width={6} height={6} patternUnits="userSpaceOnUse">
    <path d={lines} />
  </pattern>
);

function Counts({ column }: { column: Column }): JSX.Element {
  const scans = column.scanHeight * (SCANS_PX - 2);
  const failures = column.failureHeight && Math.max(3, column.failureHeight * (FAILURES_PX - 1));
  const { x, width } = column;
  const bar = { x, width: Math.max(1, width - 1) };
  return (
    <>
      {scans > 0 && <rect {...bar} y={BASE_PX - scans} height={scans} data-mark="scans" />}
      {/* Without a gap, so that neighbours form one low mark instead of a row of teeth. */}
      {failures > 0 && (
        <rect {...{ x, width }} y={BASE_PX + 1} height={failures} data-mark="failures" />
      )}
    </>
  );
}

/** Pest marks that fit; where two would overlap, the one that needs attention stays. */
function marksOf(columns: readonly Column[], barWidth: number) {
  const marks: { readonly kind: 'pest' | 'cleared'; readonly at: number }[] = [];
  for (const kind of ['pest', 'cleared'] as const) {
    for (const { x, width, pests_seen, pests_cleared } of columns) {
      const count = kind === 'pest' ? pests_seen : pests_cleared;
      // Not cut off at the bar's end.
      const at = Math.min(x + width / 2, barWidth - 5);
      if (count === 0 || marks.some((other) => Math.abs(other.at - at) < MARK_WIDTH_PX)) continue;
      marks.push({ kind, at });
    }
  }
  return marks;
}

/** Ticks with their text's left edge; null: no room for the text. */
function timesOf(axis: Axis) {
  const letterPx = LETTER * (parseFloat(getComputedStyle(document.documentElement).fontSize) || 16);
  let free = 0;
  return timeTicks(axis, axis.width / TICK_ROOM_PX, !hasDate(axis.to)).map((tick) => {
    const x = Math.round(xOf(axis, tick.at)) + 0.5;
    // The date goes before a day's first time, the year behind its first date.
    const parts = tick.text.split('\n');
    const text = (tick.text.includes(':') ? parts.reverse() : parts).join(' ');
    const width = text.length * letterPx;
    const left = Math.min(axis.width - width, Math.max(0, x - width / 2));
    if (left < free) return { at: tick.at, x, text, left: null };
    free = left + width + 10;
    return { at: tick.at, x, text, left };
  });
}
