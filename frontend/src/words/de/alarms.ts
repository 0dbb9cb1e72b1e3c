/** Alarme: was ansteht, zurückgestellt und vorbei ist, und wie davon berichtet wird. */
import type { ALARMS as ENGLISH } from '../en/alarms';
import type { In } from '../shape';
import { counted } from './counted';

export const ALARMS: In<typeof ENGLISH> = {
  alarms: 'Alarme',
  listChoice: 'Neben der Karte',
  alarmsCount: (unseen, active) =>
    active === 0 ? 'keiner steht an' : `${active} stehen an, ${unseen} davon nicht gesehen`,
  alarmGroups: {
    active: (count) => `Steht an (${count})`,
    shelved: (count) => `Zurückgestellt (${count})`,
    over: (count) => `Von selbst vorbei, in den letzten 24 h (${count})`,
  },
  alarmHouse: 'Ganzes Haus',
  alarmWhat: (where, what) => `${where}: ${what}`,
  alarmSince: (when, length) => (length === null ? `seit ${when}` : `seit ${when} (${length})`),
  alarmUntil: (from, until, length) => `${from} bis ${until} (${length})`,
  alarmWorst: (reading, isCritical) =>
    `schlimmstenfalls ${reading}${isCritical ? ' (kritisch)' : ''}`,
  alarmNew: 'nicht gesehen',
  alarmFollow: 'Zeigen, wo und wann er begann',
  alarmSeen: 'Als gesehen markieren',
  alarmSeenOf: (what) => `Als gesehen markieren: ${what}`,
  alarmAllSeen: 'Alle als gesehen markieren',
  alarmShelve: 'Zurückstellen',
  alarmShelveOf: (what) => `Zurückstellen: ${what}`,
  alarmShelveHint: 'Er wird eine Weile nicht gemeldet, außer er wird schlimmer',
  alarmShelveMinutes: (minutes) => `Für ${minutes} min`,
  alarmShelveHours: (hours) => `Für ${hours} h`,
  alarmShelved: (until) => `zurückgestellt bis ${until}`,
  alarmUnshelve: 'Zurückholen',
  alarmUnshelveOf: (what) => `Zurückholen: ${what}`,
  alarmMore: (count) => `${count} weitere zeigen`,
  alarmsNone: 'Kein Alarm steht an',
  alarmsNoneHint:
    'Ein Alarm kommt, wenn bei zwei Messungen nacheinander etwas nicht stimmt; bei einem Schädling, oder wenn vom Haus nichts zu hören ist, sofort.',
  alarmsNotYet: 'Ob Alarme anstehen, ist noch nicht bekannt',
  alarmsStarting: 'Die Vergangenheit wird noch durchgesehen: Es können Alarme dazukommen.',
  alarmsHeard: (since) =>
    `Es wird nichts aufgezeichnet: Alarme von vor ${since} sind nicht bekannt.`,
  alarmsLost: (clock) => `Stand von ${clock}. Was seither kam, ist nicht bekannt.`,
  alarmsOfNow: (moment) => `Das sind die Alarme von jetzt. Der Rest der Seite zeigt ${moment}.`,
  alarmsMine: '„Gesehen“ und „zurückgestellt“ gelten nur in diesem Browser.',

  alarmTell: 'Alarme melden',
  alarmSound: 'Ton',
  alarmSoundHint: 'Ein kurzer Ton bei neuen Alarmen, höchstens einer in 10 s.',
  alarmSoundWaits: 'Der Browser spielt ihn nach Ihrem ersten Klick auf dieser Seite.',
  alarmSoundNone: 'Dieser Browser kann ihn nicht spielen.',
  alarmNotify: 'Benachrichtigung',
  alarmNotifyHint: 'Der Browser meldet neue Alarme, während Sie etwas anderes ansehen.',
  alarmNotifyInsecure:
    'Browser erlauben das nur, wenn die Adresse der Seite mit https:// oder mit http://localhost beginnt.',
  alarmNotifyRefused:
    'Dieser Browser lehnt ab. Erlauben Sie Benachrichtigungen für diese Seite in seinen Einstellungen.',
  alarmNotifyNone: 'Dieser Browser kann das nicht.',
  alarmNotifyTitle: (count) => counted(count, 'neuer Alarm', 'neue Alarme'),

  alarmsRaised: (alarms, more) =>
    `Neu: ${alarms.join('; ')}${more > 0 ? ` und ${more} weitere` : ''}`,
  alarmsCleared: (alarms, more) =>
    `Vorbei: ${alarms.join('; ')}${more > 0 ? ` und ${more} weitere` : ''}`,
  alarmsMeanwhile: (alarm, more) =>
    `Jetzt: ${alarm}${more > 0 ? ` und ${counted(more, 'weiterer Alarm', 'weitere Alarme')}` : ''}`,
  alarmsTitle: (count, title) => `(${count}) ${title}`,
};
