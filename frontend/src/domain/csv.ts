/** A cell: text, a number, or nothing. */
export type Cell = string | number | null;

/**
 * RFC 4180 with a byte-order mark, which spreadsheets want for "°". Text that a spreadsheet
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
