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

/** The tag's own column always is. */
export const isColumnShown = ({ hidden }: Pick<Settings, 'hidden'>, id: string): boolean =>
  id === 'tag' || !hidden.includes(id);

export const withColumn = (
  hidden: readonly string[],
  id: string,
  on: boolean,
): readonly string[] =>
  on || id === 'tag' ? hidden.filter((each) => each !== id) : [...new Set([...hidden, id])];

const KEY = 'lupin-twin.settings';

/** Reads what was kept; what is not there or damaged is as by default. */
export function readSettings(storage: Pick<Storage, 'getItem'>): Settings {
  try {
    const stored = JSON.parse(storage.getItem(KEY) ?? '{}') as Partial<Settings>;
    // The first thing that looks for a column in no list would leave the page blank for good.
    const hidden = Array.isArray(stored.hidden) ? stored.hidden : [];
    return { ...DEFAULT_SETTINGS, ...stored, hidden };
  } catch {
    return DEFAULT_SETTINGS;
  }
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
