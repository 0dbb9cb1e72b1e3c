import { act as flush, render, screen } from '@testing-library/react';
import { beforeEach, describe, expect, test } from 'vitest';

import { canvasPoint } from '../geometry/coordinates';
import { pinUnderMouse } from '../map/commands';
import { act } from '../store/app';
import { withTag } from '../store/view';
import { judgement, reason } from '../testing/health';
import { showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { HoverCard } from './extras';

const point = (tagId: string | null, x = 100): void => {
  flush(() => {
    pinUnderMouse.set(
      tagId === null
        ? null
        : { tagId, at: canvasPoint(x, 80), reach: 9, within: { width: 600, height: 400 } },
    );
  });
};
const card = (): HTMLElement | null => screen.queryByTestId('hover-card');

beforeEach(() => {
  point(null);
  const said = judgement({
    7: [
      reason({ value: 40, limit: 35 }),
      reason({ kind: 'pest', sensor: '', value: 2, limit: null }),
      reason({ kind: 'reading_failed', verdict: 'stressed', sensor: 'co2', value: null }),
      reason({ kind: 'old', verdict: 'unknown', sensor: 'humidity', value: null, limit: 600 }),
    ],
  });
  const tags = [
    wireTag({
      tag_id: '7',
      readings: readings({ humidity: 60, co2: null, temperature: 40 }),
      species: 'lupin',
      anomaly: true,
      bug_count: 2,
    }),
    wireTag({
      tag_id: 'many',
      readings: readings(Object.fromEntries(Array.from({ length: 11 }, (_, i) => [`s${i}`, i]))),
    }),
  ];
  showTags(tags, said);
});

describe('card of the pin under the mouse', () => {
  test('shows the tag’s card in short, the chosen sensor first', () => {
    render(<HoverCard />);
    expect(card()).toBeNull();
    point('7');
    const text = card()?.textContent;
    expect(text).toContain('Tag 7Critical');
    expect(text).toContain('2 pests seenCO₂: the sensor returns no value1 more');
    expect(text).toMatch(
      /Temperature40\.0\u00a0°C too high by 14\.0\u00a0°C \d\u00a0sHumidity60\.0\u00a0% ideal \d\u00a0sCO₂failed +\d\u00a0s/,
    );
    expect(text).toContain('Lupin');
    point(null);
    expect(card()).toBeNull();
  });

  test('is for the eyes alone, and stands beside the pin', () => {
    render(<HoverCard />);
    point('7');
    expect(card()?.getAttribute('aria-hidden')).toBe('true');
    expect(card()?.style.transform).toBe('translate(119px, 80px)');
    point('7', 200);
    expect(card()?.style.transform).toBe('translate(219px, 80px)');
  });

  test('a tag of many sensors does not grow out of the map', () => {
    render(<HoverCard />);
    point('many');
    expect(card()?.querySelectorAll('[data-sensor]')).toHaveLength(8);
    expect(card()?.textContent).toContain('3 more');
  });

  test('the chosen tag has its own card already', () => {
    render(<HoverCard />);
    act(withTag('7'));
    point('7');
    expect(card()).toBeNull();
  });
});
