import { onChange, store } from './app';

const system = window.matchMedia('(prefers-color-scheme: dark)');
let printing = false;

/** Paper gets what holds still: nothing that pulses, and no mark of the mouse. */
export function isPrinting(): boolean {
  return printing;
}

export function isDark(): boolean {
  if (printing) return false;
  const { theme } = store.get().settings;
  return theme === 'system' ? system.matches : theme === 'dark';
}

/** Calls back whenever the theme in use may have changed; paper is always light. */
export function onThemeChange(listener: () => void): () => void {
  const onPrint = ({ type }: Event): void => {
    printing = type === 'beforeprint';
    listener();
  };
  const stop = onChange(({ settings }) => [settings.theme], listener);
  system.addEventListener('change', listener);
  window.addEventListener('beforeprint', onPrint);
  window.addEventListener('afterprint', onPrint);
  return () => {
    stop();
    system.removeEventListener('change', listener);
    window.removeEventListener('beforeprint', onPrint);
    window.removeEventListener('afterprint', onPrint);
  };
}

/** Keeps the document's `data-theme` in step; the style sheets follow it. */
export function startTheme(): () => void {
  const apply = (): void => {
    document.documentElement.dataset['theme'] = isDark() ? 'dark' : 'light';
  };
  apply();
  return onThemeChange(apply);
}
