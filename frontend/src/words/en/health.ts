/** Verdicts and their reasons. */
import { counted } from './counted';

/** Of one tag, and beside a number of them. */
const ONE_OR_MANY = {
  healthy: 'Healthy',
  stressed: 'Stressed',
  critical: 'Critical',
  unknown: 'Unknown',
} as const;

export const HEALTH = {
  health: ONE_OR_MANY,
  healthMany: ONE_OR_MANY,
  /** Why a tag or the house has its verdict. */
  reasons: {
    sides: { below: 'below', above: 'above' },
    /** What was out of its range counts as that until it is well within. */
    wasBeyond: (side: string, limit: string, status: string, until: string): string =>
      `was ${side} ${limit}; stays ${status} until ${until}`,
    /** Of a value that reads like the limit that it is beyond. */
    just: {
      below: (limit: string): string => `just below ${limit}`,
      above: (limit: string): string => `just above ${limit}`,
    },
    readingFailed: (sensor: string): string => `${sensor}: the sensor returns no value`,
    implausible: (reading: string): string => `${reading}: not a plausible value`,
    scanFailed: (outcome: string, age: string | null): string =>
      `Last scan failed: ${outcome}${age === null ? '' : `, ${age} ago`}`,
    pest: (count: number): string =>
      count > 0 ? `${counted(count, 'pest', 'pests')} seen` : 'Pest seen',
    /** An empty sensor: none of the tag's has a reading that holds. */
    old: (sensor: string, age: string | null, holds: string | null, isDated: boolean): string => {
      const since = !isDated
        ? sensor === ''
          ? 'No scan with a known time'
          : 'no reading with a known time'
        : age === null
          ? `${sensor === '' ? 'Not' : 'not'} scanned recently`
          : sensor === ''
            ? `Not scanned for ${age}`
            : `no reading for ${age}`;
      return `${sensor === '' ? '' : `${sensor}: `}${since}${holds === null ? '' : ` (readings are valid for ${holds})`}`;
    },
    outOfRange: 'out of range',
    changed: (reading: string): string => `${reading}: possible sensor fault`,
    silent: 'No data from the twin: its last data may be out of date',
    stopped: 'No tag is being scanned: the robot has stopped, or its data is lost',
    other: (kind: string, sensor: string): string => (sensor === '' ? kind : `${sensor}: ${kind}`),
  },
  /** What somebody does about a reason: of a sensor that growers know by what lies beyond which limit. */
  todo: {
    sensors: {
      temperature: { below: 'Heat, or close the vents', above: 'Ventilate or shade' },
      humidity: { below: 'Mist or damp down', above: 'Ventilate and heat' },
      co2: { below: 'Dose CO₂ or ventilate', above: 'Ventilate; check the CO₂ dosing' },
      light: { below: 'Switch on the lamps', above: 'Shade' },
      soil_moisture: { below: 'Water', above: 'Water less; check the drainage' },
      vpd: { below: 'Ventilate and heat', above: 'Mist or shade' },
    },
    range: 'Check the climate settings',
    reading_failed: 'Check the sensor',
    scan_failed: 'Check the path and the tag',
    pest: 'Inspect and treat the plants',
    old: 'Check the route of the robot',
    changed: 'Compare with a second meter',
    silent: 'Check the twin, the server and the network',
    stopped: 'Check the robot',
    other: 'Check on site',
  },
  todoPestAgain: 'Inspect again: a second clean inspection resolves it',
  todoWell: 'The next good scan resolves it',
  todoAlso: 'also',
  todoLabel: 'Do this now',
  reasonsLabel: 'Why',
  healthHeading: 'Greenhouse status',
  healthDriver: (tag: string, reason: string): string => `Tag ${tag}: ${reason}`,
  healthMostUnknown: 'More than half of the tags are unknown',
  healthSomeUnknown: (count: number): string =>
    `${counted(count, 'tag', 'tags')} cannot be assessed`,
  healthDay: (isDay: boolean, source: string): string =>
    `${isDay ? 'Day' : 'Night'} ranges apply: ${source}`,
  healthDaySource: {
    light: 'by the light measured in the greenhouse',
    clock: 'by the clock, as no light is measured',
    assumed: 'assumed, as neither light nor time is known',
  },
  /** "any": by day and by night it is the same. */
  idealParts: { any: 'ideal', day: 'daytime ideal', night: 'night-time ideal' },
  healthIdeal: (ideal: string, low: string, high: string, unit: string): string =>
    `${ideal} ${low} to ${high} ${unit}`.trim(),
  healthAllWell: 'All assessed readings are within their ideal ranges',
  healthDespite: (alarms: number): string =>
    alarms === 1
      ? '1 alarm is still active: two good scans resolve it'
      : `${alarms} alarms are still active: two good scans resolve each`,
  healthAcknowledged: 'acknowledged',
  /** In place of a verdict, where nobody knows how it is now. */
  healthNotCurrent: 'Not current',
  healthNothing: 'No reading to assess yet',
  healthFilter: ', show only these tags',
  houseRhythm: (interval: string): string => `a scan every ${interval}`,
  houseLast: (age: string): string => `last scan ${age} ago`,
  houseNever: 'no scan yet',
  houseLate: (age: string, interval: string): string =>
    `No scan for ${age} (usually every ${interval})`,
  houseOverdue: (count: number): string =>
    count === 0 ? 'no tag overdue' : counted(count, 'tag overdue', 'tags overdue'),
  /** Told to screen readers. */
  tagChosen: (tag: string, health: string, row: number, rows: number): string =>
    `Tag ${tag}, ${health}, ${row} of ${rows}`,
  attention: 'Needs attention',
  attentionNone: 'Nothing needs attention',
  attentionNoneKnown: (unknown: number): string =>
    `No known problem; no data for ${counted(unknown, 'tag', 'tags')}`,
  attentionMore: (count: number): string => `+ ${count} more`,

  tooLow: (by: string | null): string => (by === null ? 'too low' : `too low by ${by}`),
  tooHigh: (by: string | null): string => (by === null ? 'too high' : `too high by ${by}`),
  /** Before a value beyond its limit: short, in a narrow column. */
  side: { below: 'low', above: 'high' },
  below: 'below ideal',
  above: 'above ideal',
} as const;
