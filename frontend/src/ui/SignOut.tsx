import { useEffect, useState, type JSX } from 'react';

import { canSignOut, route, signOut } from '../contract/api';
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
  const [isOffered, setOffered] = useState(false);
  useEffect(() => {
    const abort = new AbortController();
    canSignOut(abort.signal).then(setOffered, () => {
      // Without an answer there is nothing to offer.
    });
    return () => {
      abort.abort();
    };
  }, []);
  if (!isOffered) return null;
  const end = async (): Promise<void> => {
    close();
    try {
      await signOut();
    } catch (error) {
      say(S.signOutFailed(error instanceof Error ? error.message : String(error)));
      return;
    }
    leave(route('signin'));
  };
  return (
    <li>
      <button type="button" onClick={() => void end()}>
        {S.signOut}
      </button>
    </li>
  );
}

function goTo(url: URL): void {
  window.location.assign(url);
}
