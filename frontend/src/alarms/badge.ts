/** The page's icon says how many alarms are active, and how bad the worst is. */
import type { Verdict } from '../contract/types';
import { alarmList } from './watch';

/** The browser's bar of tabs follows no theme of ours: white on these is legible on any. */
const COLOURS = { critical: '#b3261e', other: '#855300' } as const;

/** An icon to load; null: that of the page itself. */
export function badgeOf(count: number, worst: Verdict): string | null {
  if (count === 0) return null;
  const text = count > 9 ? '9+' : String(count);
  const colour = worst === 'critical' ? COLOURS.critical : COLOURS.other;
  // Critical has corners, as its sign has in the page: told without colour.
  const shape =
    worst === 'critical'
      ? '<path d="M9.500 1h13L31 9.500v13L22.500 31h-13L1 22.500v-13Z"'
      : '<circle cx="16" cy="16" r="15"';
  const svg =
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32">' +
    `${shape} fill="${colour}"/>` +
    '<text x="16" y="23" text-anchor="middle" font-family="sans-serif" font-weight="700" ' +
    `font-size="${text.length > 1 ? 17 : 21}" fill="#fff">${text}</text></svg>`;
  return `data:image/svg+xml,${encodeURIComponent(svg)}`;
}

/** Keeps it so; returns the way to stop. */
export function startBadge(): () => void {
  const link = document.querySelector<HTMLLinkElement>('link[rel=icon]');
  if (!link) return () => undefined;
  const own = link.getAttribute('href') ?? '';
  const update = (): void => {
    const items = alarmList.get().active;
    const href = badgeOf(items.length, items[0]?.verdict ?? 'unknown') ?? own;
    if (link.getAttribute('href') !== href) link.setAttribute('href', href);
  };
  update();
  return alarmList.subscribe(update);
}
