import { render, act as rendered, screen } from '@testing-library/react';
import { beforeEach, describe, expect, test, vi } from 'vitest';

import { moveViewport } from '../store/app';
import { marksOnMap, robotFrame } from '../store/create';
import { goLive, goLost, nextStamp, showTags, status } from '../testing/page';
import { wireTag } from '../testing/tags';
import { extended, RobotFact, RobotLayer, robotText, trailLines, type TrailPoint } from './robot';

const time = (sec: number): { sec: number; nanosec: number } => ({ sec, nanosec: 0 });
const robot = {
  position: { x: 2.14, y: -3.4, heading: null, observed_at: time(988) },
  plan: null,
  battery: { percent: 64.4, observed_at: time(980) },
};

beforeEach(() => {
  robotFrame.set(null);
  showTags([wireTag()]);
  vi.stubGlobal('fetch', () => new Promise(() => undefined));
});

test('the robot’s position and battery in words, each with its age', () => {
  const said = (now: number | null): string => robotText(robot, now).replaceAll('\u00a0', ' ');
  expect(said(1_000)).toBe('Robot: x 2.1 m, y −3.4 m; 12 s ago; battery 64 %');
  expect(said(1_180)).toBe('Robot: x 2.1 m, y −3.4 m; 3 min ago; battery 64 %, reported 3 min ago');
  expect(said(null)).toBe(
    'Robot: x 2.1 m, y −3.4 m; age unknown; battery 64 %, reported age unknown',
  );
  expect(robotText({ ...robot, position: null }, 981)).toMatch(/^Robot: position unknown; battery/);
});

test('a robot that reports nothing has no line', () => {
  const { container } = render(<RobotFact />);
  rendered(() => {
    robotFrame.set({ type: 'robot', position: null, plan: null, battery: null });
  });
  expect(container.textContent).toBe('');
});

test('the robot is marked at its reported position, and labels keep clear of it', () => {
  document.body.innerHTML = '<div id="map-view"></div>';
  moveViewport({ view: { x: 300, y: 200, scale: 100 } });
  const { unmount } = render(<RobotLayer />);
  rendered(() => {
    robotFrame.set({ type: 'robot', ...robot });
  });
  expect(screen.getByTestId('robot-mark').getAttribute('transform')).toBe('translate(514 540)');
  const { left = NaN, top = NaN, right = NaN, bottom = NaN } = marksOnMap.get()[0] ?? {};
  expect([left < 214 - 16, top < 340 - 16, right > 214 + 16, bottom > 340 + 16]).toEqual(
    Array(4).fill(true),
  );
  unmount();
  expect(marksOnMap.get()).toEqual([]);
});

test.each([
  ['a robot that is old says how old', 12, goLive, '12 s ago'],
  ['cut off, the banner says how old one is that was live', 0, goLost, undefined],
  [
    'of a twin that is silent, the banner says it too',
    0,
    () => {
      goLive(status({ twin: 'offline', reason: 'stale' }));
    },
    undefined,
  ],
  ['cut off, one that was old by then says how old', 12, goLost, '12 s ago'],
])('%s', (_, age, then, said) => {
  document.body.innerHTML = '<div id="map-view"></div>';
  const sec = nextStamp();
  showTags([wireTag()]);
  render(<RobotLayer />);
  rendered(() => {
    const position = { ...robot.position, observed_at: time(sec - age) };
    robotFrame.set({ type: 'robot', ...robot, position });
    then();
  });
  const { textContent } = screen.getByTestId('robot-mark');
  expect(textContent.replaceAll('\u00a0', ' ') || undefined).toBe(said);
  expect(screen.getByTestId('robot').dataset['freshness']).toBe('old');
});

const at = (x: number, seconds: number): TrailPoint => ({ x, y: 0, at: seconds });
const position = (x: number, sec: number): Parameters<typeof extended>[1] => ({
  x,
  y: 0,
  heading: null,
  observed_at: { sec, nanosec: 0 },
});

describe('trail', () => {
  test('grows by what is apart in place and in time, and is the same one otherwise', () => {
    const trail = [at(0, 100)];
    expect(extended(trail, position(5, 100))).toBe(trail);
    expect(extended(trail, position(0.05, 110))).toBe(trail);
    expect(extended(trail, position(0.1, 101))).toEqual([at(0, 100), at(0.1, 101)]);
  });

  test('begins anew after a clock that went back', () => {
    expect(extended([at(0, 1_000)], position(1, 20))).toEqual([at(1, 20)]);
  });

  test('is bounded: the oldest go', () => {
    let trail: readonly TrailPoint[] = [];
    for (let second = 1; second <= 2_500; second++)
      trail = extended(trail, position(second, second));
    expect(trail).toHaveLength(2_000);
    expect(trail.at(-1)).toEqual(at(2_500, 2_500));
  });

  test('is drawn in steps of age that hang together, and no older than two minutes', () => {
    const points = [at(0, 399), at(1, 400), at(2, 402), at(4, 463), at(4.5, 465)];
    expect(trailLines(points, 520)).toEqual([
      {
        points: [
          [1, 0],
          [2, 0],
        ],
        step: 5,
      },
      {
        points: [
          [4, 0],
          [4.5, 0],
        ],
        step: 2,
      },
    ]);
  });

  test('is broken after a long silence if the robot has moved', () => {
    const still = [at(0, 100), at(0.5, 200), at(1, 210)];
    const ends = trailLines(still, 210).map(({ points }) => points.map(([x]) => x));
    expect(ends).toEqual([
      [0, 0.5],
      [0.5, 1],
    ]);
    const gap = [at(0, 100), at(0.5, 110), at(3, 200), at(4, 201)];
    expect(trailLines(gap, 201).map(({ points }) => points.length)).toEqual([2, 2]);
  });

  test('is all of the oldest look while the time is not known', () => {
    expect(trailLines([at(0, 100), at(1, 110)], null)).toEqual([
      {
        points: [
          [0, 0],
          [1, 0],
        ],
        step: 5,
      },
    ]);
  });
});
