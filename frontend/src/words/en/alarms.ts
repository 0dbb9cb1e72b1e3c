/** Alarms: what is active, shelved and resolved, and how it is notified. */
import { counted } from './counted';

/** Those that are not named. */
const further = (more: number): string => (more > 0 ? ` and ${more} more` : '');

export const ALARMS = {
  alarms: 'Alarms',
  listChoice: 'Beside the map',
  /** For screen readers, after the word. */
  alarmsCount: (unseen: number, active: string): string =>
    active === '0' ? 'none active' : `${active} active, ${unseen} not acknowledged`,
  /** After the word, while a past moment is shown. */
  alarmsNow: (active: string): string => `${active} now`,
  /** How many, or "some/all" while the list is filtered. */
  alarmGroups: {
    active: (count: string): string => `Active (${count})`,
    shelved: (count: string): string => `Shelved (${count})`,
    resolved: (count: string): string => `Resolved in the last 24 h (${count})`,
  },
  alarmHouse: 'Whole greenhouse',
  alarmWhat: (where: string, what: string): string => `${where}: ${what}`,
  alarmSince: (when: string): string => `since ${when}`,
  /** The beginning is unknown. */
  alarmForOver: (length: string): string => `for over ${length}`,
  alarmUntil: (from: string, until: string, length: string): string =>
    `${from} until ${until} (${length})`,
  /** An alarm's value now, at worst, and when raised. */
  alarmNow: (reading: string): string => `now ${reading}`,
  alarmNowUnknown: (last: string | null, age: string | null): string =>
    last === null ? 'now unknown' : `now unknown, last ${last}${age === null ? '' : ` ${age} ago`}`,
  /** For a pest, instead of a count: at first or at worst, and now. */
  alarmPests: { seen: 'seen', still: 'still seen', gone: 'no longer seen' },
  alarmWorst: {
    below: (reading: string): string => `worst ${reading}`,
    above: (reading: string): string => `worst ${reading}`,
    pest: (reading: string): string => `peak ${reading}`,
  },
  alarmFirst: (reading: string): string => `${reading} when raised`,
  alarmStatus: { critical: 'critical', healthy: 'in range' },
  /** For an alarm that is still active, although its value is back in range. */
  alarmBack: 'Back to normal',
  alarmShow: 'Show this tag now',
  alarmStart: 'Go to start',
  alarmActionsOf: (what: string): string => `Actions: ${what}`,
  alarmAcknowledge: 'Acknowledge',
  /** An action on several alarms at once. */
  alarmAll: (what: string, count: number): string => `${what} all (${count})`,
  alarmAcknowledgedBy: (name: string, at: string): string => `acknowledged by ${name}, ${at}`,
  alarmUnacknowledge: 'Unacknowledge',
  alarmShelve: 'Shelve',
  alarmShelveHint: 'No notification until the time is up, unless it gets worse.',
  alarmShelveCritical:
    'An alarm that is or was critical can be shelved for at most 1 h, and needs a reason.',
  alarmShelfReason: 'Reason',
  alarmShelfReasonOptional: 'Reason (optional)',
  alarmShelveFor: (time: string): string => `For ${time}`,
  alarmShelved: (until: string, reason: string, by: string): string =>
    `shelved ${by === '' ? '' : `by ${by} `}until ${until}${reason === '' ? '' : `: ${reason}`}`,
  alarmUnshelve: 'Unshelve',
  alarmResolved: 'resolved',
  alarmUndo: 'Undo',
  /** The operator's last action. */
  alarmDone: {
    acknowledge: (count: number): string => `${counted(count, 'alarm', 'alarms')} acknowledged`,
    unacknowledge: (count: number): string =>
      `${counted(count, 'alarm', 'alarms')} no longer acknowledged`,
    shelve: (count: number): string => `${counted(count, 'alarm', 'alarms')} shelved`,
    unshelve: (count: number): string => `${counted(count, 'alarm', 'alarms')} no longer shelved`,
  },
  /** Above a list whose order is held. */
  alarmsNew: (count: number): string => `${count} new`,
  alarmsNewHint: 'The order stays fixed while you use the list. Show new alarms',
  alarmFilter: 'Filter alarms',
  alarmFilterHint: 'Filter…',
  alarmOrder: 'Order',
  alarmOrders: { cause: 'By cause', newest: 'Newest first', tag: 'By tag' },
  alarmSaveCsv: 'Save alarms as CSV',
  alarmsNoMatch: 'No alarm matches the filter.',
  alarmCount: (count: number): string => counted(count, 'alarm', 'alarms'),
  further: (more: number): string => further(more),
  alarmTags: (tags: readonly string[], more: number): string =>
    `${tags.length === 1 ? 'Tag' : 'Tags'} ${tags.join(', ')}${further(more)}`,
  alarmsNone: 'No alarm is active',
  alarmsNoneHint:
    'An alarm is raised after two bad scans in a row. A pest, or missing data from the greenhouse, raises one at once.',
  alarmsWait: (tags: number): string =>
    `${counted(tags, 'tag', 'tags')} waiting for a second scan: no alarm yet`,
  alarmNotYet: 'no alarm yet',
  alarmsNotYet: 'Waiting for the list of alarms',
  alarmsStarting: 'Recorded data is still being read: more alarms may follow.',
  alarmsNoTime: 'While the time is unknown, alarms may be missing.',
  alarmsReceived: (since: string): string =>
    `Nothing is recorded, so alarms before ${since} are unknown.`,
  alarmsLost: 'As last received. Later events are unknown.',
  alarmsOfNow: (moment: string): string =>
    `These are the current alarms. The rest of the page shows ${moment}.`,
  alarmsMine: '“Acknowledged” and “shelved” apply in this browser only.',

  alarmNotifyMe: 'Notify me of alarms',
  alarmSound: 'Sound',
  alarmSoundHints: {
    ready: 'A short sound for new alarms, at most one in 10 s.',
    waits: 'The browser allows sound after your first click on this page.',
    none: 'This browser cannot play sound.',
  },
  alarmNotify: 'Notification',
  alarmNotifyHint:
    'The browser notifies you of new alarms while this page is open in the background.',
  alarmNotifyPushed: 'Critical alarms also arrive while it is closed.',
  alarmNotifyNot: {
    insecure: 'Browsers allow this only on addresses that begin with https:// or http://localhost.',
    refused: 'This browser blocks notifications. Allow them for this page in its settings.',
    none: 'This browser does not support notifications.',
  },
  alarmNotifyTitle: (count: number): string => counted(count, 'new alarm', 'new alarms'),

  /** For screen readers and notifications; `alarmsMeanwhile` while a past moment is shown. */
  alarmsRaised: (alarms: readonly string[], more: number): string =>
    `New: ${alarms.join('; ')}${further(more)}`,
  alarmsCleared: (alarms: readonly string[], more: number): string =>
    `Resolved: ${alarms.join('; ')}${further(more)}`,
  alarmsMeanwhile: (alarm: string, more: number): string =>
    `New alarm: ${alarm}${more > 0 ? ` and ${counted(more, 'more alarm', 'more alarms')}` : ''}`,
} as const;

/** For one tag, and after a number of tags. */
const ONE_OR_MANY = {
  healthy: 'Healthy',
  stressed: 'Stressed',
  critical: 'Critical',
  unknown: 'Unknown',
} as const;

/** Verdicts and their reasons. */
export const HEALTH = {
  health: ONE_OR_MANY,
  healthMany: ONE_OR_MANY,
  /** Why a tag or the greenhouse has its verdict. */
  reasons: {
    sides: { below: 'below', above: 'above' },
    /** A value that was out of range keeps its status until it is well within (hysteresis). */
    must: {
      below: (limit: string): string => `not yet above ${limit}`,
      above: (limit: string): string => `not yet below ${limit}`,
    },
    /** For a value beyond its limit that rounds to the limit. */
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
    /** An empty `sensor`: no sensor of the tag has a valid reading. */
    old: (sensor: string, age: string | null, holds: string | null, isDated: boolean): string => {
      if (!isDated) {
        return sensor === '' ? 'No reading yet' : `${sensor}: no reading of known age`;
      }
      const since =
        age === null
          ? `${sensor === '' ? 'Not' : 'not'} scanned recently`
          : sensor === ''
            ? `Not scanned for ${age}`
            : `no reading for ${age}`;
      return `${sensor === '' ? '' : `${sensor}: `}${since}${holds === null ? '' : ` (readings are valid for ${holds})`}`;
    },
    outOfRange: 'out of range',
    changed: (reading: string): string => `${reading}: possible sensor fault`,
    silent: 'No current data from the twin',
    stopped: 'No tag is being scanned: the robot has stopped, or its data is lost',
    other: (kind: string, sensor: string): string => (sensor === '' ? kind : `${sensor}: ${kind}`),
  },
  /** The cause that humidity, vapour pressure deficit and dew margin share. */
  airCause: { damp: 'Air too damp', dry: 'Air too dry' },
  /** What to do about a reason; for well-known sensors, by sensor and side of the range. */
  todo: {
    sensors: {
      temperature: { below: 'Heat, or close the vents', above: 'Ventilate or shade' },
      co2: { below: 'Dose CO₂ or ventilate', above: 'Ventilate; check the CO₂ dosing' },
      light: { below: 'Switch on the lamps', above: 'Shade' },
      soil_moisture: { below: 'Irrigate', above: 'Irrigate less; check the drainage' },
    },
    air: { damp: 'Ventilate and heat', dry: 'Mist or damp down' },
    range: 'Check the climate settings',
    /** For a value that is back in its range, but not far enough inside yet. */
    watch: 'Keep an eye on it',
    reading_failed: 'Check the sensor',
    scan_failed: 'Check the path and the tag',
    pest: 'Inspect and treat the plants',
    old: 'Check the route of the robot',
    changed: 'Compare with a second meter',
    silent: 'Check the twin, the server and the network',
    stopped: 'Check the robot',
    other: 'Check on site',
  },
  todoPestAgain: 'Inspect again to resolve it',
  todoWell: 'The next good scan resolves it',
  todoAlso: (tags: number): string => (tags === 1 ? 'also tag' : 'also tags'),
  todoLabel: 'Do this now',
  reasonsLabel: 'Why',
  healthHeading: 'Greenhouse status',
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
  /** "any": the same by day and by night. */
  idealParts: { any: 'ideal', day: 'daytime ideal', night: 'night-time ideal' },
  healthAllWell: 'All assessed readings are within their ideal ranges',
  healthDespite: (alarms: string): string =>
    alarms === '1'
      ? '1 alarm is still active: the next good scan or inspection resolves it'
      : `${alarms} alarms are still active: the next good scan or inspection resolves each`,
  healthAcknowledged: 'acknowledged',
  /** Replaces the verdict while the current status is unknown. */
  healthNotCurrent: 'Not current',
  healthNoTime: 'Not assessed while the time is unknown',
  healthNothing: 'No reading to assess yet',
  /** Of a tag that is unknown although it has recent readings. */
  healthNoRange: 'No reading with an ideal range',
  healthFilter: ', show only these tags',
  scanInterval: (interval: string): string => `each tag scanned every ${interval}`,
  houseLast: (age: string): string => `last scan ${age} ago`,
  houseNever: 'no scan yet',
  houseLate: (age: string, interval: string): string =>
    `No scan for ${age} (usually each tag is scanned every ${interval})`,
  houseOverdue: (count: number): string =>
    count === 0 ? 'no tag overdue' : counted(count, 'tag overdue', 'tags overdue'),
  /** For screen readers. */
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
} as const;
