/** The page over all greenhouses: a separate bundle. */
import { fileURLToPath } from 'node:url';

import react from '@vitejs/plugin-react';
import { defineConfig } from 'vite';

const here = (path: string): string => fileURLToPath(new URL(path, import.meta.url));

export default defineConfig({
  root: here('.'),
  base: './',
  publicDir: false,
  plugins: [react()],
  build: {
    outDir: here('../backend/lupin_bridge/static'),
    emptyOutDir: false,
    // See `vite.config.ts`.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    target: 'es2022',
    rolldownOptions: {
      input: here('fleet.html'),
      output: {
        entryFileNames: 'assets/fleet-[hash].js',
        chunkFileNames: 'assets/fleet-[name]-[hash].js',
        assetFileNames: 'assets/fleet-[name]-[hash][extname]',
      },
    },
  },
});
