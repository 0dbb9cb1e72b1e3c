import { expect, test } from 'vitest';

import { beside } from './beside';
import { canvasPoint } from './coordinates';

const box = { width: 200, height: 120 };
const within = { width: 600, height: 400 };

test.each([
  ['in the middle', 300, 200, 'right'],
  ['near the right edge', 560, 200, 'left'],
  ['in the upper left corner', 5, 5, 'right'],
  ['in the lower right corner', 595, 395, 'left'],
])('%s it stands inside the map and off the pin', (_, x, y, side) => {
  const at = beside(canvasPoint(x, y), 11, box, within);
  expect(at.x).toBeGreaterThanOrEqual(0);
  expect(at.y).toBeGreaterThanOrEqual(0);
  expect(at.x + box.width).toBeLessThanOrEqual(within.width);
  expect(at.y + box.height).toBeLessThanOrEqual(within.height);
  if (side === 'right') expect(at.x).toBeGreaterThan(x + 11);
  else expect(at.x + box.width).toBeLessThan(x - 11);
});

test('in a narrow map it goes below the pin, and above where there is no room below', () => {
  const narrow = { width: 300, height: 400 };
  expect(beside(canvasPoint(150, 100), 11, box, narrow).y).toBeGreaterThan(111);
  const above = beside(canvasPoint(150, 350), 11, box, narrow);
  expect(above.y + box.height).toBeLessThan(339);
  expect(above.x).toBe(50);
});
