import { flushSync } from 'react-dom';

import { timeOfDay } from '../clock';
import { onChange, store } from './app';
import { createStore, PAGE } from './create';

const system = window.matchMedia('(prefers-color-scheme: dark)');
const forced = window.matchMedia('(forced-colors: active)');

/** Since when the page is being printed, ms since the epoch; null: it is not. */
export const printing = createStore<number | null>(null);

// Render synchronously: `window.print` takes the page before it returns to the script that called it.
window.addEventListener('beforeprint', () => flushSync(() => printing.set(timeOfDay())));
window.addEventListener('afterprint', () => printing.set(null));

/** On paper the pointer leaves no mark. */
export const isPrinting = (): boolean => printing.get() !== null;

export function isDark(): boolean {
  if (isPrinting()) return false;
  const { theme } = store.get().settings;
  return theme === 'system' ? system.matches : theme === 'dark';
}

/** Calls back whenever the colours may have changed; paper is always light. */
export function onThemeChange(listener: () => void, signal: AbortSignal): void {
  onChange(({ settings }) => [settings.theme], listener, signal);
  printing.subscribe(listener, signal);
  for (const query of [system, forced]) query.addEventListener('change', listener, { signal });
}

export function startTheme(signal = PAGE): void {
  const apply = (): void => {
    const root = document.documentElement;
    root.dataset['theme'] = isDark() ? 'dark' : 'light';
    root.toggleAttribute('data-printing', isPrinting());
  };
  apply();
  onThemeChange(apply, signal);
}
