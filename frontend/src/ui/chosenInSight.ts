/** The row of the chosen tag, or of its alarm, comes into view, and stays there as its card grows. */
import { useEffect, type RefObject } from 'react';

/**
 * In view once its card has taken its place, and again once the rows have been measured: there may
 * be thousands above it. A chart that comes into the card later takes its room from the table.
 * `place`: as rows sort anew, none that is chosen stays half below the head.
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
      if (frame.scrollHeight > height) keep(frame, chosen, before);
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
    const painted = requestAnimationFrame(() => {
      keep(frame, chosen, frame.clientHeight);
    });
    return () => {
      cancelAnimationFrame(painted);
    };
  }, [body, chosen, place]);
}

const NEAREST = { block: 'nearest' } as const;

const rowOf = (frame: Element, chosen: string): Element | null => {
  const id = CSS.escape(chosen);
  // Of several alarms the one that was clicked.
  return (
    frame.querySelector(`[data-where="${id}"]:focus-within`) ??
    frame.querySelector(`tr[data-tag-id="${id}"], [data-where="${id}"]`)
  );
};

/** Who has scrolled elsewhere is left there. */
function keep(frame: Element, chosen: string, height: number): void {
  const row = rowOf(frame, chosen);
  const down = row && row.getBoundingClientRect().bottom - frame.getBoundingClientRect().top;
  if (row && down && down > 0 && down - row.clientHeight < height) row.scrollIntoView(NEAREST);
}
