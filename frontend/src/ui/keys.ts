import { PAGE } from '../store/create';
import { deferred, loadParts } from './loadDeferred';

/** Listens for the global shortcuts; a key pressed before its parts are loaded waits for them. */
export function startKeys(signal = PAGE): void {
  const onKeyDown = (event: KeyboardEvent): void => {
    const { parts } = deferred.get();
    if (parts) parts.onKey(event);
    else void loadParts().then(({ onKey }) => onKey(event));
  };
  document.addEventListener('keydown', onKeyDown, { signal });
}
