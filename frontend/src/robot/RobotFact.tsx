import type { JSX } from 'react';

import type { RobotNow } from '../contract/types';
import { ageStep } from '../domain/age';
import { ageText, percentText, written } from '../domain/format';
import { store } from '../store/app';
import { S } from '../strings';
import { useTicking } from '../widgets/useNow';
import { ageOf, timeOf, useRobot } from './heard';

const metres = (value: number): string => written(value.toFixed(1));

/** All of it in words: for the legend, and for who does not see the map. */
export function robotText({ position, battery }: RobotNow, time: number | null): string {
  const ago = (age: number | null): string =>
    age === null ? S.robotAgeUnknown : S.agoSuffix(ageText(age));
  const parts = position
    ? [S.robotAt(metres(position.x), metres(position.y)), ago(ageOf(position.observed_at, time))]
    : [S.robotNowhere];
  if (battery) {
    const percent = percentText(battery.percent / 100);
    const age = ageOf(battery.observed_at, time);
    parts.push(
      ageStep(age) === 'fresh' ? S.robotBattery(percent) : S.robotReported(percent, ago(age)),
    );
  }
  return parts.join('; ');
}

export function RobotFact(): JSX.Element | null {
  const robot = useRobot();
  const text = useTicking((now) => robotText(robot, timeOf(store.get(), now)));
  if (!robot.position && !robot.battery) return null;
  return (
    <span className="robot-fact" data-testid="robot-fact">
      {text}
    </span>
  );
}
