import type { Session } from '../contract/types';
import { createStore } from './create';

/** Who is signed in; null: not known yet. */
export const person = createStore<Session | null, Session | null>(null, (_, next) => next);
