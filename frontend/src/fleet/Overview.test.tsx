import { render, screen } from '@testing-library/react';
import { expect, test } from 'vitest';

import { Overview } from './Overview';
import { words } from './sites';

test('before anything has come nothing is counted', () => {
  const seen = { sites: new Map(), archive: null, lostAt: null };
  const { rerender } = render(<Overview seen={seen} isKiosk={false} />);
  expect(screen.getByRole('banner').textContent).not.toContain('0');
  rerender(<Overview seen={seen} isKiosk />);
  expect(screen.getByRole('banner').textContent).not.toContain(words.noAlarms);
  const archive = { is_reachable: true, since: null, message: '' };
  rerender(<Overview seen={{ ...seen, archive }} isKiosk />);
  expect(screen.getByRole('banner').textContent).toContain(words.noAlarms);
});
