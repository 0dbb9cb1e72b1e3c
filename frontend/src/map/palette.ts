/** Which colours the map is drawn in: light or dark as the page is, or those of a system with few. */
import { DARK, forcedPalette, LIGHT, type Palette } from '../draw/palette';
import type { Rgb } from '../domain/ramp';
import { isDark, isPrinting, onThemeChange } from '../store/theme';

const forced = window.matchMedia('(forced-colors: active)');

export function paletteInUse(): Palette {
  // Paper has colours of its own.
  if (forced.matches && !isPrinting()) return forcedPalette(systemColour);
  return isDark() ? DARK : LIGHT;
}

/** Calls back whenever it may be another; returns the end. */
export function onPaletteChange(listener: () => void): () => void {
  const stop = onThemeChange(listener);
  forced.addEventListener('change', listener);
  return () => {
    stop();
    forced.removeEventListener('change', listener);
  };
}

function systemColour(name: string): Rgb {
  const probe = document.body.appendChild(document.createElement('i'));
  probe.style.color = name;
  const [red = 0, green = 0, blue = 0] =
    getComputedStyle(probe)
      .color.match(/[\d.]+/g)
      ?.map(Number) ?? [];
  probe.remove();
  return [red, green, blue];
}
