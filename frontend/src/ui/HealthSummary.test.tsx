import { fireEvent, render, screen } from '@testing-library/react';
import { expect, test } from 'vitest';

import { store } from '../store/app';
import { showTags } from '../testing/page';
import { readings, wireTag } from '../testing/tags';
import { HealthSummary } from './HealthSummary';

test('names the state, and the tag and sensor that drive it', () => {
  showTags([
    wireTag({ tag_id: '1', readings: readings({ temperature: 20 }) }),
    wireTag({ tag_id: '5', readings: readings({ temperature: 20, co2: 4000 }) }),
  ]);
  render(<HealthSummary kiosk={false} />);
  expect(screen.getByTestId('house-health').dataset['health']).toBe('critical');
  expect(screen.getByRole('heading').textContent).toBe('House health: Critical');
  const driver = screen.getByTestId('health-driver');
  expect(driver.textContent).toBe('Tag 5: CO₂ 4000\u00a0ppm, ideal 400 to 800');
  fireEvent.click(driver);
  expect(store.get().view.selected).toBe('5');
});

test('counts the tags by state, and filters by one', () => {
  showTags([wireTag({ tag_id: '1', readings: readings({ temperature: 20 }) }), wireTag()]);
  render(<HealthSummary kiosk={false} />);
  const healthy = screen.getByRole('button', { name: /^1 Healthy/ });
  fireEvent.click(healthy);
  expect(store.get().view.health).toBe('healthy');
  expect(healthy.getAttribute('aria-pressed')).toBe('true');
  fireEvent.click(healthy);
  expect(store.get().view.health).toBeNull();
});

test('all is well, and nothing is known', () => {
  showTags([wireTag({ readings: readings({ temperature: 20 }) })]);
  const { unmount } = render(<HealthSummary kiosk={false} />);
  expect(screen.getByTestId('health-driver').textContent).toMatch(/^Every judged reading/);
  unmount();
  showTags([]);
  render(<HealthSummary kiosk={false} />);
  expect(screen.getByTestId('health-driver').textContent).toMatch(/^No reading/);
});
