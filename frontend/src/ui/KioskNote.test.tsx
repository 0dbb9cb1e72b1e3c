import { render, screen } from '@testing-library/react';
import { expect, test } from 'vitest';

import { showTags } from '../testing/page';
import { KioskNote } from './AttentionList';

test('names the key that leads out and says the time, and nothing else', () => {
  showTags([]);
  render(<KioskNote />);
  expect(screen.getByTestId('kiosk-note').textContent).toMatch(/^Exit Esc\d\d:\d\d$/);
  expect(screen.getByRole('button')).toBeInstanceOf(HTMLButtonElement);
});
