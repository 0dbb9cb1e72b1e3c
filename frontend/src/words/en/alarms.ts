/** Alarms: what is active, put aside and over, and how it is told of. */
import { counted } from './counted';

export const ALARMS = {
  alarms: 'Alarms',
  listChoice: 'Beside the map',
  /** Beside the word, to hear. */
  alarmsCount: (unseen: number, active: number): string =>
    active === 0 ? 'none active' : `${active} active, ${unseen} of them not seen`,
  alarmGroups: {
    active: (count: number): string => `Active (${count})`,
    shelved: (count: number): string => `Put aside (${count})`,
    over: (count: number): string => `Over by itself in the last 24 h (${count})`,
  },
  alarmHouse: 'Whole house',
  alarmWhat: (where: string, what: string): string => `${where}: ${what}`,
  alarmSince: (when: string, length: string | null): string =>
    length === null ? `since ${when}` : `since ${when} (${length})`,
  alarmUntil: (from: string, until: string, length: string): string =>
    `${from} until ${until} (${length})`,
  alarmWorst: (reading: string, isCritical: boolean): string =>
    `at worst ${reading}${isCritical ? ' (critical)' : ''}`,
  alarmNew: 'not seen',
  alarmFollow: 'Show where and when it began',
  alarmSeen: 'Mark seen',
  alarmSeenOf: (what: string): string => `Mark seen: ${what}`,
  alarmAllSeen: 'Mark all seen',
  alarmShelve: 'Put aside',
  alarmShelveOf: (what: string): string => `Put aside: ${what}`,
  alarmShelveHint: 'It is not told of for a while, unless it gets worse',
  alarmShelveMinutes: (minutes: number): string => `For ${minutes} min`,
  alarmShelveHours: (hours: number): string => `For ${hours} h`,
  alarmShelved: (until: string): string => `put aside until ${until}`,
  alarmUnshelve: 'Take back',
  alarmUnshelveOf: (what: string): string => `Take back: ${what}`,
  alarmMore: (count: number): string => `Show ${count} more`,
  alarmsNone: 'No alarm is active',
  alarmsNoneHint:
    'An alarm is raised when something is wrong in two scans in a row; a pest, or a house that is not heard of, at once.',
  alarmsNotYet: 'Whether there are alarms is not known yet',
  alarmsStarting: 'The past is still being gone through: more alarms may follow.',
  alarmsHeard: (since: string): string =>
    `Nothing is recorded: alarms from before ${since} are not known.`,
  alarmsLost: (clock: string): string =>
    `As last heard at ${clock}. What has come since is not known.`,
  alarmsOfNow: (moment: string): string =>
    `These are the alarms of now. The rest of the page shows ${moment}.`,
  alarmsMine: '“Seen” and “put aside” hold in this browser alone.',

  alarmTell: 'Tell me of alarms',
  alarmSound: 'Sound',
  alarmSoundHint: 'A short sound for new alarms, at most one in 10 s.',
  alarmSoundWaits: 'The browser plays it after your first click on this page.',
  alarmSoundNone: 'This browser cannot play it.',
  alarmNotify: 'Notification',
  alarmNotifyHint: 'The browser tells of new alarms while you look at something else.',
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
    `Over: ${alarms.join('; ')}${more > 0 ? ` and ${more} more` : ''}`,
  alarmsMeanwhile: (alarm: string, more: number): string =>
    `Now: ${alarm}${more > 0 ? ` and ${counted(more, 'more alarm', 'more alarms')}` : ''}`,
  alarmsTitle: (count: number, title: string): string => `(${count}) ${title}`,
} as const;
