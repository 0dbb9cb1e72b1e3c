import { render, screen } from '@testing-library/react';
import { expect, test, vi } from 'vitest';

import { S } from '../strings';
import { Overview } from './Overview';
import { type Site, type Sites, type SitesFrame, withFrame, words } from './sites';

const GREENHOUSE: Site = {
  ...{ site: 'gh1', name: 'One', verdict: 'healthy', last_verdict: 'healthy', active_alarms: 0 },
  ...{ last_received: null, heardAt: 1, is_live: true, origin: 'robot', map: null, causes: [] },
};

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

test('of a silent greenhouse, and without a connection, nobody knows that there is no alarm', () => {
  const site = (over: Partial<Site>): Sites => new Map([['gh1', { ...GREENHOUSE, ...over }]]);
  const archive = { is_reachable: true, since: null, message: '' };
  const text = (sites: Sites, lostAt: number | null = null): string | null => {
    const { container, unmount } = render(<Overview seen={{ sites, archive, lostAt }} isKiosk />);
    const { textContent } = container;
    unmount();
    return textContent;
  };
  expect(text(site({}))).toContain(words.noAlarms);
  expect(text(site({}), 1)).not.toContain(words.noAlarms);
  expect(text(site({ is_live: false }))).not.toContain(words.noAlarms);
  expect(text(site({ active_alarms: null }))).not.toContain(words.noAlarms);
  // Nor why its status is unknown, unless its clock is ahead.
  const unknown = (ahead: number): Sites =>
    site({ verdict: 'unknown', last_received: Date.now() / 1000 + ahead });
  expect(text(unknown(700))).toContain(S.offlineWhy.clock_ahead);
  expect(text(unknown(500))).not.toContain(S.offlineWhy.clock_ahead);
});

test('since when a greenhouse is silent does not move while nothing comes from it', () => {
  vi.useFakeTimers({ now: 1_700_000_000_000 });
  const entry: Omit<Site, 'heardAt'> = GREENHOUSE;
  const archive = { is_reachable: true, since: null, message: '' };
  const frame = { type: 'sites', is_whole: true, archive, gone: [] } as const;
  const silent: SitesFrame = { ...frame, sites: [{ ...entry, is_live: false, lag_s: 60 }] };
  const sites = withFrame(new Map(), silent);
  const text = (): string | null => {
    const seen = { sites, archive, lostAt: null };
    const { container, unmount } = render(<Overview seen={seen} isKiosk />);
    const found = container.querySelector('.fleet-silent')?.textContent ?? null;
    unmount();
    return found;
  };
  const first = text();
  vi.advanceTimersByTime(3_600_000);
  // As after a search that left it out.
  expect(text()).toBe(first);
  vi.useRealTimers();
});
