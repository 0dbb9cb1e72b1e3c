/** Alarms: what is active, shelved and resolved, and how it is notified. */
import { counted } from './counted';

export const ALARMS = {
  alarms: 'Alarms',
  listChoice: 'Beside the map',
  /** Beside the word, to hear. */
  alarmsCount: (unseen: number, active: number): string =>
    active === 0 ? 'none active' : `${active} active, ${unseen} not acknowledged`,
  /** How many, or "some/all" while the list is filtered. */
  alarmGroups: {
    active: (count: string): string => `Active (${count})`,
    shelved: (count: string): string => `Shelved (${count})`,
    resolved: (count: string): string => `Resolved in the last 24 h (${count})`,
  },
  alarmHouse: 'Whole greenhouse',
  alarmWhat: (where: string, what: string): string => `${where}: ${what}`,
  alarmSince: (when: string, length: string | null): string =>
    length === null ? `since ${when}` : `since ${when} (${length})`,
  alarmUntil: (from: string, until: string, length: string): string =>
    `${from} until ${until} (${length})`,
  /** Its value now, at worst, and when it was raised. */
  alarmNow: (reading: string): string => `now ${reading}`,
  alarmNowUnknown: (last: string | null, age: string | null): string =>
    last === null ? 'now unknown' : `now unknown, last ${last}${age === null ? '' : ` ${age} ago`}`,
  /** Of a pest, in place of how many. */
  alarmPests: { none: 'none seen', seen: 'seen' },
  alarmWorst: {
    below: (reading: string): string => `worst ${reading}`,
    above: (reading: string): string => `worst ${reading}`,
    pest: (reading: string): string => `peak ${reading}`,
  },
  alarmFirst: (reading: string): string => `${reading} when raised`,
  alarmStatus: { critical: 'critical', healthy: 'in range' },
  /** Of an alarm that is still active. */
  alarmBack: 'Back to normal',
  alarmShow: 'Show this tag now',
  alarmStart: 'Go to start',
  alarmActionsOf: (what: string): string => `Actions: ${what}`,
  alarmAcknowledge: 'Acknowledge',
  alarmAcknowledgeOf: (what: string): string => `Acknowledge: ${what}`,
  alarmAcknowledgeAll: (count: number): string => `Acknowledge all (${count})`,
  alarmUnacknowledge: 'Unacknowledge',
  alarmShelve: 'Shelve',
  alarmShelveHint: 'No notification until the time is up, unless it gets worse.',
  alarmShelveCritical:
    'An alarm that is or was critical can be shelved for at most 1 h, and needs a reason.',
  alarmShelfReason: 'Reason',
  alarmShelfReasonOptional: 'Reason (optional)',
  alarmShelveMinutes: (minutes: number): string => `For ${minutes} min`,
  alarmShelveHours: (hours: number): string => `For ${hours} h`,
  alarmShelved: (until: string, reason: string, by: string): string =>
    `shelved ${by === '' ? '' : `by ${by} `}until ${until}${reason === '' ? '' : `: ${reason}`}`,
  alarmUnshelve: 'Unshelve',
  alarmResolved: 'resolved',
  alarmUndo: 'Undo',
  /** What the operator has just done. */
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
  alarmFilterHint: 'Filter …',
  alarmOrder: 'Order',
  alarmOrders: { cause: 'By cause', newest: 'Newest first', tag: 'By tag' },
  alarmSaveCsv: 'Save alarms as CSV',
  alarmsNoMatch: 'No alarm matches the filter.',
  alarmCount: (count: number): string => counted(count, 'alarm', 'alarms'),
  alarmTags: (tags: readonly string[], more: number): string =>
    `${tags.length === 1 ? 'Tag' : 'Tags'} ${tags.join(', ')}${more > 0 ? ` and ${more} more` : ''}`,
  alarmsNone: 'No alarm is active',
  alarmsNoneHint:
    'An alarm is raised after two bad scans in a row. A pest, or missing data from the greenhouse, raises one at once.',
  alarmsWait: (tags: number): string =>
    `${counted(tags, 'tag', 'tags')} waiting for a second scan: no alarm yet`,
  alarmNotYet: 'waiting for a second scan',
  alarmsNotYet: 'Waiting for the list of alarms',
  alarmsStarting: 'Recorded data is still being read: more alarms may follow.',
  alarmsHeard: (since: string): string =>
    `Nothing is recorded, so alarms before ${since} are unknown.`,
  alarmsLost: (clock: string): string => `As last received at ${clock}. Later events are unknown.`,
  alarmsOfNow: (moment: string): string =>
    `These are the current alarms. The rest of the page shows ${moment}.`,
  alarmsMine: '“Acknowledged” and “shelved” apply in this browser only.',

  alarmTell: 'Notify me of alarms',
  alarmSound: 'Sound',
  alarmSoundHint: 'A short sound for new alarms, at most one in 10 s.',
  alarmSoundWaits: 'The browser allows sound after your first click on this page.',
  alarmSoundNone: 'This browser cannot play sound.',
  alarmNotify: 'Notification',
  alarmNotifyHint: 'The browser notifies you of new alarms while you look at something else.',
  alarmNotifyInsecure:
    'Browsers allow this only on addresses that begin with https:// or http://localhost.',
  alarmNotifyRefused:
    'This browser blocks notifications. Allow them for this page in its settings.',
  alarmNotifyNone: 'This browser does not support notifications.',
  alarmNotifyTitle: (count: number): string => counted(count, 'new alarm', 'new alarms'),

  /** To hear, and while another moment is looked at. */
  alarmsRaised: (alarms: readonly string[], more: number): string =>
    `New: ${alarms.join('; ')}${more > 0 ? ` and ${more} more` : ''}`,
  alarmsCleared: (alarms: readonly string[], more: number): string =>
    `Resolved: ${alarms.join('; ')}${more > 0 ? ` and ${more} more` : ''}`,
  alarmsMeanwhile: (alarm: string, more: number): string =>
    `New alarm: ${alarm}${more > 0 ? ` and ${counted(more, 'more alarm', 'more alarms')}` : ''}`,
} as const;
