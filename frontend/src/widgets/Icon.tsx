import type { JSX } from 'react';

const PATHS = {
  plus: 'M12 5v14M5 12h14',
  minus: 'M5 12h14',
  chevron: 'm6 9 6 6 6-6',
  dots: 'M5 12h.01M12 12h.01M19 12h.01',
  fit: 'M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5',
  layers: 'M12 3 3 8l9 5 9-5-9-5ZM3 12.5l9 5 9-5M3 17l9 5 9-5',
  menu: 'M4 7h16M4 12h16M4 17h16',
  columns: 'M4 5h16v14H4ZM9.5 5v14M14.5 5v14',
  close: 'M6 6l12 12M18 6 6 18',
  download: 'M12 4v11m0 0-4-4m4 4 4-4M5 20h14',
  search: 'M11 4a7 7 0 1 0 0 14 7 7 0 0 0 0-14Zm5 12 4 4',
  map: 'M9 4 3 6v14l6-2 6 2 6-2V4l-6 2-6-2Zm0 0v14m6-12v14',
  list: 'M8 6h12M8 12h12M8 18h12M4 6h.01M4 12h.01M4 18h.01',
  up: 'M12 19V5m0 0-6 6m6-6 6 6',
  down: 'M12 5v14m0 0 6-6m-6 6-6-6',
  chart: 'M4 4v16h16M7 15l4-5 3 3 5-7',
  bell: 'M6 17V11a6 6 0 0 1 12 0v6M4 17h16M10 20.500h4M12 5V3',
  later: 'M12 4a8 8 0 1 0 0 16 8 8 0 0 0 0-16Zm0 4v4l3 2',
  check: 'M5 12.500l4.500 4.500L19 7',
  pin: 'M12 3l7 9-7 9-7-9 7-9Z',
} as const;

export type IconName = keyof typeof PATHS;

/** A line drawing; always beside a text or inside a labelled button, so hidden from readers. */
export function Icon({ name, size = 20 }: { name: IconName; size?: number }): JSX.Element {
  return (
    <svg className="icon" viewBox="0 0 24 24" width={size} height={size} aria-hidden="true">
      <path d={PATHS[name]} />
    </svg>
  );
}
