/** Every part of the page shows the chosen moment. */
import { act as flush, render, screen } from '@testing-library/react';
import { beforeEach, expect, test, vi } from 'vitest';

import { snapshotOf } from '../domain/twin';
import { Painter } from '../map/painter';
import { act, receive, store } from '../store/app';
import { NO_HOUSE, withPast } from '../store/twin';
import { nextStamp, showTags } from '../testing/page';
import { judgement, reason } from '../testing/health';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { HealthSummary } from './HealthSummary';
import { Legend } from './Legend';
import { TagCard } from './TagCard';
import { TagTable } from './TagTable';

const tagWith = (temperature: number, sec: number, x: number): ReturnType<typeof wireTag> =>
  wireTag({
    tag_id: 'a',
    readings: readings({ temperature }, sec),
    pose: { position: { x, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } },
  });

beforeEach(() => {
  vi.stubGlobal('fetch', () => Promise.reject(new Error('no server')));
  showTags([tagWith(22, nextStamp() - 5, 1)], judgement({ a: 'healthy' }));
});

/** Text without what a screen reader or a title adds. */
const text = (testId: string): string => screen.getByTestId(testId).textContent;

const go = (moment: number | null): void => {
  flush(() => {
    act({ moment });
  });
};

test('table, card, legend, health and map are those of the moment', () => {
  const painter = new Painter({
    still: document.createElement('canvas'),
    pins: document.createElement('canvas'),
    overlay: document.createElement('canvas'),
  });
  const then = stateFrame([tagWith(40, -6_700, 3)], { sec: 500 });
  receive(
    withPast({
      at: 500,
      house: {
        ...NO_HOUSE,
        snapshot: snapshotOf(then, 0, null),
        health: judgement({ a: [reason({ value: 40, limit: 35 })] }),
      },
    }),
  );
  const pin = (): unknown => {
    const [first] = painter.scene(store.get(), performance.now()).pins;
    return [first?.texts[0], first?.at.x, first?.verdict];
  };
  act({ colouring: 'value' });
  render(
    <>
      <TagTable />
      <TagCard tagId="a" />
      <Legend kiosk={false} />
      <HealthSummary kiosk={false} />
    </>,
  );
  expect(text('tag-table')).toContain('22.0');
  expect(text('tag-card')).toContain('22.0');
  expect(text('range-high')).toContain('26.0');
  expect(screen.getByTestId('greenhouse-health').dataset['health']).toBe('healthy');
  expect(pin()).toEqual(['a · 22.0\u00a0°C', 1, 'healthy']);

  go(500);
  for (const part of ['tag-table', 'tag-card', 'range-high']) {
    expect(text(part)).toContain('40.0');
    expect(text(part)).not.toContain('22.0');
  }
  expect(text('tag-table')).toContain('2\u00a0h');
  expect(screen.getByTestId('greenhouse-health').dataset['health']).toBe('critical');
  expect(pin()).toEqual(['a · 40.0\u00a0°C', 3, 'critical']);

  go(null);
  expect(text('tag-table')).toContain('22.0');
  expect(text('tag-card')).toContain('22.0');
});
