/** What people said in free words: the bridge's notes of the kind `comment`. */
import { ask, get, read } from './api';
import { OWN } from './people';
import type { Note } from './types';

/** The newest first, withdrawn ones too. */
export async function fetchComments(signal: AbortSignal): Promise<readonly Note[]> {
  const response = await get('api/notes?kind=comment', signal);
  return (await read('Notes', response)).notes;
}

export async function withdrawComment(id: string): Promise<void> {
  await ask(`api/notes/${encodeURIComponent(id)}`, { method: 'DELETE', headers: OWN });
}
