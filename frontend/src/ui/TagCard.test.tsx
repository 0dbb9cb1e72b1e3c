import { fireEvent, render, screen } from '@testing-library/react';
import { beforeEach, describe, expect, test, vi } from 'vitest';

import { act, store } from '../store/app';
import { showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { TagCard } from './TagCard';

beforeEach(() => {
  vi.stubGlobal('fetch', () => Promise.reject(new Error('no server')));
  showTags([
    wireTag({
      tag_id: '7',
      readings: readings({ temperature: 10, co2: null, ph: 6.5 }),
      species: 'tulip',
      species_confidence: 0.8,
      anomaly: true,
      bug_count: 3,
      flower_count: 12,
    }),
  ]);
  act({ type: 'select', tagId: '7' });
});

describe('card', () => {
  test('tells everything about its tag', () => {
    render(<TagCard tagId="7" />);
    const card = screen.getByRole('complementary', { name: 'Tag 7' });
    for (const text of ['10.0\u00a0°C', 'below ideal', 'failed', '6.5', 'tulip', '80', '12']) {
      expect(card.textContent).toContain(text);
    }
    expect(card.textContent).toContain('3 bugs');
    expect(card.textContent).toContain('Critical');
    expect(card.textContent).toContain('x 1.00 m, y 2.00 m');
  });

  test('closes', () => {
    render(<TagCard tagId="7" />);
    fireEvent.click(screen.getByRole('button', { name: 'Close' }));
    expect(store.get().view.selected).toBeNull();
  });

  test('a tag that a link names and nobody knows', () => {
    render(<TagCard tagId="404" />);
    expect(screen.getByTestId('tag-card').textContent).toContain('does not list this tag');
  });

  test('draws the history that the server has', async () => {
    const stamp = (sec: number): { sec: number; nanosec: number } => ({ sec, nanosec: 0 });
    vi.stubGlobal('fetch', () =>
      Promise.resolve(
        Response.json({
          tag_id: '7',
          sensors: [
            {
              name: 'temperature',
              values: [
                { stamp: stamp(1), value: 9 },
                { stamp: stamp(2), value: 10 },
              ],
            },
          ],
        }),
      ),
    );
    render(<TagCard tagId="7" />);
    const line = await screen.findByRole('img', { name: /Last 2 readings, between 9\.0/ });
    expect(line.querySelector('polyline')).not.toBeNull();
  });
});
