import { Refusal } from '../contract/api';
import { S } from '../strings';

const TIMEOUT = 504;

/** Why something could not be had: what may pass soon in the reader's language, else as it was said. */
export function failureText(error: unknown): string {
  // A server that is busy says when to ask again. Where no answer comes at all, `fetch` throws a TypeError.
  const isPassing =
    error instanceof Refusal
      ? error.retryAfterS !== null || error.status === TIMEOUT
      : error instanceof TypeError;
  if (isPassing) return S.serverBusy;
  return error instanceof Error ? error.message : String(error);
}
