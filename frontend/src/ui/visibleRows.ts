/** Windowing of a long table: renders the rows in view, some around them, and a few others. */
import { useEffect, useMemo, useState, type RefObject } from 'react';

import { inAreas, withHeads, type Line, type Row } from '../domain/table';
import { useApp } from '../store/app';
import { useSelected } from '../store/create';
import { selectAreaOf, selectRows } from '../store/derived';
import { isPrinting, printing } from '../store/theme';

/** Up to this many rows, all are rendered. */
export const SHORT_TABLE = 100;
/** Rows beyond each edge of the window, for the Tab key and fast scrolling. */
const SPARE = 12;
/** Rows added or removed at once. */
const STEP = 8;
/** Most rows on paper: a browser takes minutes to lay out more. */
export const LONGEST_ON_PAPER = 1_000;
/** Row height until one has been measured, pixels. */
const USUAL_HEIGHT = 45;

export interface Range {
  readonly from: number;
  /** Exclusive. */
  readonly to: number;
}

/** A row by its index, or a number of rows that are not rendered. */
export type Part =
  | { readonly kind: 'row'; readonly index: number }
  | { readonly kind: 'gap'; readonly rows: number };

/** The rows of a range and single ones outside it, with gaps for the rows between. */
export function partsOf(count: number, range: Range, single: readonly number[]): Part[] {
  const from = Math.min(Math.max(0, range.from), count);
  const to = Math.min(Math.max(from, range.to), count);
  const outside = [...new Set(single)].filter(
    (index) => index >= 0 && index < count && (index < from || index >= to),
  );
  const inside = Array.from({ length: to - from }, (_, i) => from + i);
  const parts: Part[] = [];
  let next = 0;
  for (const index of [...outside, ...inside].sort((a, b) => a - b)) {
    if (index > next) parts.push({ kind: 'gap', rows: index - next });
    parts.push({ kind: 'row', index });
    next = index + 1;
  }
  if (count > next) parts.push({ kind: 'gap', rows: count - next });
  return parts;
}

/** Rows to render if the first row begins at `top`, pixels from the window's top; exceeds the view by `SPARE`. */
export function rangeInSight(top: number, rowHeight: number, windowHeight: number): Range {
  const down = (row: number): number => Math.floor(row / STEP) * STEP;
  return {
    from: Math.max(0, down(-top / rowHeight - SPARE)),
    to: Math.max(0, down((windowHeight - top) / rowHeight + SPARE) + STEP),
  };
}

interface Visible extends Range {
  /** Pixels. */
  readonly rowHeight: number;
}

/** The rows to render, updated on scroll, resize and print. */
export function useVisibleRows(
  body: RefObject<HTMLTableSectionElement | null>,
  count: number,
): Visible {
  const [sight, setSight] = useState<Visible>(() => ({
    ...rangeInSight(0, USUAL_HEIGHT, window.innerHeight),
    rowHeight: USUAL_HEIGHT,
  }));
  const isPaper = usePaper();
  const isLong = count > SHORT_TABLE;

  useEffect(() => {
    const rows = body.current;
    if (!isLong || !rows) return undefined;
    const look = (): void => {
      const { top } = rows.getBoundingClientRect();
      const row = rows.querySelector('tr[data-tag-id]');
      // Zero in a pane that is not shown.
      const measured = row?.getBoundingClientRect().height ?? 0;
      const rowHeight = measured > 0 ? measured : USUAL_HEIGHT;
      const { from, to } = rangeInSight(top, rowHeight, window.innerHeight);
      setSight((last) =>
        last.from === from && last.to === to && Math.abs(last.rowHeight - rowHeight) < 0.5
          ? last
          : { from, to, rowHeight },
      );
    };
    // Fires at once, and whenever a filter, the window or the font changes the table's size.
    const size = new ResizeObserver(look);
    size.observe(rows);
    const frame = rows.closest('.table-scroll');
    if (frame) size.observe(frame);
    // Which element scrolls depends on the window's size; its event does not bubble.
    document.addEventListener('scroll', look, { capture: true, passive: true });
    return () => {
      size.disconnect();
      document.removeEventListener('scroll', look, { capture: true });
    };
  }, [body, isLong]);

  if (!isLong) return { from: 0, to: count, rowHeight: 0 };
  if (isPaper) return { from: 0, to: LONGEST_ON_PAPER, rowHeight: 0 };
  return sight;
}

/** Whether the page is being printed. */
export const usePaper = (): boolean => useSelected(printing, isPrinting);

/**
 * Scrolls the selected row into view once its card is laid out, and again once rows are measured:
 * thousands may be above it. It stays in view as the frame's height changes (a chart loads into the
 * card later), and as `place` changes (rows are sorted again).
 */
export function useChosenInSight(
  body: RefObject<Element | null>,
  chosen: string | null,
  place: unknown,
  rowHeight = 0,
): void {
  useEffect(() => {
    const frame = body.current?.closest('.table-scroll, .alarms');
    if (chosen === null || !frame) return undefined;
    const painted = requestAnimationFrame(() => rowOf(frame, chosen)?.scrollIntoView(NEAREST));
    let height = frame.clientHeight;
    const size = new ResizeObserver(() => {
      const before = height;
      height = frame.clientHeight;
      if (frame.scrollHeight > height) keepInView(frame, chosen, before);
    });
    size.observe(frame);
    return () => {
      cancelAnimationFrame(painted);
      size.disconnect();
    };
  }, [body, chosen, rowHeight]);
  useEffect(() => {
    const frame = body.current?.closest('.table-scroll, .alarms');
    if (chosen === null || !frame) return undefined;
    const painted = requestAnimationFrame(() => keepInView(frame, chosen, frame.clientHeight));
    return () => cancelAnimationFrame(painted);
  }, [body, chosen, place]);
}

const NEAREST = { block: 'nearest' } as const;

const rowOf = (frame: Element, chosen: string): Element | null => {
  const id = CSS.escape(chosen);
  // A tag may have several alarms: prefer the clicked one.
  return (
    frame.querySelector(`[data-where="${id}"]:focus-within`) ??
    frame.querySelector(`tr[data-tag-id="${id}"], [data-where="${id}"]`)
  );
};

/** Keeps the selected row in view, unless the user has scrolled it out of view. */
function keepInView(frame: Element, chosen: string, height: number): void {
  const row = rowOf(frame, chosen);
  const down = row && row.getBoundingClientRect().bottom - frame.getBoundingClientRect().top;
  if (row && down && down > 0 && down - row.clientHeight < height) row.scrollIntoView(NEAREST);
}

/** A new filter scrolls a list back to its first row; on a narrow screen, the panel around it scrolls. */
export function useTopAfter(list: RefObject<HTMLElement | null>, filter: string): void {
  useEffect(() => {
    for (const each of [list.current, list.current?.closest('.tags-panel')]) {
      if (each) each.scrollTop = 0;
    }
  }, [list, filter]);
}

/** The table's rows. While a pointer is on them, none moves and new ones come last. */
export function useHeldRows() {
  const rows = useApp(selectRows);
  const areaOf = useApp(selectAreaOf);
  const [held, setHeld] = useState<ReadonlyMap<string, number> | null>(null);
  const lines = useMemo((): readonly Line[] => {
    const place = ({ tag }: Row): number => held?.get(tag.id) ?? Infinity;
    const shown = held
      ? [...rows].sort((a, b) => (place(a) === place(b) ? 0 : place(a) - place(b)))
      : rows;
    return areaOf ? withHeads(inAreas(shown, areaOf)) : shown;
  }, [rows, held, areaOf]);
  return {
    /** Rows, with area headings between them. */
    lines,
    onPointerEnter: () => setHeld(new Map(rows.map(({ tag }, index) => [tag.id, index]))),
    onPointerLeave: () => setHeld(null),
  };
}
