/**
 * Prints the gzip size of the built script and style as JSON, and fails above the budget.
 * The page must arrive quickly over a greenhouse's weak Wi-Fi.
 */
import { readdir, readFile } from 'node:fs/promises';
import { gzipSync } from 'node:zlib';

const BUDGET_BYTES = 150_000;
const ASSETS = new URL('../../backend/lupin_bridge/static/assets/', import.meta.url);

/** @type {Record<string, number>} */
const sizes = {};
for (const name of await readdir(ASSETS)) {
  if (/\.(js|css)$/.test(name)) {
    sizes[name] = gzipSync(await readFile(new URL(name, ASSETS))).length;
  }
}
const total = Object.values(sizes).reduce((sum, size) => sum + size, 0);
console.log(JSON.stringify({ total_gzip_bytes: total, budget_bytes: BUDGET_BYTES, files: sizes }));
if (total === 0 || total > BUDGET_BYTES) {
  console.error(`script and style: ${total} bytes gzip, allowed 1 to ${BUDGET_BYTES}`);
  process.exitCode = 1;
}
