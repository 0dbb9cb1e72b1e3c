/**
 * Strings from the wire are untrusted. React and fillText never run them as markup; this module
 * handles the rest: characters that move or hide other text, and lengths that break a layout.
 */

// C0 and C1 controls, soft hyphen, zero-width characters, line and paragraph separators, marks
// and overrides of writing direction, invisible operators, byte-order mark, tag characters. First what
// is none of these: the joiner within one emoji, such as a farmer.
const INVISIBLE =
  /(\p{Extended_Pictographic}[\ufe0f\p{Emoji_Modifier}]?\u200d(?=\p{Extended_Pictographic}))|[\p{Cc}\p{Cs}\u00ad\u061c\u180e\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb\u{e0000}-\u{e007f}]/gu;
/** More combining marks on one letter would reach into other lines. */
const STACKED_MARKS = /(\p{M}{3})\p{M}+/gu;

/**
 * Whether a tag's text, in lower case, contains every word of a filter; null: no filter. A word that
 * equals a tag's id finds only that tag.
 */
export function finder(
  text: string,
  isTag: (id: string) => boolean,
): ((tagId: string, said: string) => boolean) | null {
  const words = text.split(/\s+/).filter(Boolean);
  if (words.length === 0) return null;
  const own = words.map((word) => ({ word, lower: word.toLowerCase(), isTag: isTag(word) }));
  return (tagId, said) =>
    own.every((each) => (each.isTag ? each.word === tagId : said.includes(each.lower)));
}

const REPLACEMENT = '\ufffd';
const LONGEST = 80;
/** Replaces invisible text: a name must have something to click on. */
const BLANK = '\u2423';

/** Text fit to show: never blank, nothing invisible, marks bounded, at most `longest` characters. */
export function shown(text: string, longest = LONGEST): string {
  // Cut first, to avoid cleaning a megabyte for eighty characters.
  const clean = text
    .slice(0, longest * 8)
    .replace(INVISIBLE, (found, emoji?: string) => (emoji ? found : REPLACEMENT))
    .replace(STACKED_MARKS, '$1')
    .trim();
  if (clean === '') return BLANK;
  const letters = Array.from(clean);
  return letters.length > longest ? `${letters.slice(0, longest - 1).join('')}…` : clean;
}

export type Cell = string | number | null;

/**
 * RFC 4180 with a byte-order mark, which spreadsheets need for "°". Text that a spreadsheet
 * would run as a formula gets an apostrophe in front (OWASP, "CSV Injection"); numbers stay
 * numbers, negative ones too.
 */
export function csv(rows: readonly (readonly Cell[])[]): string {
  return '\ufeff' + rows.map((row) => row.map(cellText).join(',') + '\r\n').join('');
}

function cellText(cell: Cell): string {
  if (cell === null) return '';
  if (typeof cell === 'number') return Number.isFinite(cell) ? String(cell) : '';
  const safe = /^\s*[=+\-@\t\r]/.test(cell) ? `'${cell}` : cell;
  return /[",\r\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}
