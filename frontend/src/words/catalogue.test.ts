/** That the four languages say the same, is what the types hold; here: that they say it at all. */
import ts from 'typescript';
import { readdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';

import { describe, expect, test } from 'vitest';

import { ENGLISH } from './en';
import { ESTIMATE } from './en/estimate';
import { estimateWordsOf } from './estimate';
import { GERMAN } from './de';
import { ESTIMATE as GERMAN_ESTIMATE } from './de/estimate';
import { DUTCH } from './nl';
import { ESTIMATE as DUTCH_ESTIMATE } from './nl/estimate';
import { SPANISH } from './es';
import { ESTIMATE as SPANISH_ESTIMATE } from './es/estimate';
import { wordsOf } from './load';

/** Everything that a catalogue can say is found by trying. */

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
function parametersIn(source: string): Map<string, readonly (readonly unknown[])[]> {
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

interface Said {
  /** Where in the catalogue, and what it was made of: 'card("⟦tag⟧")'. */
  readonly at: string;
  readonly text: string;
}

/** Every text of a catalogue, and of those that are made of others one for each sample. */
function saidBy(
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

const sourcesIn = (folder: string): [name: string, text: string][] =>
  readdirSync(join(import.meta.dirname, folder)).map((name) => [
    `${folder}/${name}`,
    readFileSync(join(import.meta.dirname, folder, name), 'utf8'),
  ]);

const parameters = new Map(sourcesIn('en').flatMap(([, text]) => [...parametersIn(text)]));
const english = saidBy({ ...ENGLISH, ...ESTIMATE }, parameters);

/** Texts that are the same in another language: names, signs, and words that both have. */
const SAME: Readonly<Record<string, readonly string[]>> = {
  de: [
    ...['phase.live', 'timebarLive', 'keys.time.3.1', 'themes.system', 'tried.ok', 'sensors'],
    ...['cardPosition', 'rangeAuto', 'saveCsvShort', 'legendMore'],
    ...['keys.global.12.0', 'idealParts.any', 'colourings.ideal', 'differenceTimes'],
    'densities.usual',
  ],
  nl: [
    ...['phase.live', 'timebarLive', 'keys.time.3.1', 'menu', 'tried.ok', 'sensors', 'alarmCount'],
    ...['rangeAuto', 'saveCsvShort', 'trend', 'legendMore', 'robotLayer', 'robotAt'],
    ...['keys.global.12.0', 'keys.map.3.0', 'keys.time.1.0', 'keys.time.2.0', 'keys.time.3.0'],
    ...['speciesNames.gerbera', 'densities.compact', 'phase.offline', 'reasons.wasBeyond'],
  ],
  es: [
    ...['robotLayer', 'robotAt', 'tried.ok', 'sensors', 'rangeAuto', 'saveCsvShort'],
    ...['speciesNames.gerbera', 'keys.global.12.0', 'idealParts.any', 'colourings.ideal'],
  ],
};

/** Counted things of which one and many are the same word. */
const ONE_AND_MANY: Readonly<Record<string, readonly string[]>> = { de: [], nl: [], es: [] };

const isWorded = (text: string): boolean =>
  /\p{L}{2}/u.test(text.replaceAll(/⟦[^⟧]*⟧/g, '').replaceAll('Lupin twin', ''));
const marksIn = (text: string): string[] => (text.match(/⟦[^⟧]*⟧/g) ?? []).sort();
const nameOf = (at: string): string => at.replace(/\(.*$/s, '');

test('English has words, and what they are made of is known', () => {
  expect(english.length).toBeGreaterThan(400);
  expect(saidBy({ a: 'x', b: { c: (n: string) => `${n}!` } }, new Map([['b.c', [['y']]]]))).toEqual(
    [
      { at: 'a', text: 'x' },
      { at: 'b.c("y")', text: 'y!' },
    ],
  );
});

describe.each([
  ['de', GERMAN, GERMAN_ESTIMATE],
  ['nl', DUTCH, DUTCH_ESTIMATE],
  ['es', SPANISH, SPANISH_ESTIMATE],
] as const)('%s', (language, words, estimate) => {
  const all = { ...words, ...estimate };
  const said = new Map(saidBy(all, parameters).map(({ at, text }) => [at, text]));

  test('says all that English says, and nothing else', () => {
    expect([...said.keys()]).toEqual(english.map(({ at }) => at));
    const empty = english.filter(({ at, text }) => (said.get(at) === '') !== (text === ''));
    expect(empty).toEqual([]);
  });

  test('leaves no word in English, but those that are the same', () => {
    const same = english.filter(({ at, text }) => isWorded(text) && said.get(at) === text);
    expect([...new Set(same.map(({ at }) => nameOf(at)))].sort()).toEqual(
      [...(SAME[language] ?? [])].sort(),
    );
  });

  test('tells everything that English tells of what a text is made of', () => {
    const wrong = english
      .filter(({ at, text }) => marksIn(text).join() !== marksIn(said.get(at) ?? '').join())
      .map(({ at, text }) => [at, text, said.get(at)]);
    expect(wrong).toEqual([]);
  });

  test('tells the same numbers', () => {
    const numbers = (text: string): string => (text.match(/(?<!\p{L})\d+/gu) ?? []).sort().join();
    const wrong = english
      .filter(({ at, text }) => numbers(text) !== numbers(said.get(at) ?? ''))
      .map(({ at, text }) => [at, text, said.get(at)]);
    expect(wrong).toEqual([]);
  });

  test('tells one from many where English does', () => {
    const isSame = (at: string, of: (at: string) => string | undefined): boolean => {
      const many = at.replace(/\b1\b/, '2');
      return of(at)?.replace(/\b1\b/, '2') === of(many);
    };
    const texts = new Map(english.map(({ at, text }) => [at, text]));
    const counted = [...texts.keys()].filter(
      (at) => /\(.*\b1\b/.test(at) && texts.has(at.replace(/\b1\b/, '2')),
    );
    expect(counted.length).toBeGreaterThan(5);
    const wrong = counted
      .filter((at) => !isSame(at, (each) => texts.get(each)))
      .filter((at) => isSame(at, (each) => said.get(each)));
    expect([...new Set(wrong.map(nameOf))]).toEqual(ONE_AND_MANY[language]);
  });

  test('writes as its readers do', () => {
    const texts = [...said.values()];
    // Quotation marks of its own, and no English words that slip through translations.
    const foreign = { de: /“[^“„]*”|"/, nl: /[«»„]\w|"/, es: /[“”„"]/ }[language];
    expect(texts.filter((text) => foreign.test(text.replaceAll(/⟦\w+⟧/g, '')))).toEqual([]);
    const leftover = /\b(the|and|with|not|readings?|shown)\b/i;
    expect(texts.filter((text) => leftover.test(text.replaceAll(/⟦\w+⟧/g, '')))).toEqual([]);
    // What is right, and what no grower says; and a second word for the ideal range.
    const translated = {
      de: /Sollbereich|Typischer Fehler|Vergangen|Was die Zeichen/,
      nl: /gestrest|Typische fout|verleden|[Vv]raagt aandacht| …/i,
      es: /Error típico|calentar|\(?pasado|anomalía| …/i,
    }[language];
    expect(texts.filter((text) => translated.test(text))).toEqual([]);
    // Of whatever sensor: a word that agrees with one noun disagrees with another.
    const tooMuch = [words.tooLow, words.tooHigh].map((text) => text(null));
    expect(tooMuch.filter((text) => /(baj|alt)[oa]$/.test(text))).toEqual([]);
    // Of one alarm and, behind a number, of many.
    expect(words.alarmBack).not.toMatch(/ad[oa]$/);
  });

  test('shortens no name that a site has given a sensor', () => {
    for (const own of ['Leaf temperature', 'constructor']) expect(words.sensorShort(own)).toBe(own);
  });

  test('comes when it is asked for, and asks the page for nothing', async () => {
    expect(await wordsOf(language)).toBe(words);
    expect(await estimateWordsOf(language)).toBe(estimate);
    // The page waits for it: an import of anything that the page has would wait for ever.
    const sources = [
      ...sourcesIn(language),
      [
        `${language}.ts`,
        readFileSync(join(import.meta.dirname, `${language}.ts`), 'utf8'),
      ] as const,
    ];
    const imports = sources.flatMap(([name, text]) =>
      [...text.matchAll(/^import (?!type ).*from '(.*)';$/gm)].map(
        ([, target = '']) => `${name}: ${target}`,
      ),
    );
    const own = new RegExp(
      `^(${language}\\.ts: \\./${language}/|${language}/\\w+\\.ts: \\./counted)`,
    );
    expect(imports.length).toBeGreaterThan(6);
    expect(imports.filter((each) => !own.test(each))).toEqual([]);
  });
});

/** What only who runs the machines, or made the page, would understand. */
const TECHNICAL =
  /\b(SLAM|ROS|ROS_\w+|DDS|domain|bridge|leave-one-out|RMSE|episodes?|journal|SQLite|JSON|WebSocket|latch|replica|kriging|Gauss\w*|posterior|covariance|Matérn|IDW|interpolat\w+|topic|node|thread|parser?|null|NaN)\b/i;
/** Where such words may stand: behind "More about this", which is closed, or by a program's own name. */
const BEHIND = /More(?:$|\.)|^offlineMore\.|More\(/;

test('no word of the machines is in the first layer, in any language', () => {
  for (const words of [
    { ...ENGLISH, ...ESTIMATE },
    { ...GERMAN, ...GERMAN_ESTIMATE },
    { ...DUTCH, ...DUTCH_ESTIMATE },
    { ...SPANISH, ...SPANISH_ESTIMATE },
  ]) {
    const first = saidBy(words, parameters)
      .map(({ at, text }) => ({ at, text: text.replaceAll(/⟦\w+⟧/g, '') }))
      .filter(({ at, text }) => TECHNICAL.test(text) && !BEHIND.test(at));
    expect(first).toEqual([]);
  }
});
