/** What the operator prefers on this device; kept in the browser's local storage. */
import type { TemperatureUnit } from '../domain/format';

export interface Settings {
  readonly theme: 'system' | 'light' | 'dark';
  readonly unit: TemperatureUnit;
  /** Single-key shortcuts, which some speech input sets off by chance (WCAG 2.1.4). */
  readonly shortcuts: boolean;
  /** Columns of the table that are not wanted, by their ids; those of a sensor by its name. */
  readonly hidden: readonly string[];
  readonly density: 'usual' | 'compact';
  /** The table's rows are together by area, where there are areas. */
  readonly byArea: boolean;
  readonly dayBefore: boolean;
}

export const DEFAULT_SETTINGS: Settings = {
  theme: 'system',
  unit: 'C',
  shortcuts: true,
  hidden: [],
  density: 'usual',
  byArea: false,
  dayBefore: false,
};

/** More columns nobody has, and longer names nobody reads. */
const MOST_HIDDEN = 100;
const LONGEST_ID = 128;

/** The tag's own column always is. */
export const isColumnShown = ({ hidden }: Pick<Settings, 'hidden'>, id: string): boolean =>
  id === 'tag' || !hidden.includes(id);

export const withColumn = (
  hidden: readonly string[],
  id: string,
  on: boolean,
): readonly string[] =>
  on || id === 'tag'
    ? hidden.filter((each) => each !== id)
    : [...new Set([...hidden, id])].slice(-MOST_HIDDEN);

const KEY = 'lupin-twin.settings';

/** Reads what was kept; anything unknown or damaged counts as the default. */
export function readSettings(storage: Pick<Storage, 'getItem'>): Settings {
  let kept: Partial<Record<keyof Settings, unknown>>;
  try {
    const parsed: unknown = JSON.parse(storage.getItem(KEY) ?? '{}');
    kept = typeof parsed === 'object' && parsed !== null ? parsed : {};
  } catch {
    return DEFAULT_SETTINGS;
  }
  return {
    theme: kept.theme === 'light' || kept.theme === 'dark' ? kept.theme : 'system',
    unit: kept.unit === 'F' ? 'F' : 'C',
    shortcuts: kept.shortcuts !== false,
    hidden: idsIn(kept.hidden),
    density: kept.density === 'compact' ? 'compact' : 'usual',
    byArea: kept.byArea === true,
    dayBefore: kept.dayBefore === true,
  };
}

function idsIn(kept: unknown): readonly string[] {
  if (!Array.isArray(kept)) return [];
  const ids = kept.filter((id): id is string => typeof id === 'string' && id.length <= LONGEST_ID);
  return ids.filter((id) => id !== 'tag').slice(0, MOST_HIDDEN);
}

/** The browser's storage; where it is forbidden, one that keeps nothing. */
export function openStorage(): Pick<Storage, 'getItem' | 'setItem'> {
  try {
    return window.localStorage;
  } catch {
    return { getItem: () => null, setItem: () => undefined };
  }
}

export function keepSettings(storage: Pick<Storage, 'setItem'>, settings: Settings): void {
  try {
    storage.setItem(KEY, JSON.stringify(settings));
  } catch {
    // Storage is full or forbidden: the settings then last as long as the page.
  }
}
