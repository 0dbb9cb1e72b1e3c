import type { MouseEvent } from 'react';

/** Heeds the first click of a double click alone: the second would take back what the first did. */
export const once =
  (act: () => void) =>
  (event: MouseEvent): void => {
    if (event.detail < 2) act();
  };
