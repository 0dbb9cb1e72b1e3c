/**
 * Checks a value against the server's own schema. A check says what is wrong, as
 * ".state.tags[3].pose: an object, not null"; null: nothing is. Text is built only for a fault, so that
 * ten thousand tags cost milliseconds.
 */
import schemas from './schemas.gen.json';

type Check = (value: unknown) => string | null;

/** The part of JSON Schema that the generated schemas use. */
interface Schema {
  readonly $ref?: string;
  readonly anyOf?: readonly Schema[];
  readonly const?: string;
  readonly enum?: readonly string[];
  readonly type?: string;
  readonly items?: Schema;
  readonly properties?: Readonly<Record<string, Schema>>;
  readonly required?: readonly string[];
  readonly additionalProperties?: Schema;
}

const SCHEMAS: Readonly<Record<string, Schema>> = schemas;
const made = new Map<string, Check>();

/** The check of a schema by its name. */
export function checkOf(name: string): Check {
  let check = made.get(name);
  if (!check) {
    const schema = SCHEMAS[name];
    if (!schema) throw new Error(`no schema "${name}"`);
    check = compiled(schema);
    made.set(name, check);
  }
  return check;
}

function compiled(schema: Schema): Check {
  const { $ref, anyOf, items, properties, additionalProperties } = schema;
  if ($ref !== undefined) return checkOf($ref.slice($ref.lastIndexOf('/') + 1));
  if (anyOf) {
    const checks = anyOf.map(compiled);
    return (value) =>
      checks.some((check) => check(value) === null) ? null : (checks[0]?.(value) ?? null);
  }
  if (items) return list(compiled(items));
  if (additionalProperties) return record(compiled(additionalProperties));
  if (properties) return object(properties, schema.required ?? []);
  return plain(schema);
}

function plain({ type = '', ...schema }: Schema): Check {
  const words = schema.const === undefined ? schema.enum : [schema.const];
  if (words)
    return (value) => (words.includes(value as string) ? null : wrong(words.join(), value));
  return (value) => (isOf(type, value) ? null : wrong(`a value of type ${type}`, value));
}

function isOf(type: string, value: unknown): boolean {
  if (type === 'null') return value === null;
  // JSON has no NaN, and "1e999" is infinite.
  if (type === 'number') return Number.isFinite(value);
  if (type === 'integer') return Number.isSafeInteger(value);
  return typeof value === type;
}

function object(properties: Readonly<Record<string, Schema>>, required: readonly string[]): Check {
  const fields = Object.entries(properties).map(
    ([name, schema]) => [name, compiled(schema), required.includes(name)] as const,
  );
  return (value) => {
    if (!isObject(value)) return wrong('an object', value);
    for (const [name, check, isRequired] of fields) {
      const field = value[name];
      if (field === undefined && !isRequired) continue;
      const fault = check(field);
      if (fault !== null) return `.${name}${fault}`;
    }
    return null;
  };
}

const record =
  (check: Check): Check =>
  (value) => {
    if (!isObject(value)) return wrong('an object', value);
    for (const [name, item] of Object.entries(value)) {
      const fault = check(item);
      if (fault !== null) return `[${JSON.stringify(name).slice(0, SHOWN)}]${fault}`;
    }
    return null;
  };

const list =
  (check: Check): Check =>
  (value) => {
    if (!Array.isArray(value)) return wrong('a list', value);
    for (let index = 0; index < value.length; index++) {
      const fault = check(value[index]);
      if (fault !== null) return `[${index}]${fault}`;
    }
    return null;
  };

export const isObject = (value: unknown): value is Readonly<Record<string, unknown>> =>
  typeof value === 'object' && value !== null && !Array.isArray(value);

const SHOWN = 40;

/** The fault, with the wrong value in short. */
function wrong(wanted: string, value: unknown): string {
  if (value === undefined) return ': is missing';
  if (Array.isArray(value)) return `: ${wanted}, not a list of ${value.length}`;
  if (isObject(value)) return `: ${wanted}, not an object`;
  const text = typeof value === 'number' ? String(value) : JSON.stringify(value);
  return `: ${wanted}, not ${text.length > SHOWN ? `${text.slice(0, SHOWN)}…` : text}`;
}
