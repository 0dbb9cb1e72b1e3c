import { later, loadParts } from './later';

/** Listens for the keys that work anywhere; one that comes before what it is for waits for that. */
export function startKeys(): () => void {
  const onKeyDown = (event: KeyboardEvent): void => {
    const { parts } = later.get();
    if (parts) {
      parts.onKey(event);
      return;
    }
    void loadParts().then(({ onKey }) => {
      onKey(event);
    });
  };
  document.addEventListener('keydown', onKeyDown);
  return () => {
    document.removeEventListener('keydown', onKeyDown);
  };
}
