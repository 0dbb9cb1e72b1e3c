import { useEffect } from 'react';

import { startComments } from './comments';

let users = 0;
let stop = (): void => undefined;

/** Keeps the comments up to date while anybody shows them. */
export function useComments(): void {
  useEffect(() => {
    users += 1;
    if (users === 1) stop = startComments();
    return () => {
      users -= 1;
      if (users === 0) stop();
    };
  }, []);
}
