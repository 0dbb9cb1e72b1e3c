import { act as rendered, render, screen } from '@testing-library/react';
import { beforeEach, expect, test, vi } from 'vitest';

import { robotFrame } from '../store/create';
import { showTags } from '../testing/page';
import { wireTag } from '../testing/tags';
import { RobotFact, RobotLayer, robotText } from './parts';

const time = (sec: number): { sec: number; nanosec: number } => ({ sec, nanosec: 0 });
const robot = {
  position: { x: 2.14, y: -3.4, heading: null, observed_at: time(988) },
  plan: null,
  battery: { percent: 64.4, observed_at: time(980) },
};

beforeEach(() => {
  robotFrame.dispatch(null);
  showTags([wireTag()]);
  vi.stubGlobal('fetch', () => new Promise(() => undefined));
});

test('all of a robot is told in words, each as old as it is', () => {
  const said = (now: number | null): string => robotText(robot, now).replaceAll('\u00a0', ' ');
  expect(said(1_000)).toBe('Robot: 2.1 m, −3.4 m; 12 s ago; battery 64 %');
  expect(said(1_180)).toBe('Robot: 2.1 m, −3.4 m; 3 min ago; battery 64 %, reported 3 min ago');
  expect(said(null)).toBe('Robot: 2.1 m, −3.4 m; age unknown; battery 64 %, reported age unknown');
  expect(robotText({ ...robot, position: null }, 981)).toMatch(/^Robot: position unknown; battery/);
});

test('of a robot that says nothing there is no line', () => {
  const { container } = render(<RobotFact />);
  rendered(() => {
    robotFrame.dispatch({ type: 'robot', position: null, plan: null, battery: null });
  });
  expect(container.textContent).toBe('');
});

test('a robot is marked on the map where it said that it is', () => {
  document.body.innerHTML = '<div id="map-view"></div>';
  render(<RobotLayer />);
  rendered(() => {
    robotFrame.dispatch({ type: 'robot', ...robot });
  });
  expect(screen.getByTestId('robot-mark')).toBeTruthy();
});
