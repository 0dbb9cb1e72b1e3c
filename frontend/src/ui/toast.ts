import { createStore } from '../store/create';

/** A short message to the operator after an action without another visible effect. */
export const toast = createStore('');

let timer: ReturnType<typeof setTimeout> | undefined;

export function say(text: string): void {
  toast.set(text);
  clearTimeout(timer);
  timer = setTimeout(toast.set, 4_000, '');
}
