import { expect, test } from 'vitest';

import declared from '../../../backend/lupin_bridge/sensors.json';
import { KNOWN_SENSORS, RAMP, sensorNamed, sensorsIn } from './sensors';

test('every number comes from sensors.json', () => {
  for (const [name, sensor] of Object.entries(declared.sensors)) {
    expect(sensorNamed(name)).toEqual({ name, ...sensor });
  }
  expect(RAMP).toEqual({ saturation: declared.ramp.saturation, maxAlpha: declared.ramp.max_alpha });
});

test('an undeclared sensor shows its own name and is never judged', () => {
  expect(sensorNamed('ph')).toMatchObject({ name: 'ph', label: 'ph', unit: '', ideal: null });
});

test('declared sensors first, then the others by name, each once', () => {
  const names = sensorsIn(['zinc', 'humidity', 'ph', 'zinc']).map(({ name }) => name);
  expect(names).toEqual([...KNOWN_SENSORS.map(({ name }) => name), 'ph', 'zinc']);
});
