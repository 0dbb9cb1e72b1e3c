import { route } from '../contract/api';

/**
 * Leaves for the sign-in page if the server asks for a token: a refused WebSocket does not tell a
 * page why, so one more question does. A server that is merely away changes nothing.
 */
export async function signInIfAsked(leave: (url: URL) => void = goTo): Promise<void> {
  const answer = await fetch(route('readyz'), { cache: 'no-store' }).catch(() => null);
  if (answer?.status === 401) leave(route('signin'));
}

function goTo(url: URL): void {
  location.assign(url);
}
