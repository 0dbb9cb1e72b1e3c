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

/** A name that sorts by time and is legal everywhere, local time: 2026-05-01T14-03-22. */
export function fileName(kind: string, extension: string, epochMs: number): string {
  return named(kind, extension, momentText(epochMs));
}

/** The same for what was at a moment in the past, ROS seconds; the name says so. */
export function pastFileName(kind: string, extension: string, moment: number): string {
  const time = hasDate(moment) ? momentText(moment * 1000) : rosText(moment);
  return named(`${kind}-past`, extension, time);
}

function named(kind: string, extension: string, time: string): string {
  const stamp = time.replace(' ', /^\d/.test(time) ? 'T' : '-').replaceAll(':', '-');
  return `lupin-twin-${kind}-${stamp}.${extension}`;
}
