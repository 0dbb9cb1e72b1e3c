import { fileURLToPath } from 'node:url';

import react from '@vitejs/plugin-react';
import { defineConfig } from 'vitest/config';

const here = (path: string): string => fileURLToPath(new URL(path, import.meta.url));

const BRIDGE = process.env['LUPIN_BRIDGE'] ?? 'http://127.0.0.1:8000';

const RULES = [
  'src/clock.test.ts',
  'src/structure.test.ts',
  'src/{domain,geometry}/**/*.test.ts',
  'src/connection/{backoff,latest,machine}.test.ts',
  'src/contract/{check,frames,npy}.test.ts',
  'src/store/{create,memo,permalink,twin,view}.test.ts',
];

export default defineConfig({
  root: here('.'),
  // Relative, so that the bridge may stand behind any path prefix.
  base: './',
  plugins: [react()],
  build: {
    outDir: here('../backend/lupin_bridge/static'),
    emptyOutDir: true,
    // A data: URL for a script, style or font would need a wider Content-Security-Policy.
    assetsInlineLimit: 0,
    // The polyfill is an inline script in some outputs; every browser of the last years preloads.
    modulePreload: { polyfill: false },
    target: 'es2022',
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
    // A machine that builds and tests at once is slow; a test that hangs still fails.
    testTimeout: 30_000,
    unstubGlobals: true,
    projects: [
      // Rules that need no page run without one: a jsdom takes longer than all their tests.
      {
        extends: true,
        test: { name: 'rules', environment: 'node', include: RULES },
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
