import { expect, test } from 'vitest';

import { act, receive } from '../store/app';
import { withState } from '../store/twin';
import { withTag } from '../store/view';
import { stateFrame, wireTag } from '../testing/tags';
import { timelineWith } from '../testing/timeline';
import { reported, reportLink, viewAddress } from './actions';

test('the address of a view needs no address bar, which waits during playback', () => {
  act(withTag('a/b #'));
  act({ moment: 9 });
  const { origin, pathname } = window.location;
  expect(viewAddress()).toBe(`${origin}${pathname}#at=9&tag=a%2Fb+%23`);
  expect(viewAddress({ lang: 'es' })).toBe(`${origin}${pathname}?lang=es#at=9&tag=a%2Fb+%23`);
});

const HOUR = 3_600;
const DAY = 24 * HOUR;
const NOW = 100 * DAY + 0.75;

test.each([
  [null, { from: 100 * DAY - 8 * HOUR, to: 100 * DAY }],
  [
    { from: 5.5, to: 9.9 },
    { from: 5, to: 9 },
  ],
  [
    { from: 99 * DAY, to: 200 * DAY },
    { from: 99 * DAY, to: 100 * DAY },
  ],
  [
    { from: 0, to: 100 * DAY },
    { from: 69 * DAY, to: 100 * DAY },
  ],
  [
    { from: 7.2, to: 7.4 },
    { from: 6, to: 7 },
  ],
])('the report of %o is one that the bridge gives', (span, right) => {
  expect(reported(span, NOW)).toEqual(right);
});

test('is that of the last eight hours until a period is chosen on the time bar', () => {
  const query = (): URLSearchParams => new URL(reportLink(), document.baseURI).searchParams;
  const length = (): number => Number(query().get('to')) - Number(query().get('from'));
  expect(query().has('from')).toBe(false);
  const latest = stateFrame([wireTag()], { sec: 1_777_620_802 });
  receive(withState(latest, performance.now()));
  expect(length()).toBe(8 * HOUR);
  expect(query().get('lang')).toBe('en');
  expect(query().get('time_zone')).toBe(new Intl.DateTimeFormat().resolvedOptions().timeZone);
  act({ period: { kind: 'hour' } });
  expect(length()).toBe(HOUR);
  act({ period: { kind: 'own', from: 1_777_000_000, to: 1_777_000_900 } });
  expect([query().get('from'), query().get('to')]).toEqual(['1777000000', '1777000900']);
  const value = timelineWith({ reach: { from: 1_777_020_802, to: 1_777_620_802 } });
  receive({ remembered: { value, state: 'ready', message: '' } });
  act({ period: { kind: 'all' } });
  expect(length()).toBe(600_000);
});
