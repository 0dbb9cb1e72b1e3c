/** Loads what the first view does not need (`behind.ts`), with retries. */
import type { JSX } from 'react';

import { pause } from '../clock';
import { createStore, useSelected } from '../store/create';
import type * as everyPart from './behind';

export type Parts = typeof everyPart;

/** State of loading. */
export interface Later {
  readonly parts: Parts | null;
  /** The last attempt to load failed. */
  readonly isLate: boolean;
}

export const later = createStore<Later>({ parts: null, isLate: false });

/** Pause between attempts, ms: doubled each time, up to the longest. */
const FIRST_MS = 1_000;
const LONGEST_MS = 30_000;

let coming: Promise<Parts> | null = null;

/** Loads the parts, once for all callers. */
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

/** Renders children that need the later parts; nothing until those are loaded. */
export function WithParts({
  children,
}: {
  children: (parts: Parts) => JSX.Element | null;
}): JSX.Element | null {
  const parts = useSelected(later, (it) => it.parts);
  return parts && children(parts);
}
