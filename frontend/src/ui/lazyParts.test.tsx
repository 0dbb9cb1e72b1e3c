import { render, screen } from '@testing-library/react';
import { expect, test, vi } from 'vitest';
import type { JSX } from 'react';

import { lazyPart } from './lazyParts';

const Greeting = ({ name }: { name: string }): JSX.Element => <p>Hello {name}</p>;

test('a part is loaded when it is first shown, once, and is given what it was given', async () => {
  const load = vi.fn(() => Promise.resolve(Greeting));
  const Part = lazyPart(load);
  expect(load).not.toHaveBeenCalled();
  render(
    <>
      <Part name="you" />
      <Part name="me" />
    </>,
  );
  await screen.findByText('Hello you');
  expect(screen.getByText('Hello me')).toBeTruthy();
  expect(load).toHaveBeenCalledTimes(1);
});

test('one that fails says so alone, and is shown again later', async () => {
  vi.useFakeTimers({ shouldAdvanceTime: true });
  vi.spyOn(console, 'error').mockImplementation(() => undefined);
  const answer: { values?: readonly string[] } = {};
  const Broken = (): JSX.Element => <p>{(answer as Required<typeof answer>).values.join()}</p>;
  const Part = lazyPart(() => Promise.resolve(Broken));
  render(
    <>
      <Part />
      <p>the map</p>
    </>,
  );
  expect((await screen.findByRole('status')).textContent).toContain("reading 'join'");
  expect(screen.getByText('the map')).toBeTruthy();
  answer.values = ['a', 'b'];
  await vi.advanceTimersByTimeAsync(10_000);
  expect(await screen.findByText('a,b')).toBeTruthy();
  vi.useRealTimers();
});

test('one that does not come says so, and what is beside it stays', async () => {
  const Part = lazyPart<{ name: string }>(() => Promise.reject(new TypeError('gone')));
  render(
    <>
      <Part name="you" />
      <p>the map</p>
    </>,
  );
  expect((await screen.findByRole('status')).textContent).toContain('Reload the page');
  expect(screen.getByText('the map')).toBeTruthy();
});
