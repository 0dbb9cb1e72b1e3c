/** Alarms: what is active, shelved and resolved, and how it is notified. */
import { counted } from './counted';

export const ALARMS = {
  alarms: 'Alarms',
  listChoice: 'Beside the map',
  /** Beside the word, to hear. */
  alarmsCount: (unseen: number, active: number): string =>
    active === 0 ? 'none active' : `${active} active, ${unseen} not acknowledged`,
  alarmGroups: {
    active: (count: number): string => `Active (${count})`,
    shelved: (count: number): string => `Shelved (${count})`,
    resolved: (count: number): string => `Resolved in the last 24 h (${count})`,
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
    last === null
      ? 'now not known'
      : `now not known, last ${last}${age === null ? '' : ` ${age} ago`}`,
  /** Of a pest, in place of how many. */
  alarmPests: { none: 'none', seen: 'seen' },
  alarmWorst: (reading: string): string => `worst ${reading}`,
  alarmFirst: (reading: string): string => `first ${reading}`,
  alarmStatus: { critical: 'critical', healthy: 'in range' },
  alarmShow: 'Show the tag as it is now',
  alarmStart: 'Go to start',
  alarmStartOf: (what: string): string => `Go to start: ${what}`,
  alarmAcknowledge: 'Acknowledge',
  alarmAcknowledgeOf: (what: string): string => `Acknowledge: ${what}`,
  alarmAcknowledgeAll: 'Acknowledge all',
  alarmUnacknowledge: 'Unacknowledge',
  alarmUnacknowledgeOf: (what: string): string => `Unacknowledge: ${what}`,
  alarmShelve: 'Shelve',
  alarmShelveOf: (what: string): string => `Shelve: ${what}`,
  alarmShelveHint: 'You are not notified of it for a while, unless it gets worse.',
  alarmShelveCritical: 'A critical alarm is shelved for 1 h at most, and with a reason.',
  alarmShelfReason: 'Reason',
  alarmShelfReasonOptional: 'Reason (optional)',
  alarmShelveMinutes: (minutes: number): string => `For ${minutes} min`,
  alarmShelveHours: (hours: number): string => `For ${hours} h`,
  alarmShelved: (until: string, reason: string): string =>
    `shelved until ${until}${reason === '' ? '' : `: ${reason}`}`,
  alarmUnshelve: 'Unshelve',
  alarmUnshelveOf: (what: string): string => `Unshelve: ${what}`,
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
  alarmsNewHint: 'The order is held while you are in the list. Show what is new',
  alarmMore: (count: number): string => `Show ${count} more`,
  alarmFilter: 'Filter alarms',
  alarmFilterHint: 'tag, cause …',
  alarmOrder: 'Order',
  alarmOrders: { cause: 'By cause', newest: 'Newest first', tag: 'By tag' },
  alarmSaveCsv: 'Save alarms as CSV',
  alarmsNoMatch: 'No alarm matches the filter.',
  alarmCount: (count: number): string => counted(count, 'alarm', 'alarms'),
  alarmTags: (tags: readonly string[], more: number): string =>
    `${tags.length === 1 ? 'Tag' : 'Tags'} ${tags.join(', ')}${more > 0 ? ` and ${more} more` : ''}`,
  alarmsNone: 'No alarm is active',
  alarmsNoneHint:
    'An alarm is raised when something is wrong in two scans in a row. A pest, or a silent greenhouse, raises one at once.',
  alarmsNotYet: 'It is not known yet whether there are alarms',
  alarmsStarting: 'The past is still being read: more alarms may follow.',
  alarmsHeard: (since: string): string =>
    `Nothing is recorded: alarms from before ${since} are not known.`,
  alarmsLost: (clock: string): string =>
    `As last received at ${clock}. What has happened since is not known.`,
  alarmsOfNow: (moment: string): string =>
    `These are the current alarms. The rest of the page shows ${moment}.`,
  alarmsMine: '“Acknowledged” and “shelved” apply in this browser only.',

  alarmTell: 'Notify me of alarms',
  alarmSound: 'Sound',
  alarmSoundHint: 'A short sound for new alarms, at most one in 10 s.',
  alarmSoundWaits: 'The browser plays it after your first click on this page.',
  alarmSoundNone: 'This browser cannot play it.',
  alarmNotify: 'Notification',
  alarmNotifyHint: 'The browser notifies you of new alarms while you look at something else.',
  alarmNotifyInsecure:
    'Browsers allow it only where the page’s address begins with https:// or with http://localhost.',
  alarmNotifyRefused:
    'This browser refuses. Allow notifications for this page in the browser’s settings.',
  alarmNotifyNone: 'This browser cannot do that.',
  alarmNotifyTitle: (count: number): string => counted(count, 'new alarm', 'new alarms'),

  /** To hear, and while another moment is looked at. */
  alarmsRaised: (alarms: readonly string[], more: number): string =>
    `New: ${alarms.join('; ')}${more > 0 ? ` and ${more} more` : ''}`,
  alarmsCleared: (alarms: readonly string[], more: number): string =>
    `Resolved: ${alarms.join('; ')}${more > 0 ? ` and ${more} more` : ''}`,
  alarmsMeanwhile: (alarm: string, more: number): string =>
    `New alarm: ${alarm}${more > 0 ? ` and ${counted(more, 'more alarm', 'more alarms')}` : ''}`,
  alarmsTitle: (count: number, title: string): string => `(${count}) ${title}`,
} as const;
