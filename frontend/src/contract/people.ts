/** The bridge's routes for people: who is signed in, and what they say. */
import { answer, ask } from './api';
import type { Note, Session } from './types';

/** A header of our own: no form and no picture of another page can send one. */
const OWN = { 'X-Lupin-Twin': '1' };

export const fetchSession = (signal: AbortSignal): Promise<Session> =>
  answer('Session', signal, 'api/session');

/** Ends the session, and with it the sockets that it has open. */
export async function signOut(): Promise<void> {
  await ask('api/signout', { method: 'POST', headers: OWN });
}

interface Draft {
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
  const { signal } = new AbortController();
  const { notes } = await answer('Notes', signal, 'api/notes', { subject });
  const note = notes.find((each) => each.kind === kind && each.withdrawn_by === null);
  if (note) await withdrawComment(note.id);
}

/** The newest first, withdrawn ones too. */
export const fetchComments = async (signal: AbortSignal): Promise<readonly Note[]> =>
  (await answer('Notes', signal, 'api/notes', { kind: 'comment' })).notes;

export async function withdrawComment(id: string): Promise<void> {
  await ask(`api/notes/${encodeURIComponent(id)}`, { method: 'DELETE', headers: OWN });
}
