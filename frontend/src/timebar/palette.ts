/** The bar's colours, as the style sheet has them now: light or dark, forced, or for paper. */
import type { BarPalette } from './draw';

export function readBarPalette(): BarPalette {
  const style = getComputedStyle(document.documentElement);
  const isForced = window.matchMedia('(forced-colors: active)').matches;
  const read = (name: string, forced: string): string =>
    isForced ? forced : style.getPropertyValue(`--${name}`).trim();
  const textPx = 11 * (parseFloat(style.fontSize) / 16 || 1);
  return {
    ink: read('ink', 'CanvasText'),
    muted: read('muted', 'CanvasText'),
    line: read('line', 'GrayText'),
    scan: read('bar-scan', 'CanvasText'),
    failure: read('critical', 'Highlight'),
    pest: read('critical', 'Highlight'),
    cleared: read('healthy', 'CanvasText'),
    silence: read('line-strong', 'GrayText'),
    surface: read('surface', 'Canvas'),
    font: `${textPx}px ${style.getPropertyValue('--font') || 'sans-serif'}`,
  };
}
