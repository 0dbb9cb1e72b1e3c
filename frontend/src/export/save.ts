import { momentText } from '../domain/format';
import { hasDate, rosText } from '../domain/time';

export function save(blob: Blob, name: string): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  // By then the download holds its own reference; a minute is enough for a slow start.
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

export const saveCsv = (
  kind: string,
  text: string,
  epochMs: number,
  moment?: number | null,
): void => {
  save(
    new Blob([text], { type: 'text/csv;charset=utf-8' }),
    fileName(kind, 'csv', epochMs, moment),
  );
};

/**
 * A file name that sorts by time and is valid on every system, in local time: 2026-05-01T14-03-22.
 * With a past `moment`, ROS seconds, it has that time and "-past".
 */
export function fileName(
  kind: string,
  extension: string,
  epochMs: number,
  moment: number | null = null,
): string {
  const at = moment ?? epochMs / 1000;
  const time = hasDate(at) ? momentText(at * 1000) : rosText(at);
  const stamp = time.replace(' ', /^\d/.test(time) ? 'T' : '-').replaceAll(':', '-');
  return `lupin-twin-${kind}${moment === null ? '' : '-past'}-${stamp}.${extension}`;
}
