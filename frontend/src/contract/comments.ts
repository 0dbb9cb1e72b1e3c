/** What people said in free words: the bridge's notes of the kind `comment`. */
import { ask, get, read } from './api';
import { list, object, orNull, text } from './check';
import { OWN } from './people';
import { TEXT, TIME } from './shapes';
import type { Note, Notes } from './types';

/** More than the bridge sends, and more characters than it takes. */
const MOST = 2_000;
const NOTES = object({
  notes: list(
    object({
      id: TEXT,
      subject: TEXT,
      text: text(MOST),
      by: TEXT,
      made_at: TIME,
      until: orNull(TIME),
      withdrawn_by: orNull(TEXT),
    }),
    MOST,
  ),
});

/** The newest first, withdrawn ones too. */
export async function fetchComments(signal: AbortSignal): Promise<readonly Note[]> {
  const response = await get('api/notes?kind=comment', signal);
  return (await read<Notes>('notes', NOTES, response)).notes;
}

export async function withdrawComment(id: string): Promise<void> {
  await ask(`api/notes/${encodeURIComponent(id)}`, { method: 'DELETE', headers: OWN });
}
