/** One direction of imports, held by a table. What it does not name is not allowed. */
import { readdirSync, readFileSync } from 'node:fs';
import { dirname, join, normalize } from 'node:path/posix';

import ts from 'typescript';
import { expect, test } from 'vitest';

/** Where each part may import from: other parts of the source, and packages. */
type Table = Readonly<Record<string, readonly string[]>>;

/**
 * The part that a file belongs to: its first folder, however deep it lies; at the top, itself. A
 * file outside the source is a part of its own.
 */
const partOf = (path: string): string => {
  if (path.startsWith('../')) return path;
  const [first = '', ...rest] = path.split('/');
  return rest.length > 0 ? first : first.replace(/\.tsx?$/, '');
};

/** What a file imports, types and dynamic imports too: paths from the root, or packages' names. */
function importsOf(path: string, text: string): string[] {
  return ts.preProcessFile(text, true, true).importedFiles.map(({ fileName }) => {
    if (fileName.startsWith('.')) return normalize(join(dirname(path), fileName));
    const [scope = '', name = ''] = fileName.split('/');
    return `npm:${scope.startsWith('@') ? `${scope}/${name}` : scope}`;
  });
}

/** Every import that the table does not name, as "from -> to". */
function wrongImports(sources: ReadonlyMap<string, string>, table: Table): string[] {
  return [...sources].flatMap(([path, text]) => {
    const own = partOf(path);
    const allowed = table[own] ?? [];
    return importsOf(path, text)
      .filter((target) => {
        const part = target.startsWith('npm:') ? target : partOf(target);
        return part !== own && !allowed.includes(part);
      })
      .map((target) => `${path} -> ${target}`);
  });
}

/** A ring of files that import each other, or one of parts if the table allows it; null: none. */
function ringIn(graph: ReadonlyMap<string, readonly string[]>): string[] | null {
  const done = new Set<string>();
  const walk = (node: string, path: readonly string[]): string[] | null => {
    if (path.includes(node)) return [...path.slice(path.indexOf(node)), node];
    if (done.has(node)) return null;
    for (const next of graph.get(node) ?? []) {
      const ring = walk(next, [...path, node]);
      if (ring) return ring;
    }
    done.add(node);
    return null;
  };
  for (const node of graph.keys()) {
    const ring = walk(node, []);
    if (ring) return ring;
  }
  return null;
}

/** Files and the files that they import. */
function fileGraph(sources: ReadonlyMap<string, string>): Map<string, string[]> {
  const resolve = (target: string): string[] =>
    [`${target}.ts`, `${target}.tsx`, target].filter((name) => sources.has(name)).slice(0, 1);
  return new Map(
    [...sources].map(([path, text]) => [path, importsOf(path, text).flatMap(resolve)]),
  );
}

/**
 * From the lowest to the highest: each part may import from those that it names, from itself,
 * and from nothing else. A part is a folder, with all folders in it, or a file beside this one.
 */
const TABLE: Table = {
  words: [],
  strings: ['words'],
  clock: [],
  contract: [],
  geometry: ['contract'],
  domain: ['contract', 'geometry', 'strings'],
  connection: ['contract', 'clock'],
  draw: ['contract', 'geometry', 'domain'],
  store: [
    ...['strings', 'clock', 'contract', 'geometry', 'domain', 'connection'],
    ...['npm:react', 'npm:react-dom'],
  ],
  map: [...['strings', 'clock', 'contract', 'geometry', 'domain', 'draw', 'store'], 'npm:react'],
  // What goes on about alarms beside the components, which are in `ui/alarms`.
  alarms: ['strings', 'clock', 'contract', 'domain', 'store', 'map'],
  widgets: ['clock', 'npm:react'],
  // What people say, wherever it is shown.
  notes: [...['words', 'strings', 'contract', 'domain', 'store', 'widgets'], ...['npm:react']],
  timebar: [...['strings', 'clock', 'domain', 'store', 'widgets', 'notes'], ...['npm:react']],
  export: ['strings', 'clock', 'geometry', 'domain', 'draw', 'store', 'map'],
  charts: [
    ...['strings', 'clock', 'contract', 'geometry', 'domain', 'draw', 'store', 'widgets', 'export'],
    ...['notes', 'styles', 'npm:react', 'npm:uplot'],
  ],
  // What the page has of the estimate, loaded when first shown, and of the robot.
  parts: [
    ...['words', 'strings', 'contract', 'geometry', 'domain', 'store', 'widgets', 'styles'],
    ...['npm:react', 'npm:react-dom'],
  ],
  ui: [
    ...[
      'strings',
      'words',
      'clock',
      'contract',
      'geometry',
      'domain',
      'draw',
      'store',
      'map',
      'export',
    ],
    ...['styles', 'widgets', 'alarms', 'timebar', 'charts', 'parts', 'notes'],
    ...['npm:react', 'npm:react-dom'],
  ],
  // The page over all greenhouses, a bundle of its own.
  fleet: [
    ...['words', 'strings', 'clock', 'contract', 'connection', 'domain', 'store', 'alarms'],
    ...['widgets', 'charts', 'ui', 'styles', 'npm:react', 'npm:react-dom', 'npm:uplot'],
  ],
  main: ['styles', 'strings', 'store', 'alarms', 'ui', 'npm:react', 'npm:react-dom'],
  // For tests alone: no part above names it.
  testing: [
    ...['contract', 'domain', 'draw', 'connection', 'store'],
    // The file that comes with the bridge: the page itself has no copy of it.
    '../../backend/lupin_bridge/sensors.json',
    ...['npm:vitest', 'npm:@testing-library/react', 'npm:node:fs', 'npm:node:path'],
  ],
};

/** The sources by their path; tests may import whatever they test. */
const sources = new Map(
  readdirSync(import.meta.dirname, { recursive: true, encoding: 'utf8' })
    .map((name) => name.replaceAll('\\', '/'))
    .filter((name) => /\.tsx?$/.test(name) && !/\.test\.tsx?$/.test(name))
    .map((name) => [name, readFileSync(join(import.meta.dirname, name), 'utf8')]),
);

test('every import goes in a direction that the table names', () => {
  expect(sources.size).toBeGreaterThan(50);
  expect(wrongImports(sources, TABLE)).toEqual([]);
});

test('the table names every part, and no part that is gone', () => {
  expect([...new Set([...sources.keys()].map(partOf))].sort()).toEqual(Object.keys(TABLE).sort());
});

test('neither the table nor the files lead back to where they began', () => {
  expect(ringIn(new Map(Object.entries(TABLE)))).toBeNull();
  expect(ringIn(fileGraph(sources))).toBeNull();
});

test.each([
  ['upwards', 'domain/age.ts', "import { store } from '../store/app';"],
  ['from a nested folder', 'domain/judge/deep/rule.ts', "import '../../../store/app';"],
  ['of a type alone', 'contract/api.ts', "import type { Tag } from '../domain/twin';"],
  ['handed on', 'geometry/image.ts', "export { S } from '../strings';"],
  ['at run time', 'draw/pins.ts', "const load = () => import('../map/painter');"],
  ['of another file of the bridge', 'domain/a.ts', "import '../../../backend/x.json';"],
  ['of a package', 'domain/age.ts', "import { useState } from 'react';"],
  ['of what is for tests', 'ui/App.tsx', "import { tag } from '../testing/tags';"],
  ['by a part that the table does not know', 'extras/a.ts', "import '../strings';"],
  ['of a part that the table does not know', 'ui/App.tsx', "import '../extras/a';"],
])('an import %s is seen', (_, path, text) => {
  expect(wrongImports(new Map([[path, text]]), TABLE)).toHaveLength(1);
});

test('a ring of files is seen, also of types alone', () => {
  const ring = new Map([
    ['ui/a.ts', "import type { B } from './b';"],
    ['ui/b.tsx', "import './deep/c';"],
    ['ui/deep/c.ts', "import '../a';"],
  ]);
  expect(ringIn(fileGraph(ring))).toEqual(['ui/a.ts', 'ui/b.tsx', 'ui/deep/c.ts', 'ui/a.ts']);
  ring.set('ui/deep/c.ts', '');
  expect(ringIn(fileGraph(ring))).toBeNull();
});
