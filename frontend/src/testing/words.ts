/** Everything that a catalogue can say, found by trying: for the tests of all languages. */
import ts from 'typescript';

/** What is put in where a text is made of others: found again in what is said. */
const mark = (name: string): string => `⟦${name}⟧`;
const COUNTS = [0, 1, 2, 43];

/** Values of a parameter to try, by the type that English declares for it. */
function samplesOf(name: string, type: string): readonly unknown[] {
  if (type.endsWith(' | null')) return [null, ...samplesOf(name, type.slice(0, -7))];
  switch (type) {
    case 'number':
      return COUNTS;
    case 'boolean':
      return [false, true];
    case 'string':
      // An empty one is an omission, which may be worded in another way.
      return [mark(name), ''];
    case 'readonly string[]':
      return [[mark(`${name}0`), mark(`${name}1`)]];
    default:
      throw new Error(`no samples for ${name}: ${type}; take numbers, texts or booleans`);
  }
}

/** The parameters of each function in a source of English words, by its path: "reasons.old". */
export function parametersIn(source: string): Map<string, readonly (readonly unknown[])[]> {
  const found = new Map<string, readonly (readonly unknown[])[]>();
  const walk = (node: ts.Node, path: readonly string[]): void => {
    if (ts.isPropertyAssignment(node)) {
      const own = [...path, node.name.getText(file)];
      if (ts.isArrowFunction(node.initializer)) {
        const samples = node.initializer.parameters.map((parameter) =>
          samplesOf(parameter.name.getText(file), parameter.type?.getText(file) ?? ''),
        );
        found.set(own.join('.'), samples);
        return;
      }
      walk(node.initializer, own);
      return;
    }
    ts.forEachChild(node, (child) => {
      walk(child, path);
    });
  };
  const file = ts.createSourceFile('words.ts', source, ts.ScriptTarget.ES2022, true);
  walk(file, []);
  return found;
}

export interface Said {
  /** Where in the catalogue, and what it was made of: 'card("⟦tag⟧")'. */
  readonly at: string;
  readonly text: string;
}

/** Every text of a catalogue, and of those that are made of others one for each sample. */
export function saidBy(
  words: unknown,
  parameters: ReadonlyMap<string, readonly (readonly unknown[])[]>,
  path = '',
): readonly Said[] {
  if (typeof words === 'string') return [{ at: path, text: words }];
  if (typeof words === 'function') {
    const samples = parameters.get(path);
    if (!samples) throw new Error(`${path}: English declares no such function`);
    const make = words as (...of: unknown[]) => string;
    return combinations(samples).map((of) => ({
      at: `${path}(${of.map((each) => JSON.stringify(each)).join(', ')})`,
      text: make(...of),
    }));
  }
  return Object.entries(words as object).flatMap(([key, value]) =>
    saidBy(value, parameters, path === '' ? key : `${path}.${key}`),
  );
}

const combinations = (samples: readonly (readonly unknown[])[]): readonly unknown[][] =>
  samples.reduce<unknown[][]>(
    (made, values) => made.flatMap((before) => values.map((value) => [...before, value])),
    [[]],
  );
