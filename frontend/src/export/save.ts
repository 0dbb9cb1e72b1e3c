import { momentText } from '../domain/format';
import { hasDate, rosText } from '../domain/time';

export function save(blob: Blob, name: string): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  // The download has its own reference by then; a minute is ample for a slow one to start.
  setTimeout(() => {
    URL.revokeObjectURL(link.href);
  }, 60_000);
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
 * A name that sorts by time and is legal everywhere, local time: 2026-05-01T14-03-22. `moment`, ROS
 * seconds: of what was then, and the name says so.
 */
export function fileName(
  kind: string,
  extension: string,
  epochMs: number,
  moment: number | null = null,
): string {
  const at = moment === null ? epochMs : moment * 1000;
  const time = moment === null || hasDate(moment) ? momentText(at) : rosText(moment);
  const stamp = time.replace(' ', /^\d/.test(time) ? 'T' : '-').replaceAll(':', '-');
  return `lupin-twin-${kind}${moment === null ? '' : '-past'}-${stamp}.${extension}`;
}
