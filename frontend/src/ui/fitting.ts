/** How many entries of a list fit where nobody scrolls, with the line that counts the rest. */
import { useLayoutEffect, useState, type RefObject } from 'react';

/**
 * `bottoms`: where each entry ends, pixels from the top; `all` may be more than have been laid out.
 * The line of the rest needs room for itself, and only where there is a rest.
 */
export function fitting(
  bottoms: readonly number[],
  all: number,
  height: number,
  lineHeight: number,
): number {
  const fit = (room: number): number => bottoms.filter((bottom) => bottom <= room).length;
  return bottoms.length === all && fit(height) === all ? all : fit(height - lineHeight);
}

/** Lays out the entries of `list` within its parent; of `all` in the data. Gives how many fit. */
export function useFitting(list: RefObject<HTMLElement | null>, all: number): number {
  const [count, setCount] = useState(all);
  useLayoutEffect(() => {
    const entries = list.current;
    const box = entries?.parentElement;
    if (!entries || !box) return undefined;
    const look = (): void => {
      const { top } = entries.getBoundingClientRect();
      const inner =
        box.getBoundingClientRect().bottom - parseFloat(getComputedStyle(box).paddingBottom || '0');
      const bottoms = [...entries.children].map(
        (entry) => entry.getBoundingClientRect().bottom - top,
      );
      const line = parseFloat(getComputedStyle(box).fontSize) * 2.2 || 0;
      setCount(fitting(bottoms, all, inner - top, line));
    };
    look();
    const watch = new ResizeObserver(look);
    watch.observe(box);
    for (const entry of entries.children) watch.observe(entry);
    return () => {
      watch.disconnect();
    };
  });
  return Math.min(count, all);
}
