/**
 * Prints the gzip sizes of the built scripts and styles as JSON, and fails above the budgets: the page
 * must load quickly over a greenhouse's weak Wi-Fi. There are budgets for the first view with English;
 * for what loads right after it (cards, lists, the time bar); for what loads on request (charts); for
 * the reader's one other language; and for the page over all greenhouses, and what it loads on request.
 */
import { readdir, readFile } from 'node:fs/promises';
import { gzipSync } from 'node:zlib';

const BUDGET_BYTES = {
  first: 150_000,
  deferred: 40_000,
  language: 10_000,
  later: 55_000,
  fleet: 92_000,
  fleetLater: 40_000,
};
const STATIC = new URL('../../backend/lupin_bridge/static/', import.meta.url);

const page = await readFile(new URL('index.html', STATIC), 'utf8');
const fleet = await readFile(new URL('fleet.html', STATIC), 'utf8');
/** @type {Record<string, number>} */
const sizes = {};
const total = { first: 0, deferred: 0, language: 0, later: 0, fleet: 0, fleetLater: 0 };
for (const name of await readdir(new URL('assets/', STATIC))) {
  if (!/\.(js|css)$/.test(name)) continue;
  const size = gzipSync(await readFile(new URL(`assets/${name}`, STATIC))).length;
  sizes[name] = size;
  // A reader loads only one of these.
  if (/^fleet-(de|nl|es)-/.test(name)) continue;
  if (name.startsWith('fleet-')) total[fleet.includes(name) ? 'fleet' : 'fleetLater'] += size;
  else if (/^(de|nl|es)-/.test(name)) total.language = Math.max(total.language, size);
  else if (name.startsWith('deferred-')) total.deferred += size;
  else total[page.includes(name) ? 'first' : 'later'] += size;
}
console.log(JSON.stringify({ gzip_bytes: total, budget_bytes: BUDGET_BYTES, files: sizes }));
for (const [part, size] of Object.entries(total)) {
  const allowed = BUDGET_BYTES[/** @type {keyof typeof total} */ (part)];
  if (size > 0 && size <= allowed) continue;
  console.error(`script and style (${part}): ${size} bytes gzip, allowed 1 to ${allowed}`);
  process.exitCode = 1;
}
