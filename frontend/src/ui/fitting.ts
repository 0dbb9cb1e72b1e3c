/** How many list entries fit where nobody can scroll, with a last line that counts the rest. */
import { useLayoutEffect, useState, type RefObject } from 'react';

/**
 * `bottoms`: bottom edge of each laid-out entry, pixels from the top; `all` may count more entries.
 * If not all fit, the line that counts the rest needs room too.
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

/** How many of `all` entries fit into the parent of `list`; measured again on each resize. */
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
    return () => watch.disconnect();
  });
  return Math.min(count, all);
}
