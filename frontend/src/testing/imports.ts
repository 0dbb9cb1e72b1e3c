/** Who imports whom, and whether the table of directions allows it. */
import { dirname, join, normalize } from 'node:path/posix';

import ts from 'typescript';

/** Where each part may import from: other parts of the source, and packages. */
export type Table = Readonly<Record<string, readonly string[]>>;

/**
 * The part that a file belongs to: its first folder, however deep it lies; at the top, itself. A
 * file outside the source is a part of its own.
 */
export const partOf = (path: string): string => {
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
export function wrongImports(sources: ReadonlyMap<string, string>, table: Table): string[] {
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
export function ringIn(graph: ReadonlyMap<string, readonly string[]>): string[] | null {
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
export function fileGraph(sources: ReadonlyMap<string, string>): Map<string, string[]> {
  const resolve = (target: string): string[] =>
    [`${target}.ts`, `${target}.tsx`, target].filter((name) => sources.has(name)).slice(0, 1);
  return new Map(
    [...sources].map(([path, text]) => [path, importsOf(path, text).flatMap(resolve)]),
  );
}
