import { createStore } from '../store/create';

/** A short word to the operator after something that shows no other effect. */
export const toast = createStore('', (_: string, next: string) => next);

let timer: ReturnType<typeof setTimeout> | undefined;

export function say(text: string): void {
  toast.dispatch(text);
  clearTimeout(timer);
  timer = setTimeout(toast.dispatch, 4_000, '');
}
