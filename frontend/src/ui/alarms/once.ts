import type { MouseEvent } from 'react';

/** A second click at the same place within so many ms is none of its own. */
const AGAIN_MS = 600;
const SAME_PLACE_PX = 5;

let last = { at: -Infinity, x: 0, y: 0 };

/**
 * Heeds the first click of a double click alone: the second would take back what the first did, or
 * do the same to what has come there since.
 */
export const once =
  (act: () => void) =>
  ({ detail, timeStamp, clientX, clientY }: MouseEvent): void => {
    const isAgain =
      timeStamp - last.at < AGAIN_MS &&
      Math.hypot(clientX - last.x, clientY - last.y) < SAME_PLACE_PX;
    // By a key it is meant each time.
    if (detail > 0 && isAgain) return;
    last = { at: timeStamp, x: clientX, y: clientY };
    act();
  };
