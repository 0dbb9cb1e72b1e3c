import { fileURLToPath } from 'node:url';

import react from '@vitejs/plugin-react';
import { defineConfig } from 'vitest/config';

const here = (path: string): string => fileURLToPath(new URL(path, import.meta.url));

const BRIDGE = process.env['LUPIN_BRIDGE'] ?? 'http://127.0.0.1:8000';

interface Modules {
  getModuleInfo: (id: string) => { isEntry: boolean; importers: readonly string[] } | null;
}

/** Whether the first view needs a module: the entry imports it, directly or not. */
function isFirst(id: string, modules: Modules, seen = new Set<string>()): boolean {
  if (seen.has(id)) return false;
  seen.add(id);
  const info = modules.getModuleInfo(id);
  return info !== null && (info.isEntry || info.importers.some((by) => isFirst(by, modules, seen)));
}

const RULES = [
  'src/clock.test.ts',
  'src/structure.test.ts',
  'src/{domain,geometry}/**/*.test.ts',
  'src/charts/{layers,model,zoom}.test.ts',
  'src/connection/machine.test.ts',
  'src/draw/colours.test.ts',
  'src/store/{create,fetcher,twin,view}.test.ts',
  'src/timebar/axis.test.ts',
  'src/ui/{fitting,loadDeferred}.test.ts',
  'src/words/languages.test.ts',
];

export default defineConfig({
  root: here('.'),
  // Relative, so that any path prefix works.
  base: './',
  plugins: [react()],
  build: {
    outDir: here('../backend/lupin_bridge/static'),
    emptyOutDir: true,
    // A data: URL for a script, style or font would need a wider Content-Security-Policy.
    assetsInlineLimit: 0,
    // The polyfill may be an inline script, and all current browsers can preload.
    modulePreload: { polyfill: false },
    target: 'es2022',
    rolldownOptions: {
      output: {
        // One chunk: otherwise each module shared with later parts is its own file, larger in total.
        codeSplitting: {
          groups: [
            { debugName: 'first', name: (id, modules) => (isFirst(id, modules) ? 'first' : null) },
          ],
        },
      },
    },
  },
  server: {
    host: '127.0.0.1',
    proxy: {
      '/api': BRIDGE,
      '/ws': { target: BRIDGE, ws: true },
      '/readyz': BRIDGE,
      '/healthz': BRIDGE,
    },
  },
  test: {
    restoreMocks: true,
    // See src/testing/asFound.ts.
    isolate: false,
    // A busy machine is slow; a hanging test still fails.
    testTimeout: 30_000,
    unstubGlobals: true,
    projects: [
      // Tests without a page run without jsdom, which takes longer than all of them.
      {
        extends: true,
        test: {
          name: 'rules',
          environment: 'node',
          include: RULES,
          setupFiles: ['src/testing/rules.ts'],
        },
      },
      {
        extends: true,
        test: {
          name: 'page',
          environment: 'jsdom',
          include: ['src/**/*.test.{ts,tsx}'],
          exclude: RULES,
          setupFiles: ['src/testing/setup.ts'],
        },
      },
    ],
  },
});
