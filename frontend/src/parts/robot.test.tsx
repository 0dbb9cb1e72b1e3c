import { render, act as rendered, screen } from '@testing-library/react';
import { beforeEach, expect, test, vi } from 'vitest';

import { moveViewport } from '../store/app';
import { marksOnMap, robotFrame } from '../store/create';
import { goLive, goLost, nextStamp, showTags, status } from '../testing/page';
import { wireTag } from '../testing/tags';
import { extended, joined, RobotFact, RobotLayer, robotText, trailPath } from './robot';

const time = (sec: number): number => sec;
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

const at = (x: number, sec: number): Parameters<typeof extended>[1] => ({
  x,
  y: 0,
  observed_at: time(sec),
});

test('the trail is the last hour, by what is apart; a clock that went back drops later points', () => {
  let trail = [0, 1, 2].reduce((last, x) => extended(last, at(x, x)), extended([], at(0, 0)));
  expect(trail.map(({ x }) => x)).toEqual([0, 1, 2]);
  expect(extended(trail, at(2.05, 100))).toBe(trail);
  trail = extended(trail, at(9, 3_601));
  expect(trail.map(({ x }) => x)).toEqual([1, 2, 9]);
  expect(trailPath(trail), 'broken where the way is unknown').toBe('M1 0L2 0M9 0');
  expect(extended(trail, at(9, 1)).map(({ x }) => x)).toEqual([1, 9]);
  const fetched = joined([at(0, 0), at(1, 1)], [at(1, 1), at(2, 2)]);
  expect(
    fetched.map(({ x }) => x),
    'with what was received meanwhile',
  ).toEqual([0, 1, 2]);
});
