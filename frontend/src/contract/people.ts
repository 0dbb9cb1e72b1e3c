/** The bridge's routes for people: who is signed in, and what they say. */
import { ask, get, read } from './api';
import type { Note, Session } from './types';

/** A header of our own: no form and no picture of another page can send one. */
export const OWN = { 'X-Lupin-Twin': '1' };

export async function fetchSession(signal: AbortSignal): Promise<Session> {
  return read('Session', await get('api/session', signal));
}

/** Ends the session, and with it the sockets that it has open. */
export async function signOut(): Promise<void> {
  await ask('api/signout', { method: 'POST', headers: OWN });
}

export interface Draft {
  readonly kind: 'acknowledge' | 'shelve' | 'comment';
  readonly subject: string;
  readonly text?: string;
  /** ROS seconds. Of shelve its end, null: not any more; of comment the moment that it is about. */
  readonly until?: string | null;
}

export async function postNote(note: Draft): Promise<void> {
  await ask('api/notes', {
    method: 'POST',
    headers: { ...OWN, 'Content-Type': 'application/json' },
    body: JSON.stringify(note),
  });
}

/** Takes the word back that stands of a subject, if there is one. */
export async function withdrawNote(kind: Draft['kind'], subject: string): Promise<void> {
  const query = new URLSearchParams({ subject }).toString();
  const response = await get(`api/notes?${query}`, new AbortController().signal);
  const { notes } = await read('Notes', response);
  const note = notes.find((each) => each.kind === kind && each.withdrawn_by === null);
  if (note) {
    await ask(`api/notes/${encodeURIComponent(note.id)}`, { method: 'DELETE', headers: OWN });
  }
}

/** What people said in free words: the bridge's notes of the kind `comment`. */

/** The newest first, withdrawn ones too. */
export async function fetchComments(signal: AbortSignal): Promise<readonly Note[]> {
  const response = await get('api/notes?kind=comment', signal);
  return (await read('Notes', response)).notes;
}

export async function withdrawComment(id: string): Promise<void> {
  await ask(`api/notes/${encodeURIComponent(id)}`, { method: 'DELETE', headers: OWN });
}
