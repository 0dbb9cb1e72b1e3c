/** The row of the chosen tag, or of its alarm, comes into view, and stays there as its card grows. */
import { useEffect, type RefObject } from 'react';

/**
 * In view once its card has taken its place, and again once the rows have been measured: there may
 * be thousands above it. A chart that comes into the card later takes its room from the table.
 */
export function useChosenInSight(
  body: RefObject<Element | null>,
  chosen: string | null,
  rowHeight = 0,
): void {
  useEffect(() => {
    const frame = body.current?.closest('.table-scroll, .alarms');
    if (chosen === null || !frame) return undefined;
    const rowOf = (): Element | null => {
      const id = CSS.escape(chosen);
      // Of several alarms the one that was clicked.
      return (
        frame.querySelector(`[data-where="${id}"]:focus-within`) ??
        frame.querySelector(`tr[data-tag-id="${id}"], [data-where="${id}"]`)
      );
    };
    const show = (): void => rowOf()?.scrollIntoView({ block: 'nearest' });
    const painted = requestAnimationFrame(show);
    let height = frame.clientHeight;
    const size = new ResizeObserver(() => {
      const before = height;
      height = frame.clientHeight;
      const row = rowOf();
      if (!row || frame.scrollHeight <= height) return;
      const down = row.getBoundingClientRect().top - frame.getBoundingClientRect().top;
      // Who has scrolled elsewhere is left there.
      if (down >= 0 && down < before) show();
    });
    size.observe(frame);
    return () => {
      cancelAnimationFrame(painted);
      size.disconnect();
    };
  }, [body, chosen, rowHeight]);
}
