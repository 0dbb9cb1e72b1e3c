/**
 * Strict checks of what comes from outside. A check says what is wrong with a value, as
 * ".state.tags[3].pose: an object, not null"; null: nothing is. Nothing is put together unless
 * something is wrong, so that ten thousand tags cost milliseconds.
 */
export type Check = (value: unknown) => string | null;

const SHOWN = 40;

/** What a wrong value is, in short; it may be anything that JSON can say. */
function named(value: unknown): string {
  if (value === undefined) return 'missing';
  if (Array.isArray(value)) return `a list of ${value.length}`;
  if (typeof value === 'object' && value !== null) return 'an object';
  const text = typeof value === 'number' ? String(value) : JSON.stringify(value);
  return text.length > SHOWN ? `${text.slice(0, SHOWN)}…` : text;
}

const wrong = (wanted: string, value: unknown): string =>
  value === undefined ? ': is missing' : `: ${wanted}, not ${named(value)}`;

/** A finite number. JSON has no NaN, and "1e999" is infinite. */
export const number: Check = (value) =>
  typeof value === 'number' && Number.isFinite(value) ? null : wrong('a number', value);

/** A finite number, or null where it is not known. */
export const numberOrNull: Check = (value) =>
  value === null || (typeof value === 'number' && Number.isFinite(value))
    ? null
    : wrong('a number or null', value);

/** A whole number from 0. */
export const count: Check = (value) =>
  Number.isSafeInteger(value) && (value as number) >= 0 ? null : wrong('a whole number', value);

export const integer: Check = (value) =>
  Number.isSafeInteger(value) ? null : wrong('a whole number', value);

export const boolean: Check = (value) =>
  typeof value === 'boolean' ? null : wrong('true or false', value);

/** Text of at most so many characters. */
export const text =
  (most: number): Check =>
  (value) => {
    if (typeof value !== 'string') return wrong('text', value);
    return value.length <= most ? null : `: ${value.length} characters, the limit is ${most}`;
  };

export const oneOf =
  (...allowed: readonly string[]): Check =>
  (value) =>
    typeof value === 'string' && allowed.includes(value)
      ? null
      : wrong(`one of ${allowed.join(', ')}`, value);

/** What may be missing. */
export const optional =
  (check: Check): Check =>
  (value) =>
    value === undefined ? null : check(value);

export const orNull =
  (check: Check): Check =>
  (value) =>
    value === null ? null : check(value);

/** An object with these fields; it may have others, of a later server. */
export function object(fields: Readonly<Record<string, Check>>): Check {
  const entries = Object.entries(fields);
  return (value) => {
    if (typeof value !== 'object' || value === null || Array.isArray(value)) {
      return wrong('an object', value);
    }
    for (const [name, check] of entries) {
      const fault = check((value as Readonly<Record<string, unknown>>)[name]);
      if (fault !== null) return `.${name}${fault}`;
    }
    return null;
  };
}

/** A list of at most so many; what it costs to show is bounded by what it may hold. */
export const list =
  (check: Check, most: number): Check =>
  (value) => {
    if (!Array.isArray(value)) return wrong('a list', value);
    const items: readonly unknown[] = value;
    if (items.length > most) return `: ${items.length} entries, the limit is ${most}`;
    for (let index = 0; index < items.length; index++) {
      const fault = check(items[index]);
      if (fault !== null) return `[${index}]${fault}`;
    }
    return null;
  };

/** An object of any names, at most so many. */
export const record =
  (check: Check, most: number): Check =>
  (value) => {
    const fault = object({})(value);
    if (fault !== null) return fault;
    const entries = Object.entries(value as object) as [string, unknown][];
    if (entries.length > most) return `: ${entries.length} entries, the limit is ${most}`;
    for (const [name, item] of entries) {
      const why = check(item);
      if (why !== null) return `[${JSON.stringify(name).slice(0, SHOWN)}]${why}`;
    }
    return null;
  };

/** Both; the second is asked only where the first has nothing to say. */
export const also =
  (first: Check, second: Check): Check =>
  (value) =>
    first(value) ?? second(value);
