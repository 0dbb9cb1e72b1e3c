import { useLayoutEffect, useState, type RefObject } from 'react';

export interface Size {
  readonly width: number;
  readonly height: number;
}

/** The room inside an element, CSS pixels; none before it is laid out. */
export function useSize(ref: RefObject<HTMLElement | null>): Size {
  const [size, setSize] = useState<Size>({ width: 0, height: 0 });
  useLayoutEffect(() => {
    const element = ref.current;
    if (!element) return undefined;
    const observer = new ResizeObserver(([entry]) => {
      if (!entry) return;
      const { width, height } = entry.contentRect;
      setSize({ width: Math.floor(width), height: Math.floor(height) });
    });
    observer.observe(element);
    return () => {
      observer.disconnect();
    };
  }, [ref]);
  return size;
}

/** A bucket of fewer pixels is a line that nobody can tell from the next. */
const BUCKET_PX = 2;
const STEP = 50;
const MOST = 1_000;

/**
 * So many points or buckets as can be told apart in a chart of that width, in steps: a window
 * that is resized does not ask anew with each pixel. 0 while there is no width.
 */
export const pointsFor = (width: number): number =>
  width === 0 ? 0 : Math.min(MOST, Math.max(100, Math.ceil(width / BUCKET_PX / STEP) * STEP));
