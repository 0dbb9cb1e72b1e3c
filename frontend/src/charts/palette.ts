/** The colours of charts, as the style sheet has them now: light or dark, forced, or for paper. */
export interface ChartPalette {
  readonly lines: readonly string[];
  readonly ink: string;
  readonly text: string;
  readonly grid: string;
  readonly surface: string;
  readonly ideal: string;
  readonly idealLine: string;
  readonly gap: string;
  readonly failure: string;
  readonly look: string;
  readonly moment: string;
  readonly fontPx: number;
  readonly font: string;
}

export function readPalette(element: HTMLElement): ChartPalette {
  const style = getComputedStyle(element);
  const root = getComputedStyle(document.documentElement);
  const read = (name: string): string => style.getPropertyValue(`--chart-${name}`).trim();
  // Larger where the page's text is.
  const fontPx = Math.round(11.5 * (parseFloat(root.fontSize) / 16 || 1));
  return {
    lines: Array.from({ length: 8 }, (_, index) => read(String(index + 1))),
    ink: read('ink'),
    text: read('text'),
    grid: read('grid'),
    surface: read('surface'),
    ideal: read('ideal'),
    idealLine: read('ideal-line'),
    gap: read('gap'),
    failure: read('failure'),
    look: read('look'),
    moment: read('moment'),
    fontPx,
    font: `${fontPx}px ${style.getPropertyValue('--font')}`,
  };
}
