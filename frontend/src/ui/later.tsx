/** Loads what the first view can do without (`behind.ts`), and keeps trying where it does not come. */
import type { JSX } from 'react';

import { pause } from '../clock';
import { createStore, useSelected } from '../store/create';
import type * as everyPart from './behind';

export type Parts = typeof everyPart;

/** What has come of it. */
export interface Later {
  readonly parts: Parts | null;
  /** It did not come when it was last asked for. */
  readonly isLate: boolean;
}

export const later = createStore<Later>({ parts: null, isLate: false });

/** Between two tries, ms: doubled each time, up to the longest. */
const FIRST_MS = 1_000;
const LONGEST_MS = 30_000;

let coming: Promise<Parts> | null = null;

/** Asks for them once, however often it is called; comes back with them. */
export const loadParts = (load = (): Promise<Parts> => import('./behind')): Promise<Parts> =>
  (coming ??= tried(load));

async function tried(load: () => Promise<Parts>): Promise<Parts> {
  for (let waitMs = FIRST_MS; ; waitMs = Math.min(2 * waitMs, LONGEST_MS)) {
    try {
      const parts = await load();
      later.set({ parts, isLate: false });
      return parts;
    } catch {
      later.set({ parts: null, isLate: true });
    }
    await pause(waitMs);
  }
}

/** What needs the parts that come behind the first view; nothing until they are here. */
export function WithParts({
  children,
}: {
  children: (parts: Parts) => JSX.Element | null;
}): JSX.Element | null {
  const parts = useSelected(later, (it) => it.parts);
  return parts && children(parts);
}
