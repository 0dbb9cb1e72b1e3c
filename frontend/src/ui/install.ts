import { route } from '../contract/api';

/** Over https, the page can be installed and opens also where the bridge cannot be reached. */
export function startShell(): void {
  if (window.location.protocol !== 'https:') return;
  navigator.serviceWorker.register(route('sw.js')).catch(() => {
    // A browser that keeps none, or a certificate that it does not trust: the page is as before.
  });
}
