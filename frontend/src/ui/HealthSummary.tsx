import type { JSX } from 'react';

import { readingText, valueText } from '../domain/format';
import { HEALTH_STATUSES, type HouseHealth } from '../domain/health';
import { sensorNamed } from '../domain/sensors';
import { shown } from '../domain/text';
import type { TemperatureUnit } from '../domain/units';
import { act, useApp } from '../store/app';
import { selectHealth } from '../store/derived';
import { S } from '../strings';
import { HealthMark, HealthShape } from './HealthMark';

/** The house's state, what drives it, and how many tags are in which state. */
export function HealthSummary({ kiosk }: { kiosk: boolean }): JSX.Element {
  const health = useApp(selectHealth);
  const filter = useApp((state) => state.view.health);
  const unit = useApp((state) => state.settings.unit);
  const driver = driverText(health, unit);
  const { worst } = health;
  return (
    <section
      className="health"
      aria-label={S.healthHeading}
      data-testid="house-health"
      data-health={health.status}
    >
      <div className="health-house">
        <h2>
          <span className="unseen">{S.healthHeading}: </span>
          <HealthMark status={health.status} />
        </h2>
        {worst && worst.deviation !== null && worst.deviation > 0 && !kiosk ? (
          <button
            type="button"
            className="health-driver"
            data-testid="health-driver"
            data-tag-id={worst.tagId}
            title={driver}
            onClick={() => {
              act({ type: 'select', tagId: worst.tagId });
            }}
          >
            {driver}
          </button>
        ) : (
          <p className="health-driver" data-testid="health-driver" title={driver}>
            {driver}
          </p>
        )}
      </div>
      <ul className="health-counts">
        {HEALTH_STATUSES.map((status) => (
          <li key={status}>
            <button
              type="button"
              aria-pressed={filter === status}
              disabled={kiosk}
              data-health={status}
              onClick={() => {
                act({ type: 'health', status: filter === status ? null : status });
              }}
            >
              <HealthShape status={status} />
              <strong>{health.counts[status]}</strong> <span>{S.health[status]}</span>
              {!kiosk && <span className="unseen">{S.healthFilter}</span>}
            </button>
          </li>
        ))}
      </ul>
    </section>
  );
}

/** The tag and sensor that make the house what it is. */
export function driverText({ worst }: HouseHealth, unit: TemperatureUnit): string {
  if (worst?.sensor == null || worst.value === null) return S.healthNothing;
  if (worst.deviation === 0) return S.healthAllWell;
  const sensor = sensorNamed(worst.sensor);
  return S.healthDriver(
    shown(worst.tagId, 24),
    sensor.label,
    readingText(sensor, worst.value, unit),
    sensor.ideal
      ? S.legendIdeal(
          valueText(sensor, sensor.ideal[0], unit),
          valueText(sensor, sensor.ideal[1], unit),
        )
      : '',
  );
}
