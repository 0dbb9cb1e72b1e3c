/** Alarme: was ansteht, zurückgestellt und behoben ist, und wie es gemeldet wird. */
import type { ALARMS as ENGLISH } from '../en/alarms';
import type { In } from '../shape';
import { counted } from './counted';

export const ALARMS: In<typeof ENGLISH> = {
  alarms: 'Alarme',
  listChoice: 'Neben der Karte',
  alarmsCount: (unseen, active) =>
    active === 0 ? 'keiner steht an' : `${active} stehen an, ${unseen} davon nicht quittiert`,
  alarmGroups: {
    active: (count) => `Steht an (${count})`,
    shelved: (count) => `Zurückgestellt (${count})`,
    resolved: (count) => `Behoben in den letzten 24 h (${count})`,
  },
  alarmHouse: 'Ganzes Gewächshaus',
  alarmWhat: (where, what) => `${where}: ${what}`,
  alarmSince: (when, length) => (length === null ? `seit ${when}` : `seit ${when} (${length})`),
  alarmUntil: (from, until, length) => `${from} bis ${until} (${length})`,
  alarmNow: (reading) => `jetzt ${reading}`,
  alarmNowUnknown: (last, age) =>
    last === null
      ? 'jetzt unbekannt'
      : `jetzt unbekannt, zuletzt ${last}${age === null ? '' : ` vor ${age}`}`,
  alarmPests: { none: 'keine', seen: 'gesehen' },
  alarmWorst: (reading) => `schlimmstenfalls ${reading}`,
  alarmFirst: (reading) => `anfangs ${reading}`,
  alarmStatus: { critical: 'kritisch', healthy: 'im Sollbereich' },
  alarmShow: 'Messpunkt zeigen, wie er jetzt ist',
  alarmStart: 'Zum Beginn',
  alarmStartOf: (what) => `Zum Beginn: ${what}`,
  alarmAcknowledge: 'Quittieren',
  alarmAcknowledgeOf: (what) => `Quittieren: ${what}`,
  alarmAcknowledgeAll: 'Alle quittieren',
  alarmUnacknowledge: 'Aufheben',
  alarmUnacknowledgeOf: (what) => `Quittierung aufheben: ${what}`,
  alarmShelve: 'Zurückstellen',
  alarmShelveOf: (what) => `Zurückstellen: ${what}`,
  alarmShelveHint: 'Er wird eine Weile nicht gemeldet, außer er wird schlimmer.',
  alarmShelveCritical:
    'Ein kritischer Alarm lässt sich höchstens 1 h zurückstellen, und nur mit Begründung.',
  alarmShelfReason: 'Begründung',
  alarmShelfReasonOptional: 'Begründung (freiwillig)',
  alarmShelveMinutes: (minutes) => `Für ${minutes} min`,
  alarmShelveHours: (hours) => `Für ${hours} h`,
  alarmShelved: (until, reason) =>
    `zurückgestellt bis ${until}${reason === '' ? '' : `: ${reason}`}`,
  alarmUnshelve: 'Zurückholen',
  alarmUnshelveOf: (what) => `Zurückholen: ${what}`,
  alarmUndo: 'Rückgängig',
  alarmDone: {
    acknowledge: (count) => `${counted(count, 'Alarm', 'Alarme')} quittiert`,
    unacknowledge: (count) => `${counted(count, 'Alarm', 'Alarme')} nicht mehr quittiert`,
    shelve: (count) => `${counted(count, 'Alarm', 'Alarme')} zurückgestellt`,
    unshelve: (count) => `${counted(count, 'Alarm', 'Alarme')} zurückgeholt`,
  },
  alarmsNew: (count) => `${count} neu`,
  alarmsNewHint: 'Die Reihenfolge bleibt, solange Sie in der Liste sind. Neue zeigen',
  alarmMore: (count) => `${count} weitere zeigen`,
  alarmFilter: 'Alarme filtern',
  alarmFilterHint: 'Messpunkt, Ursache …',
  alarmOrder: 'Reihenfolge',
  alarmOrders: { cause: 'Nach Ursache', newest: 'Neueste zuerst', tag: 'Nach Messpunkt' },
  alarmSaveCsv: 'Alarme als CSV speichern',
  alarmsNoMatch: 'Kein Alarm passt zum Filter.',
  alarmCount: (count) => counted(count, 'Alarm', 'Alarme'),
  alarmTags: (tags, more) =>
    `${tags.length === 1 ? 'Messpunkt' : 'Messpunkte'} ${tags.join(', ')}${more > 0 ? ` und ${more} weitere` : ''}`,
  alarmsNone: 'Kein Alarm steht an',
  alarmsNoneHint:
    'Ein Alarm kommt, wenn bei zwei Messungen nacheinander etwas nicht stimmt. Bei einem Schädling, oder wenn aus dem Gewächshaus nichts kommt, kommt er sofort.',
  alarmsNotYet: 'Ob Alarme anstehen, ist noch nicht bekannt',
  alarmsStarting: 'Die Vergangenheit wird noch gelesen: Es können Alarme dazukommen.',
  alarmsHeard: (since) =>
    `Es wird nichts aufgezeichnet: Alarme von vor ${since} sind nicht bekannt.`,
  alarmsLost: (clock) => `Stand von ${clock}. Was seither kam, ist nicht bekannt.`,
  alarmsOfNow: (moment) => `Das sind die aktuellen Alarme. Der Rest der Seite zeigt ${moment}.`,
  alarmsMine: '„Quittiert“ und „zurückgestellt“ gelten nur in diesem Browser.',

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
    `Behoben: ${alarms.join('; ')}${more > 0 ? ` und ${more} weitere` : ''}`,
  alarmsMeanwhile: (alarm, more) =>
    `Neuer Alarm: ${alarm}${more > 0 ? ` und ${counted(more, 'weiterer Alarm', 'weitere Alarme')}` : ''}`,
  alarmsTitle: (count, title) => `(${count}) ${title}`,
};
