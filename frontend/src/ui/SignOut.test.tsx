import { fireEvent, render, screen, waitFor } from '@testing-library/react';
import { expect, test, vi } from 'vitest';

import type { Session } from '../contract/types';
import { person, useSelected } from '../store/create';
import { SignOut } from './Menu';
import { toast } from './toast';

const server = (session: Session | null, status = 204): string[] => {
  person.set(session);
  const requests: string[] = [];
  vi.stubGlobal('fetch', (url: URL, { method = 'GET', headers }: RequestInit) => {
    const own = new Headers(headers).has('X-Lupin-Twin') ? ' by us' : '';
    requests.push(`${method} ${url.pathname}${own}`);
    return Promise.resolve(new Response(null, { status, statusText: 'No' }));
  });
  return requests;
};

const SESSION: Session = {
  ...{ can_sign_out: true, seconds_left: 60 },
  ...{ name: null, role: 'viewer', can_write_notes: false },
};

const Toast = (): string => useSelected(toast);

test('a session can be ended, and the page leaves', async () => {
  const requests = server(SESSION);
  const [close, leave] = [vi.fn(), vi.fn<(url: URL) => void>()];
  render(<SignOut close={close} leave={leave} />);
  fireEvent.click(await screen.findByRole('button', { name: 'Sign out' }));
  await waitFor(() => {
    expect(leave.mock.lastCall?.[0].pathname).toBe('/signin');
  });
  expect(requests).toEqual(['POST /api/signout by us']);
  expect(close).toHaveBeenCalledOnce();
});

test('one that cannot be ended is said to go on', async () => {
  server(SESSION, 403);
  const leave = vi.fn();
  render(
    <>
      <SignOut close={() => undefined} leave={leave} />
      <Toast />
    </>,
  );
  fireEvent.click(await screen.findByRole('button', { name: 'Sign out' }));
  expect(await screen.findByText(/You are still signed in: 403/)).toBeTruthy();
  expect(leave).not.toHaveBeenCalled();
});

test.each([[{ ...SESSION, can_sign_out: false }], [null]])(
  'without a session there is nothing to offer: %j',
  (session) => {
    const requests = server(session);
    render(<SignOut close={() => undefined} />);
    expect(screen.queryByRole('button')).toBeNull();
    expect(requests).toEqual([]);
  },
);
