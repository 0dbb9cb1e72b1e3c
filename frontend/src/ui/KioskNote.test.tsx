import { render, screen } from '@testing-library/react';
import { expect, test } from 'vitest';

import { showTags } from '../testing/page';
import { KioskNote } from './AttentionList';

const NONE = { seconds: null, refused: null };

test('names the key that leads out and says the time, and nothing else without a round', () => {
  showTags([]);
  render(<KioskNote cycle={NONE} />);
  expect(screen.getByTestId('kiosk-note').textContent).toMatch(/^Exit Esc\d\d:\d\d$/);
  expect(screen.getByRole('button')).toBeInstanceOf(HTMLButtonElement);
});

test('an invalid cycle is reported, with its limits and cut to fit', () => {
  showTags([]);
  render(<KioskNote cycle={{ seconds: null, refused: 'x'.repeat(500) }} />);
  const said = screen.getByRole('status').textContent;
  expect(said).toContain('5 to 3600 seconds');
  expect(said.length).toBeLessThan(120);
});
