/** The row of the chosen tag comes into view, and stays there as its card grows. */
import { useEffect, type RefObject } from 'react';

/**
 * In view once its card has taken its place, and again once the rows have been measured: there may
 * be thousands above it. A chart that comes into the card later takes its room from the table.
 */
export function useChosenInSight(
  body: RefObject<HTMLTableSectionElement | null>,
  chosen: string | null,
  rowHeight: number,
): void {
  useEffect(() => {
    const frame = body.current?.closest('.table-scroll');
    if (chosen === null || !frame) return undefined;
    const rowOf = (): Element | null =>
      frame.querySelector(`tr[data-tag-id="${CSS.escape(chosen)}"]`);
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
