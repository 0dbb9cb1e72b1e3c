import { render, screen } from '@testing-library/react';
import { expect, test } from 'vitest';

import { fleetWordsOf } from '../words/fleet';
import { Overview } from './Overview';

test('before anything has come nothing is counted', () => {
  const seen = { sites: new Map(), archive: null, lostAt: null };
  const words = fleetWordsOf('en');
  const { rerender } = render(<Overview seen={seen} words={words} isKiosk={false} />);
  expect(screen.getByRole('banner').textContent).not.toContain('0');
  rerender(<Overview seen={seen} words={words} isKiosk />);
  expect(screen.getByRole('banner').textContent).not.toContain(words.noAlarms);
  const archive = { is_reachable: true, since: null, message: '' };
  rerender(<Overview seen={{ ...seen, archive }} words={words} isKiosk />);
  expect(screen.getByRole('banner').textContent).toContain(words.noAlarms);
});
