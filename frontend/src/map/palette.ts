/** Which colours the map is drawn in: light or dark as the page is, or those of a system with few. */
import { DARK, forcedPalette, LIGHT, type Palette } from '../draw/palette';
import type { Rgb } from '../domain/ramp';
import { isDark, isForced } from '../store/theme';

export const paletteInUse = (): Palette =>
  isForced() ? forcedPalette(systemColour) : isDark() ? DARK : LIGHT;

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
