import { useEffect, useState, type JSX } from 'react';

import { route } from '../contract/api';
import { fetchSession, signOut } from '../contract/people';
import type { Session } from '../contract/types';
import { failureText } from '../domain/format';
import { S } from '../strings';
import { say } from './toast';

/** The menu's last entry, where there is a session to end. */
export function SignOut({
  close,
  leave = goTo,
}: {
  close: () => void;
  leave?: (url: URL) => void;
}): JSX.Element | null {
  const [session, setSession] = useState<Session | null>(null);
  useEffect(() => {
    const abort = new AbortController();
    fetchSession(abort.signal).then(setSession, () => {
      // Without an answer there is nothing to offer.
    });
    return () => {
      abort.abort();
    };
  }, []);
  if (!session?.can_sign_out) return null;
  const end = async (): Promise<void> => {
    close();
    try {
      await signOut();
    } catch (error) {
      say(S.signOutFailed(failureText(error)));
      return;
    }
    leave(route('signin'));
  };
  return (
    <li>
      <button type="button" onClick={() => void end()}>
        {S.signOut}
        {session.name && (
          <>
            {' '}
            <bdi data-testid="person">({session.name})</bdi>
          </>
        )}
      </button>
    </li>
  );
}

function goTo(url: URL): void {
  window.location.assign(url);
}
