/** Loads what the first view does not need (`deferred.ts`), with retries. */
import type { JSX } from 'react';

import { pause } from '../clock';
import { createStore, useSelected } from '../store/create';
import type * as everyPart from './deferred';
import { ErrorBoundary } from './ErrorBoundary';

export type Parts = typeof everyPart;

/** State of loading. */
interface Deferred {
  readonly parts: Parts | null;
  /** The last attempt to load failed. */
  readonly isLate: boolean;
}

export const deferred = createStore<Deferred>({ parts: null, isLate: false });

/** Pause between attempts, ms: doubled each time, up to the longest. */
const FIRST_MS = 1_000;
const LONGEST_MS = 30_000;

let coming: Promise<Parts> | null = null;

/** Loads the parts, once for all callers. */
export const loadParts = (load = (): Promise<Parts> => import('./deferred')): Promise<Parts> =>
  (coming ??= loadWithRetries(load));

async function loadWithRetries(load: () => Promise<Parts>): Promise<Parts> {
  for (let waitMs = FIRST_MS; ; waitMs = Math.min(2 * waitMs, LONGEST_MS)) {
    try {
      const parts = await load();
      deferred.set({ parts, isLate: false });
      return parts;
    } catch {
      deferred.set({ parts: null, isLate: true });
    }
    await pause(waitMs);
  }
}

/** Renders children that need the later parts; nothing until those are loaded. One that fails, fails alone. */
export function WithParts({
  children,
}: {
  children: (parts: Parts) => JSX.Element | null;
}): JSX.Element | null {
  const parts = useSelected(deferred, (it) => it.parts);
  return parts && <ErrorBoundary isPart>{children(parts)}</ErrorBoundary>;
}
