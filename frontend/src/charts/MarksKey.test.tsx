import { render, screen } from '@testing-library/react';
import { expect, test } from 'vitest';

import { MarksKey } from './PlotView';

test('says what the marks are, and how many; where there are none, nothing', () => {
  const mark = { at: 1, widthS: 0, count: 2 } as const;
  const { rerender } = render(<MarksKey marks={[]} />);
  expect(screen.queryByTestId('marks-key')).toBeNull();
  const all = [mark, { ...mark, count: 1 }].map((each) => ({ ...each, kind: 'look' as const }));
  rerender(<MarksKey marks={[...all, { ...mark, kind: 'failure' }]} />);
  expect(screen.getByTestId('marks-key').textContent).toBe(
    '○ 3 flower inspections✕ 2 failed attempts',
  );
  rerender(<MarksKey marks={all} />);
  expect(screen.getByTestId('marks-key').textContent).toBe('○ 3 flower inspections');
});
