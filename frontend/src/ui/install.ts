import { route } from '../contract/api';

/** Over https, makes the page installable, and able to open while the bridge is unreachable. */
export function startShell(): void {
  if (window.location.protocol !== 'https:') return;
  navigator.serviceWorker.register(route('sw.js')).catch(() => {
    // No service workers, or an untrusted certificate: the page works as before.
  });
}
