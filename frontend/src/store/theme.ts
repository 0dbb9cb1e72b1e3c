import { onChange, store } from './app';

const system = window.matchMedia('(prefers-color-scheme: dark)');
const forced = window.matchMedia('(forced-colors: active)');
let printing = false;

/** On paper the pointer leaves no mark. */
export function isPrinting(): boolean {
  return printing;
}

export function isDark(): boolean {
  if (printing) return false;
  const { theme } = store.get().settings;
  return theme === 'system' ? system.matches : theme === 'dark';
}

/** Calls back whenever the colours may have changed; paper is always light. */
export function onThemeChange(listener: () => void): () => void {
  const onPrint = ({ type }: Event): void => {
    printing = type === 'beforeprint';
    listener();
  };
  const stop = onChange(({ settings }) => [settings.theme], listener);
  for (const query of [system, forced]) query.addEventListener('change', listener);
  window.addEventListener('beforeprint', onPrint);
  window.addEventListener('afterprint', onPrint);
  return () => {
    stop();
    for (const query of [system, forced]) query.removeEventListener('change', listener);
    window.removeEventListener('beforeprint', onPrint);
    window.removeEventListener('afterprint', onPrint);
  };
}

export function startTheme(): () => void {
  const apply = (): void => {
    const root = document.documentElement;
    root.dataset['theme'] = isDark() ? 'dark' : 'light';
    root.toggleAttribute('data-printing', printing);
  };
  apply();
  return onThemeChange(apply);
}
