import { fileURLToPath } from 'node:url';

import react from '@vitejs/plugin-react';
import { defineConfig } from 'vitest/config';

const here = (path: string): string => fileURLToPath(new URL(path, import.meta.url));

const BRIDGE = process.env['LUPIN_BRIDGE'] ?? 'http://127.0.0.1:8000';

interface Modules {
  getModuleInfo: (id: string) => { isEntry: boolean; importers: readonly string[] } | null;
}

/** Whether the page needs a module before it shows anything: the entry imports it, however far off. */
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
  // Relative, so that the bridge may stand behind any path prefix.
  base: './',
  plugins: [react()],
  // Nothing in the map is animated by d3-zoom: it gets what it needs, and nothing more.
  resolve: {
    alias: {
      'd3-transition': here('src/map/instantly.ts'),
      'd3-interpolate': here('src/map/instantly.ts'),
    },
  },
  build: {
    outDir: here('../backend/lupin_bridge/static'),
    emptyOutDir: true,
    // A data: URL for a script, style or font would need a wider Content-Security-Policy.
    assetsInlineLimit: 0,
    // The polyfill is an inline script in some outputs; every browser of the last years preloads.
    modulePreload: { polyfill: false },
    target: 'es2022',
    rolldownOptions: {
      output: {
        // In one piece: what later parts share with it would else be a file each, and more in all.
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
    // Else it is loaded as it is, and not with what stands in for its parts.
    server: { deps: { inline: ['d3-zoom'] } },
    // A machine that builds and tests at once is slow; a test that hangs still fails.
    testTimeout: 30_000,
    unstubGlobals: true,
    projects: [
      // Rules that need no page run without one: a jsdom takes longer than all their tests.
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
