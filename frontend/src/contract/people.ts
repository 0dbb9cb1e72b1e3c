/** The bridge's routes for people: who is signed in, and their notes. */
import { answer, request } from './api';
import type { Note, Notes, Session } from './types';

/** Our own header: no form or picture of another page can send it. */
const OWN = { 'X-Lupin-Twin': '1' };

export const fetchSession = (signal: AbortSignal): Promise<Session> =>
  answer(signal, 'api/session', ['can_write_notes']);

/** Ends the session and its open sockets. */
export async function signOut(): Promise<void> {
  await request('api/signout', { method: 'POST', headers: OWN });
}

interface Draft {
  readonly kind: 'acknowledge' | 'shelve' | 'comment';
  readonly subject: string;
  readonly text?: string;
  /** ROS seconds. For shelve its end, null: ended; for comment the moment that it is about. */
  readonly until?: string | null;
}

const post = async (path: string, body: object): Promise<void> => {
  const headers = { ...OWN, 'Content-Type': 'application/json' };
  await request(path, { method: 'POST', headers, body: JSON.stringify(body) });
};

export const postNote = (note: Draft): Promise<void> => post('api/notes', note);

/** Subscribes a browser to notifications; with its endpoint alone, unsubscribes it. */
export const postPush = (body: PushSubscriptionJSON): Promise<void> => post('api/push', body);

/** Withdraws the current note on a subject, if there is one. */
export async function withdrawNote(kind: Draft['kind'], subject: string): Promise<void> {
  const { signal } = new AbortController();
  const { notes } = await answer<Notes>(signal, 'api/notes', ['notes'], { subject });
  const note = notes.find((each) => each.kind === kind && each.withdrawn_by === null);
  if (note) await withdrawComment(note.id);
}

/** The latest first, including withdrawn ones. */
export const fetchNotes = async (signal: AbortSignal): Promise<readonly Note[]> =>
  (await answer<Notes>(signal, 'api/notes', ['notes'])).notes;

export async function withdrawComment(id: string): Promise<void> {
  await request(`api/notes/${encodeURIComponent(id)}`, { method: 'DELETE', headers: OWN });
}
