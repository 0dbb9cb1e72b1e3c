import { act as flush, render, screen, waitFor } from '@testing-library/react';
import { beforeEach, describe, expect, test, vi } from 'vitest';

import type { Field, Grade, Place, Schemas, TwinTagState } from '../contract/types';
import { houseHealth } from '../domain/health';
import { snapshotOf } from '../domain/twin';
import { mapPoint } from '../geometry/coordinates';
import { pointedAt } from '../map/commands';
import { act, moveViewport, prefer, receive, store } from '../store/app';
import { marksOnMap } from '../store/create';
import { withPast } from '../store/twin';
import { selectTag } from '../store/moment';
import { estimated } from '../testing/field';
import { judgement, reason } from '../testing/health';
import { goLive, nextStamp, showField, showTags } from '../testing/page';
import { sensorNamed } from '../testing/sensors';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { Legend } from '../ui/Legend';
import { Readout } from '../ui/MapPanel';
import {
  AdviceMarks,
  CardEstimate,
  errorText,
  EstimateFacts,
  estimateText,
  NEAR_M,
  nearTo,
} from './estimate';

type Expected = Schemas['ExpectedReading'];

const grade = (over: Partial<Grade> = {}): Grade => ({
  fitted_at: 1_000,
  fit_problem: '',
  graded_since: 500,
  day: { scans: 458, inside: 412 },
  week: { scans: 3_200, inside: 2_900 },
  share_day: 412 / 458,
  share_week: 2_900 / 3_200,
  is_trusted: true,
  ...over,
});

const expectedReading = (over: Partial<Expected> = {}): Expected => ({
  measured: 22.4,
  observed_at: 1_000,
  expected: 22.1,
  expected_sd: 0.79,
  z: 0.4,
  offset: 0.3,
  left_out: false,
  ...over,
});

let grades: Readonly<Record<string, Grade>>;
let expected: Readonly<Record<string, Expected>>;
let places: readonly Place[] | null;

const NBSP = '\u00a0';
const tags = (): TwinTagState[] => [
  wireTag({
    tag_id: '7',
    pose: { position: { x: 1, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } },
    readings: readings({ temperature: 22 }, nextStamp() - 750),
  }),
];

beforeEach(() => {
  grades = { temperature: grade() };
  expected = {};
  places = [];
  vi.stubGlobal('fetch', (url: URL) => {
    const path = url.pathname;
    if (path.endsWith('quality')) return Promise.resolve(Response.json({ sensors: grades }));
    if (path.endsWith('tags')) return Promise.resolve(Response.json({ tags: expected }));
    return Promise.resolve(
      places
        ? Response.json({ places })
        : Response.json({ detail: 'no such service' }, { status: 503 }),
    );
  });
  showTags(tags());
  goLive();
  act({ heat: 'estimate' });
});

const nearest = (field: Field): Field => {
  const { sureness, ...rest } = field;
  expect(sureness).toBeDefined();
  return rest;
};
const text = (id: string): string => screen.getByTestId(id).textContent;

describe('readout', () => {
  const point = (x: number): void => {
    flush(() => {
      pointedAt.set(mapPoint(x, 0.5));
    });
  };

  test('shows the estimate with its error, the number of tags nearby, and their age', async () => {
    showField(estimated([22.4, NaN], [0.79, 1.6]));
    render(<Readout />);
    point(0.5);
    // Until its clock starts, a part that is loaded late counts from the last tick before it.
    await waitFor(() => {
      expect(text('readout-near')).toBe(`1 tag nearby, oldest reading 12${NBSP}min ago`);
    });
    expect(text('readout')).toContain(`22.4${NBSP}±${NBSP}1.3${NBSP}°C`);
    point(1.5);
    await waitFor(() => {
      expect(text('readout')).toContain('unknown');
    });
    point(0.5);
    flush(() => {
      prefer({ unit: 'F' });
    });
    expect(text('readout')).toContain(`72.3${NBSP}±${NBSP}2.3${NBSP}°F`);
  });

  test('the error alone is shown where the value is not known', async () => {
    showField(estimated([22.4, NaN], [0.79, 2]));
    act({ heat: 'error' });
    render(<Readout />);
    point(1.5);
    await screen.findByTestId('readout-near');
    expect(text('readout')).toContain(`±${NBSP}3.3${NBSP}°C`);
    expect(screen.queryByTestId('readout-ideal')).toBeNull();
  });
});

describe('legend', () => {
  test('shows the certainty, and how many predictions held', async () => {
    showField(estimated([22.4], [0.5]));
    render(<Legend kiosk={false} />);
    expect((await screen.findByTestId('prediction')).textContent).toBe(
      '9 of 10 scans within the predicted range',
    );
    expect(text('estimate-key')).toContain(`Hatched colour: less certain than ±1.6${NBSP}°C`);
    expect(text('legend')).toContain('90 % interval');
    expect(screen.queryByTestId('estimate-warning')).toBeNull();
  });

  test('counts each scan while there are fewer than ten', async () => {
    grades = { temperature: grade({ day: { scans: 9, inside: 7 }, share_day: 7 / 9 }) };
    showField(estimated([22.4], [0.5]));
    render(<EstimateFacts />);
    const prediction = await screen.findByTestId('prediction');
    expect(prediction.textContent).toBe('7 of 9 scans within the predicted range');
  });

  test('warns where too few scans lay inside', async () => {
    grades = { temperature: grade({ share_day: 0.42, is_trusted: false }) };
    showField(estimated([22.4], [0.5]));
    render(<EstimateFacts />);
    const warning = await screen.findByTestId('estimate-warning');
    expect(warning.textContent).toContain('Error range is too narrow');
    expect(warning.textContent).toContain('only 4 of 10 scans were');
  });

  test('shows no grade if the twin has none', async () => {
    grades = { temperature: grade({ day: { scans: 12, inside: 3 }, is_trusted: null }) };
    showField(estimated([22.4], [0.5]));
    render(<EstimateFacts />);
    await screen.findByTestId('prediction');
    expect(screen.queryByTestId('estimate-warning')).toBeNull();
  });

  test.each([
    [grade(), 'No estimate at the moment'],
    [grade({ fitted_at: null, share_day: null }), 'ten scans of a sensor are needed'],
  ])('without an estimate, the legend says why: %#', async (said, words) => {
    grades = { temperature: said };
    showField(nearest(estimated([22.4], [0.5], { noEstimate: 'the reason <b>' })));
    render(<EstimateFacts />);
    await vi.waitFor(() => {
      expect(text('estimate-missing')).toContain(words);
    });
    expect(document.body.textContent).toContain('the reason <b>');
    expect(screen.getAllByRole('status')).toHaveLength(1);
  });

  test('without a tag none is on its way', async () => {
    render(<Legend kiosk={false} />);
    await screen.findByText('Loading the estimate');
    flush(() => {
      showTags([]);
      act({ heat: 'estimate' });
    });
    expect(screen.queryByText('Loading the estimate')).toBeNull();
  });

  test('what is computed has no estimate, and that is said', () => {
    act({ sensor: 'vpd' });
    render(<EstimateFacts />);
    expect(text('estimate-missing')).toBe(
      'A computed quantity has no estimate: the nearest readings are shown',
    );
  });

  test('the error alone has a scale of its own, from none to the most', async () => {
    showField(estimated([22.4, NaN], [0.5, 2]));
    act({ heat: 'error' });
    render(<Legend kiosk={false} />);
    expect((await screen.findByTestId('error-high')).textContent).toBe(`±${NBSP}3.3${NBSP}°C`);
    expect(text('error-scale')).toContain('Uncertainty of the estimate');
    // The sensor is named once.
    expect(text('legend').match(/Temperature/g)).toHaveLength(1);
    expect(screen.queryByTestId('ideal-scale')).toBeNull();
    expect(screen.queryByTestId('estimate-key')).toBeNull();
  });
});

describe('card', () => {
  const card = (): void => {
    const tag = selectTag(store.get(), '7');
    if (tag) render(<CardEstimate tag={tag} health={store.get().twin.latest.health?.tags['7']} />);
  };

  test('shows the measured beside the expected value', async () => {
    expected = { '7': expectedReading() };
    card();
    expect((await screen.findByTestId('card-estimate')).textContent).toBe(
      `Temperature: measured 22.4, expected 22.1${NBSP}±${NBSP}1.3${NBSP}°C`,
    );
  });

  test('says what the estimate leaves out, of every sensor', async () => {
    const changed = reason({ kind: 'changed', sensor: 'humidity', verdict: 'stressed' });
    showTags(tags(), judgement({ '7': [changed] }));
    expected = { '7': expectedReading({ expected: 19, left_out: true }) };
    card();
    await screen.findByText('Temperature: possible sensor fault, not used in the estimate');
    expect(text('card-estimate')).toContain(
      'Humidity: possible sensor fault, not used in the estimate',
    );
  });
});

describe('where another tag would help', () => {
  beforeEach(() => {
    moveViewport({ size: { width: 400, height: 300 }, view: { x: 0, y: 300, scale: 100 } });
  });

  test('is numbered marks in their places, which are a list with by how much', async () => {
    places = [
      { x: 1, y: 2, error_ratio: 0.83 },
      { x: 3, y: 1, error_ratio: 0.7 },
      { x: 50, y: 1, error_ratio: 0.6 },
    ];
    render(<AdviceMarks />);
    await screen.findByRole('list', { name: 'Suggested tag positions' });
    expect(
      screen.getByRole('button', { name: /^1\. x 1\.00 m, y 2\.00 m: a tag here/ }),
    ).toBeTruthy();
    expect(
      screen.getByRole('button', { name: /^2\. .* all earlier marks .* 70\u00a0%/ }),
    ).toBeTruthy();
    const marks = [...document.querySelectorAll<HTMLElement>('.advice li')];
    expect(marks.map(({ style }) => style.transform)).toEqual([
      'translate(100px, 100px)',
      'translate(300px, 200px)',
      'translate(5000px, 200px)',
    ]);
    expect(marks.map(({ dataset }) => dataset['inView'])).toEqual(['true', 'true', 'false']);
    const [first] = marksOnMap.get();
    expect(first).toEqual({ left: 84, top: -216, right: 116, bottom: -184 });
  });

  test('says where there is none, or none of the past', async () => {
    render(<AdviceMarks />);
    await screen.findByText('No suggestion for another tag');
    flush(() => {
      receive(withPast({ at: 5, house: store.get().twin.latest }));
      act({ moment: 5 });
    });
    expect(text('advice-note')).toBe('Suggestions for another tag are shown for the present only');
  });

  test('a twin that has no such service says so', async () => {
    places = null;
    render(<AdviceMarks />);
    await screen.findByText('No suggestion for another tag: no such service');
  });
});

const tag = (id: string, x: number, over = {}): ReturnType<typeof wireTag> =>
  wireTag({
    tag_id: id,
    pose: { position: { x, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } },
    readings: readings({ temperature: 20 }),
    ...over,
  });

test('counts the tags within reach that read the sensor and are not left out', () => {
  const wire = [
    tag('at the limit', NEAR_M),
    tag('past it', NEAR_M + 0.01),
    tag('reads another', 1, { readings: readings({ co2: 400 }) }),
    tag('failed', 1, { readings: readings({ temperature: null }) }),
    tag('changed', 1),
    tag('changed in another', 1),
  ];
  const { tags } = snapshotOf(stateFrame(wire), 0, null);
  const health = houseHealth(
    tags,
    judgement({
      changed: [reason({ kind: 'changed', sensor: 'temperature' })],
      'changed in another': [reason({ kind: 'changed', sensor: 'co2' })],
    }),
    true,
  );
  expect(nearTo(mapPoint(0, 0), tags, 'temperature', health).count).toBe(2);
  expect(nearTo(mapPoint(99, 0), tags, 'temperature', health)).toEqual({
    count: 0,
    oldest: 'never',
  });
});

const plain = (text: string): string => text.replaceAll('\u00a0', ' ');

test.each([
  ['temperature', 22.41, 0.79, '22.4 ± 1.3 °C'],
  ['temperature', 20.2, 0.377, '20.2 ± 0.6 °C'],
  ['temperature', 20.2, 0.02, '20.2 ± 0.033 °C'],
  ['temperature', -2, 12, '−2.0 ± 19.7 °C'],
  ['co2', 536.2, 22, '536 ± 36 ppm'],
  ['co2', 536.2, 0.2, '536 ± 0.33 ppm'],
] as const)('%s %d, error %d: %s', (name, mean, sd, text) => {
  expect(plain(estimateText(sensorNamed(name), mean, sd))).toBe(text);
});

test('an error is a difference: no 32 in it', () => {
  expect(plain(errorText(sensorNamed('temperature', 'F'), 1))).toBe('3.0 °F');
});
