/** Alarme: was ansteht, zurückgestellt und behoben ist, und wie es gemeldet wird. */
import type * as EN from '../en/alarms';
import type { In } from '../shape';
import { counted } from './counted';

/** Alarme oder Messpunkte, die nicht genannt sind. */
const further = (more: number): string =>
  more > 0 ? ` und ${counted(more, 'weiterer', 'weitere')}` : '';

export const ALARMS: In<typeof EN.ALARMS> = {
  alarms: 'Alarme',
  listChoice: 'Neben der Karte',
  alarmsCount: (unseen, active) =>
    active === '0' ? 'keine anstehend' : `${active} anstehend, ${unseen} davon nicht quittiert`,
  alarmsNow: (active) => `jetzt ${active}`,
  alarmGroups: {
    active: (count) => `Anstehend (${count})`,
    shelved: (count) => `Zurückgestellt (${count})`,
    resolved: (count) => `Behoben in den letzten 24 h (${count})`,
  },
  alarmHouse: 'Ganzes Gewächshaus',
  alarmWhat: (where, what) => `${where}: ${what}`,
  alarmSince: (when) => `seit ${when}`,
  alarmForOver: (length) => `seit über ${length}`,
  alarmUntil: (from, until, length) => `${from} bis ${until} (${length})`,
  alarmNow: (reading) => `jetzt ${reading}`,
  alarmNowUnknown: (last, age) =>
    last === null
      ? 'jetzt unbekannt'
      : `jetzt unbekannt, zuletzt ${last}${age === null ? '' : ` vor ${age}`}`,
  alarmPests: {
    seen: 'gefunden',
    still: 'weiterhin gefunden',
    gone: 'nicht mehr gefunden',
  },
  alarmWorst: {
    below: (reading) => `min. ${reading}`,
    above: (reading) => `max. ${reading}`,
    pest: (reading) => `max. ${reading}`,
  },
  alarmFirst: (reading) => `anfangs ${reading}`,
  alarmStatus: { critical: 'kritisch', healthy: 'im Idealbereich' },
  alarmBack: 'Wieder normal',
  alarmShow: 'Messpunkt jetzt anzeigen',
  alarmStart: 'Zum Beginn',
  alarmActionsOf: (what) => `Aktionen: ${what}`,
  alarmAcknowledge: 'Quittieren',
  alarmAll: (what, count) =>
    what.includes(' ') ? `${what}: alle (${count})` : `Alle ${what.toLowerCase()} (${count})`,
  alarmAcknowledgedBy: (name, at) => `quittiert von ${name}, ${at}`,
  alarmUnacknowledge: 'Quittierung aufheben',
  alarmShelve: 'Zurückstellen',
  alarmShelveHint: 'Bis dahin keine Meldung, außer es wird schlimmer.',
  alarmShelveCritical:
    'Ein Alarm, der kritisch ist oder war, lässt sich höchstens 1 h zurückstellen, und nur mit Begründung.',
  alarmShelfReason: 'Begründung',
  alarmShelfReasonOptional: 'Begründung (optional)',
  alarmShelveFor: (time) => `Für ${time}`,
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
  alarmsNewHint: 'Die Reihenfolge bleibt, solange die Liste benutzt wird. Neue Alarme anzeigen',
  alarmFilter: 'Alarme filtern',
  alarmFilterHint: 'Filtern …',
  alarmOrder: 'Reihenfolge',
  alarmOrders: { cause: 'Nach Ursache', newest: 'Neueste zuerst', tag: 'Nach Messpunkt' },
  alarmSaveCsv: 'Alarme als CSV speichern',
  alarmsNoMatch: 'Kein Alarm passt zum Filter.',
  alarmCount: (count) => counted(count, 'Alarm', 'Alarme'),
  further,
  alarmTags: (tags, more) =>
    `${tags.length === 1 ? 'Messpunkt' : 'Messpunkte'} ${tags.join(', ')}${further(more)}`,
  alarmsNone: 'Keine anstehenden Alarme',
  alarmsNoneHint:
    'Ein Alarm wird nach zwei auffälligen Messungen nacheinander ausgelöst, bei einem Schädling oder fehlenden Daten sofort.',
  alarmsWait: (tags) =>
    `${counted(tags, 'Messpunkt wartet', 'Messpunkte warten')} auf eine zweite Messung: noch kein Alarm`,
  alarmNotYet: 'noch kein Alarm',
  alarmsNotYet: 'Warten auf die Liste der Alarme',
  alarmsStarting: 'Die Aufzeichnung wird noch gelesen: Weitere Alarme können folgen.',
  alarmsNoTime: 'Solange die Zeit unbekannt ist, können Alarme fehlen.',
  alarmsReceived: (since) =>
    `Es wird nichts aufgezeichnet; Alarme vor ${since} sind nicht bekannt.`,
  alarmsLost: 'Letzter empfangener Stand. Spätere Ereignisse sind nicht bekannt.',
  alarmsOfNow: (moment) => `Das sind die aktuellen Alarme. Der Rest der Seite zeigt ${moment}.`,
  alarmsMine: '„Quittiert“ und „zurückgestellt“ gelten nur in diesem Browser.',

  alarmNotifyMe: 'Alarme melden',
  alarmSound: 'Ton',
  alarmSoundHints: {
    ready: 'Ein kurzer Ton bei neuen Alarmen, höchstens einer alle 10 s.',
    waits: 'Der Browser erlaubt den Ton nach dem ersten Klick auf dieser Seite.',
    none: 'Dieser Browser kann keinen Ton abspielen.',
  },
  alarmNotify: 'Benachrichtigung',
  alarmNotifyHint:
    'Der Browser meldet neue Alarme, solange diese Seite im Hintergrund geöffnet ist.',
  alarmNotifyPushed: 'Kritische Alarme kommen auch bei geschlossener Seite.',
  alarmNotifyNot: {
    insecure:
      'Browser erlauben das nur bei Adressen, die mit https:// oder http://localhost beginnen.',
    refused:
      'Dieser Browser blockiert Benachrichtigungen. Bitte in seinen Einstellungen für diese Seite erlauben.',
    none: 'Dieser Browser unterstützt keine Benachrichtigungen.',
  },
  alarmNotifyTitle: (count) => counted(count, 'neuer Alarm', 'neue Alarme'),

  alarmsRaised: (alarms, more) => `Neu: ${alarms.join('; ')}${further(more)}`,
  alarmsCleared: (alarms, more) => `Behoben: ${alarms.join('; ')}${further(more)}`,
  alarmsMeanwhile: (alarm, more) =>
    `Neuer Alarm: ${alarm}${more > 0 ? ` und ${counted(more, 'weiterer Alarm', 'weitere Alarme')}` : ''}`,
};

const ONE_OR_MANY = {
  healthy: 'Gesund',
  stressed: 'Gestresst',
  critical: 'Kritisch',
  unknown: 'Unbekannt',
};

/** Urteile und ihre Gründe. */
export const HEALTH: In<typeof EN.HEALTH> = {
  health: ONE_OR_MANY,
  healthMany: ONE_OR_MANY,
  reasons: {
    sides: { below: 'unter', above: 'über' },
    must: {
      below: (limit) => `noch nicht über ${limit}`,
      above: (limit) => `noch nicht unter ${limit}`,
    },
    just: {
      below: (limit) => `knapp unter ${limit}`,
      above: (limit) => `knapp über ${limit}`,
    },
    readingFailed: (sensor) => `${sensor}: Sensor liefert keinen Wert`,
    implausible: (reading) => `${reading}: kein plausibler Wert`,
    scanFailed: (outcome, age) => `Fehlversuch: ${outcome}${age === null ? '' : `, vor ${age}`}`,
    pest: (count) =>
      count > 0 ? `${counted(count, 'Schädling', 'Schädlinge')} gefunden` : 'Schädlinge gefunden',
    old: (sensor, age, holds, isDated) => {
      if (!isDated) {
        return sensor === ''
          ? 'Noch kein Messwert'
          : `${sensor}: kein Messwert mit bekanntem Alter`;
      }
      const since =
        age === null
          ? sensor === ''
            ? 'Schon länger nicht gemessen'
            : 'schon länger nicht gemessen'
          : sensor === ''
            ? `Seit ${age} nicht gemessen`
            : `seit ${age} kein Messwert`;
      return `${sensor === '' ? '' : `${sensor}: `}${since}${holds === null ? '' : ` (Messwerte gelten ${holds} lang)`}`;
    },
    outOfRange: 'außerhalb des Idealbereichs',
    changed: (reading) => `${reading}: möglicher Sensorfehler`,
    silent: 'Keine aktuellen Daten vom digitalen Zwilling',
    stopped: 'Es wird nichts mehr gemessen: Der Roboter steht, oder seine Daten kommen nicht an',
    other: (kind, sensor) => (sensor === '' ? kind : `${sensor}: ${kind}`),
  },
  airCause: { damp: 'Luft zu feucht', dry: 'Luft zu trocken' },
  todo: {
    sensors: {
      temperature: { below: 'Heizen oder Lüftung schließen', above: 'Lüften oder schattieren' },
      co2: { below: 'CO₂ dosieren oder lüften', above: 'Lüften, CO₂-Dosierung prüfen' },
      light: { below: 'Assimilationslicht einschalten', above: 'Schattieren' },
      soil_moisture: { below: 'Gießen', above: 'Weniger gießen, Drainage prüfen' },
    },
    air: { damp: 'Lüften und heizen', dry: 'Befeuchten' },
    range: 'Klimaregelung prüfen',
    watch: 'Beobachten',
    reading_failed: 'Sensor prüfen',
    scan_failed: 'Weg und Messpunkt prüfen',
    pest: 'Prüfen und bekämpfen',
    old: 'Route des Roboters prüfen',
    changed: 'Mit zweitem Messgerät vergleichen',
    silent: 'Zwilling, Server und Netz prüfen',
    stopped: 'Nach dem Roboter sehen',
    other: 'Vor Ort prüfen',
  },
  todoPestAgain: 'Nochmals kontrollieren',
  todoWell: 'Nächste gute Messung abwarten',
  todoAlso: (tags) => (tags === 1 ? 'auch Messpunkt' : 'auch Messpunkte'),
  todoLabel: 'Jetzt zu tun',
  reasonsLabel: 'Warum',
  healthHeading: 'Zustand des Gewächshauses',
  healthMostUnknown: 'Von mehr als der Hälfte der Messpunkte ist nichts bekannt',
  healthSomeUnknown: (count) =>
    `${counted(count, 'Messpunkt lässt', 'Messpunkte lassen')} sich nicht beurteilen`,
  healthDay: (isDay, source) =>
    `Es gelten die ${isDay ? 'Tagesbereiche' : 'Nachtbereiche'}: ${source}`,
  healthDaySource: {
    light: 'nach dem im Gewächshaus gemessenen Licht',
    clock: 'nach der Uhr, da kein Licht gemessen wird',
    assumed: 'angenommen, da weder Licht noch Uhrzeit bekannt sind',
  },
  idealParts: { any: 'ideal', day: 'ideal tagsüber', night: 'ideal nachts' },
  healthAllWell: 'Alle beurteilten Messwerte liegen im Idealbereich',
  healthDespite: (alarms) =>
    alarms === '1'
      ? '1 Alarm steht noch an: mit der nächsten guten Messung oder Kontrolle behoben'
      : `${alarms} Alarme stehen noch an: mit der nächsten guten Messung oder Kontrolle behoben`,
  healthAcknowledged: 'quittiert',
  healthNotCurrent: 'Nicht aktuell',
  healthNoTime: 'Nicht beurteilt, solange die Zeit unbekannt ist',
  healthNothing: 'Noch kein Messwert zu beurteilen',
  healthNoRange: 'Kein Messwert mit Idealbereich',
  healthFilter: ', nur diese Messpunkte anzeigen',
  scanInterval: (interval) => `je Messpunkt alle ${interval}`,
  houseLast: (age) => `letzte Messung vor ${age}`,
  houseNever: 'noch keine Messung',
  houseLate: (age, interval) => `Seit ${age} keine Messung (sonst je Messpunkt alle ${interval})`,
  houseOverdue: (count) =>
    count === 0
      ? 'kein Messpunkt überfällig'
      : counted(count, 'Messpunkt überfällig', 'Messpunkte überfällig'),
  tagChosen: (tag, health, row, rows) => `Messpunkt ${tag}, ${health}, ${row} von ${rows}`,
  attention: 'Handlungsbedarf',
  attentionNone: 'Kein Handlungsbedarf',
  attentionNoneKnown: (unknown) =>
    `Soweit bekannt kein Handlungsbedarf; keine Daten von ${counted(unknown, 'Messpunkt', 'Messpunkten')}`,
  attentionMore: (count) => `+ ${counted(count, 'weiterer', 'weitere')}`,

  tooLow: (by) => (by === null ? 'zu tief' : `um ${by} zu tief`),
  tooHigh: (by) => (by === null ? 'zu hoch' : `um ${by} zu hoch`),
  side: { below: 'tief', above: 'hoch' },
};
