import { act as flush, fireEvent, render, screen } from '@testing-library/react';
import { beforeEach, describe, expect, test, vi } from 'vitest';

import { filledTag } from '../contract/frames';
import { act, receive, store } from '../store/app';
import { withTag } from '../store/view';
import { NO_HOUSE, withPast, withState } from '../store/twin';
import { held, judgement, reason } from '../testing/health';
import { nextStamp, showTags } from '../testing/page';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { TagCard } from './TagCard';
import { TagTable } from './TagTable';

beforeEach(() => {
  vi.stubGlobal('fetch', () => Promise.reject(new Error('no server')));
  const said = judgement({
    7: [
      reason({ value: 9, limit: 10 }),
      reason({ kind: 'pest', sensor: '', value: 3, limit: null }),
    ],
  });
  const tags = [
    wireTag({
      tag_id: '7',
      readings: readings({ temperature: 9, co2: null, ph: 6.5 }),
      species: 'Tulip',
      species_confidence: 0.8,
      anomaly: true,
      bug_count: 3,
      flower_count: 12,
    }),
  ];
  showTags(tags, said);
  act(withTag('7'));
});

describe('card', () => {
  test('while a moment loads it denies no tag', () => {
    act({ moment: 500 });
    receive(withPast({ at: 500, house: NO_HOUSE }));
    render(<TagCard tagId="7" />);
    expect(screen.getByTestId('tag-card').textContent).toBe('Tag 7');
  });

  test('gives the focus back to where it opened from', () => {
    render(<button type="button">row</button>);
    screen.getByText('row').focus();
    const { unmount } = render(<TagCard tagId="7" />);
    screen.getByRole('button', { name: 'Close' }).focus();
    unmount();
    expect(document.activeElement).toBe(screen.getByText('row'));
  });

  test('shows everything about its tag', () => {
    render(<TagCard tagId="7" />);
    const card = screen.getByRole('complementary', { name: 'Tag 7' });
    for (const text of [
      '9.0\u00a0°C',
      'low, daytime ideal',
      'failed',
      '6.5',
      'Tulip',
      '80',
      '12',
    ]) {
      expect(card.textContent).toContain(text);
    }
    expect(card.textContent).toContain('3 pests seen');
    expect(card.textContent).toContain('pests seenInspect and treat the plants');
    expect(card.textContent).toContain('Critical');
    // Until the next inspection, however long ago this one was: its alarm is not listed any more.
    const looked_at = nextStamp() - 9 * 86_400 - 60;
    const pest = reason({ kind: 'pest', sensor: '', value: 3, limit: null });
    flush(() => {
      showTags([wireTag({ tag_id: '7', looked_at })], judgement({ 7: [pest] }));
      act(withTag('7'));
    });
    expect(card.textContent).toContain('3 pests seen (9\u00a0d ago)');
    expect(card.textContent).toContain('x 1.00 m, y 2.00 m');
  });

  test('below half sure of its species it says so, and names the ideal range of all', () => {
    const unsure = { species: 'Tulip', species_confidence: 0.49 };
    showTags([wireTag({ tag_id: '7', ...unsure, readings: readings({ temperature: 9 }) })]);
    render(<TagCard tagId="7" />);
    expect(document.querySelector('.card-ideal')?.textContent).toContain('18.0\u00a0to\u00a026.0');
    expect(screen.getByRole('complementary').textContent).toContain(
      'Tulip 49\u00a0% certain (uncertain)',
    );
  });

  test('names the ideal range of its species, and whether it is that of day or night', () => {
    const tags = [
      wireTag({
        tag_id: '7',
        species: 'Tulip',
        species_confidence: 0.5,
        readings: readings({ temperature: 9, soil_moisture: 30 }),
      }),
    ];
    const ideals = (): (string | null)[] =>
      [...document.querySelectorAll('.card-ideal')].map(({ textContent }) => textContent);
    showTags(tags, judgement({ 7: 'healthy' }));
    const { unmount } = render(<TagCard tagId="7" />);
    expect(ideals()).toEqual([
      'daytime ideal 12.0\u00a0to\u00a020.0\u00a0°C',
      'ideal 25.0\u00a0to\u00a060.0\u00a0%',
    ]);
    unmount();
    showTags(tags, judgement({ 7: 'healthy' }, { is_day: false, source: 'light' }));
    render(<TagCard tagId="7" />);
    expect(ideals()[0]).toBe('night-time ideal 8.0\u00a0to\u00a018.0\u00a0°C');
  });

  test('a derived value is in the card, and in the table while it is chosen', () => {
    const air = wireTag({ tag_id: '7', readings: readings({ temperature: 30, humidity: 60 }) });
    const dry = reason({ verdict: 'stressed', sensor: 'vpd', value: 1.7, limit: 1.3 });
    showTags(
      [filledTag({ ...air, derived: { vpd: 1.697, dew_point: 21.4 } })],
      judgement({ 7: [dry] }),
    );
    render(
      <>
        <TagCard tagId="7" />
        <TagTable />
      </>,
    );
    const texts = (name: string): (string | null)[] =>
      [...document.querySelectorAll(`:is(li, td)[data-sensor="${name}"]`)].map(
        (it) => it.textContent,
      );
    expect(texts('vpd')).toEqual([expect.stringMatching(/1\.70\u00a0kPa.*high, ideal 0\.20/)]);
    flush(() => {
      act({ sensor: 'vpd' });
    });
    expect(texts('vpd')[1]).toMatch(/^high .*1\.70/);
    expect(texts('dew_point')).toEqual([expect.stringContaining('21.4\u00a0°C')]);
  });

  test('a value that reads like its limit says on which side of it it is', () => {
    const low = reason({ verdict: 'stressed', value: 17.97, limit: 18 });
    const tags = [wireTag({ tag_id: '7', readings: readings({ temperature: 17.97 }) })];
    showTags(tags, judgement({ 7: [low] }));
    render(<TagCard tagId="7" />);
    expect(document.querySelector('.card-value')?.textContent).toBe('just below 18.0\u00a0°C');
  });

  test('what is back in its range is on no side of it, neither here nor in the table', () => {
    const back = reason({ verdict: 'stressed', value: 18.1, limit: 18, ...held(18.5) });
    const tags = [wireTag({ tag_id: '7', readings: readings({ temperature: 18.1 }) })];
    showTags(tags, judgement({ 7: [back] }));
    render(
      <>
        <TagCard tagId="7" />
        <TagTable />
      </>,
    );
    expect(screen.getAllByText(/not yet above 18\.5/).length).toBeGreaterThan(0);
    const ideal = document.querySelector<HTMLElement>('.card-ideal');
    expect(ideal?.textContent).toMatch(/^daytime ideal/);
    expect(ideal?.dataset['health']).toBeUndefined();
    expect(document.querySelector('.beyond')).toBeNull();
  });

  test('closes', () => {
    render(<TagCard tagId="7" />);
    fireEvent.click(screen.getByRole('button', { name: 'Close' }));
    expect(store.get().view.selected).toBeNull();
  });

  test('a tag that a link names and nobody knows', () => {
    render(<TagCard tagId="404" />);
    expect(screen.getByTestId('tag-card').textContent).toContain('does not know this tag');
  });

  test('shows the source that the server has', async () => {
    vi.stubGlobal('fetch', () =>
      Promise.resolve(
        Response.json({
          tag_id: '7',
          source: 'adapt/fixed',
          tries: [],
          sensors: [],
        }),
      ),
    );
    render(<TagCard tagId="7" />);
    expect(await screen.findByText('Fixed sensor')).toBeTruthy();
  });

  test('each reading has its own age, and the inspection another', () => {
    showTags([
      wireTag({
        tag_id: '7',
        stale_seconds: 2,
        looked_at: 0,
        readings: [
          ...readings({ temperature: 20 }, nextStamp() - 7_210),
          { name: 'co2', value: 20, observed_at: null },
        ],
      }),
    ]);
    render(<TagCard tagId="7" />);
    const own = (sensor: string): HTMLElement | null =>
      screen.getByTestId('tag-card').querySelector(`[data-sensor=${sensor}]`);
    expect(own('temperature')?.textContent).toContain('2\u00a0h');
    expect(own('temperature')?.dataset['age']).toBe('old');
    expect(own('co2')?.textContent).toContain('unknown');
    expect(screen.getByTestId('tag-card').textContent).toContain('Flowers inspected');
  });

  test('a failed attempt is shown with its reason', () => {
    const now = 5_000;
    const failing = wireTag({
      tag_id: '7',
      last_try: 4_810,
      last_try_status: 2,
      last_try_detail: 'no tag in the picture',
    });
    showTags([]);
    receive(
      withState(
        {
          ...stateFrame([failing]),
          state: { header: { stamp: now, frame_id: '' }, tags: [failing] },
        },
        performance.now(),
      ),
    );
    render(<TagCard tagId="7" />);
    const { textContent } = screen.getByTestId('tag-card');
    expect(textContent).toContain('Last attempt3\u00a0min ago · not readable');
    expect(textContent).toContain('no tag in the picture');
  });
});
