/** Alarme: was ansteht, zurückgestellt und behoben ist, und wie es gemeldet wird. */
import type { ALARMS as ENGLISH } from '../en/alarms';
import type { In } from '../shape';
import { counted } from './counted';

/** Alarme oder Messpunkte, die nicht genannt sind. */
const furtherText = (more: number): string =>
  more > 0 ? ` und ${counted(more, 'weiterer', 'weitere')}` : '';

export const ALARMS: In<typeof ENGLISH> = {
  alarms: 'Alarme',
  listChoice: 'Neben der Karte',
  alarmsCount: (unseen, active) =>
    active === 0 ? 'keine anstehend' : `${active} anstehend, ${unseen} davon nicht quittiert`,
  alarmGroups: {
    active: (count) => `Anstehend (${count})`,
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
  alarmPests: { none: 'keine festgestellt', seen: 'festgestellt' },
  alarmWorst: {
    below: (reading) => `Tiefstwert ${reading}`,
    above: (reading) => `Höchstwert ${reading}`,
    pest: (reading) => `höchste Anzahl ${reading}`,
  },
  alarmFirst: (reading) => `anfangs ${reading}`,
  alarmStatus: { critical: 'kritisch', healthy: 'im Sollbereich' },
  alarmBack: 'Wieder normal',
  alarmShow: 'Messpunkt jetzt anzeigen',
  alarmStart: 'Zum Beginn',
  alarmActionsOf: (what) => `Aktionen: ${what}`,
  alarmAcknowledge: 'Quittieren',
  alarmAcknowledgeOf: (what) => `Quittieren: ${what}`,
  alarmAcknowledgeAll: (count) => `Alle quittieren (${count})`,
  alarmUnacknowledge: 'Quittierung aufheben',
  alarmShelve: 'Zurückstellen',
  alarmShelveHint: 'Bis dahin keine Meldung, außer es wird schlimmer.',
  alarmShelveCritical:
    'Ein Alarm, der kritisch ist oder war, lässt sich höchstens 1 h zurückstellen, und nur mit Begründung.',
  alarmShelfReason: 'Begründung',
  alarmShelfReasonOptional: 'Begründung (optional)',
  alarmShelveMinutes: (minutes) => `Für ${minutes} min`,
  alarmShelveHours: (hours) => `Für ${hours} h`,
  alarmShelved: (until, reason, by) =>
    `zurückgestellt ${by === '' ? '' : `von ${by} `}bis ${until}${reason === '' ? '' : `: ${reason}`}`,
  alarmUnshelve: 'Wieder aktivieren',
  alarmResolved: 'behoben',
  alarmUndo: 'Rückgängig',
  alarmDone: {
    acknowledge: (count) => `${counted(count, 'Alarm', 'Alarme')} quittiert`,
    unacknowledge: (count) => `${counted(count, 'Alarm', 'Alarme')} nicht mehr quittiert`,
    shelve: (count) => `${counted(count, 'Alarm', 'Alarme')} zurückgestellt`,
    unshelve: (count) => `${counted(count, 'Alarm', 'Alarme')} wieder aktiviert`,
  },
  alarmsNew: (count) => `${count} neu`,
  alarmsNewHint: 'Die Reihenfolge bleibt, solange Sie die Liste benutzen. Neue Alarme anzeigen',
  alarmFilter: 'Alarme filtern',
  alarmFilterHint: 'Filtern …',
  alarmOrder: 'Reihenfolge',
  alarmOrders: { cause: 'Nach Ursache', newest: 'Neueste zuerst', tag: 'Nach Messpunkt' },
  alarmSaveCsv: 'Alarme als CSV speichern',
  alarmsNoMatch: 'Kein Alarm passt zum Filter.',
  alarmCount: (count) => counted(count, 'Alarm', 'Alarme'),
  alarmTags: (tags, more) =>
    `${tags.length === 1 ? 'Messpunkt' : 'Messpunkte'} ${tags.join(', ')}${furtherText(more)}`,
  alarmsNone: 'Keine anstehenden Alarme',
  alarmsNoneHint:
    'Ein Alarm wird nach zwei auffälligen Messungen nacheinander ausgelöst, bei einem Schädling oder fehlenden Daten sofort.',
  alarmsWait: (tags) =>
    `${counted(tags, 'Messpunkt wartet', 'Messpunkte warten')} auf eine zweite Messung: noch kein Alarm`,
  alarmNotYet: 'wartet auf eine zweite Messung',
  alarmsNotYet: 'Warten auf die Liste der Alarme',
  alarmsStarting: 'Die Aufzeichnung wird noch gelesen: Weitere Alarme können folgen.',
  alarmsHeard: (since) => `Es wird nichts aufgezeichnet; Alarme vor ${since} sind nicht bekannt.`,
  alarmsLost: (clock) => `Zuletzt empfangen um ${clock}. Spätere Ereignisse sind nicht bekannt.`,
  alarmsOfNow: (moment) => `Das sind die aktuellen Alarme. Der Rest der Seite zeigt ${moment}.`,
  alarmsMine: '„Quittiert“ und „zurückgestellt“ gelten nur in diesem Browser.',

  alarmTell: 'Alarme melden',
  alarmSound: 'Ton',
  alarmSoundHint: 'Ein kurzer Ton bei neuen Alarmen, höchstens einer in 10 s.',
  alarmSoundWaits: 'Der Browser erlaubt den Ton nach Ihrem ersten Klick auf dieser Seite.',
  alarmSoundNone: 'Dieser Browser kann keinen Ton abspielen.',
  alarmNotify: 'Benachrichtigung',
  alarmNotifyHint: 'Der Browser meldet neue Alarme, auch wenn Sie gerade etwas anderes ansehen.',
  alarmNotifyInsecure:
    'Browser erlauben das nur bei Adressen, die mit https:// oder http://localhost beginnen.',
  alarmNotifyRefused:
    'Dieser Browser blockiert Benachrichtigungen. Bitte in seinen Einstellungen für diese Seite erlauben.',
  alarmNotifyNone: 'Dieser Browser unterstützt keine Benachrichtigungen.',
  alarmNotifyTitle: (count) => counted(count, 'neuer Alarm', 'neue Alarme'),

  alarmsRaised: (alarms, more) => `Neu: ${alarms.join('; ')}${furtherText(more)}`,
  alarmsCleared: (alarms, more) => `Behoben: ${alarms.join('; ')}${furtherText(more)}`,
  alarmsMeanwhile: (alarm, more) =>
    `Neuer Alarm: ${alarm}${more > 0 ? ` und ${counted(more, 'weiterer Alarm', 'weitere Alarme')}` : ''}`,
};
