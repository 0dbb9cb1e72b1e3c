/** What a screen reader is told beside what it is led to. */
import { createStore, type Store } from './create';

export interface Announcement {
  readonly text: string;
  /** Another one each time: the same words said again are news too. */
  readonly key: number;
}

/** A voice of its own, silent at first. */
export const createVoice = (): Store<Announcement, string> =>
  createStore({ text: '', key: 0 }, ({ key }: Announcement, text: string) => ({
    text,
    key: key + 1,
  }));
