/** Urteile und ihre Gründe. */
import type { HEALTH as ENGLISH } from '../en/health';
import type { In } from '../shape';
import { counted } from './counted';

const ONE_OR_MANY = {
  healthy: 'Gesund',
  stressed: 'Gestresst',
  critical: 'Kritisch',
  unknown: 'Unbekannt',
};

export const HEALTH: In<typeof ENGLISH> = {
  health: ONE_OR_MANY,
  healthMany: ONE_OR_MANY,
  reasons: {
    sides: { below: 'unter', above: 'über' },
    wasBeyond: (side, limit, status, until) =>
      `war ${side} ${limit}; bleibt ${status} bis ${until}`,
    just: {
      below: (limit) => `knapp unter ${limit}`,
      above: (limit) => `knapp über ${limit}`,
    },
    readingFailed: (sensor) => `${sensor}: Der Sensor liefert keinen Wert`,
    implausible: (reading) => `${reading}: kein plausibler Wert`,
    scanFailed: (outcome, age) =>
      `Letzte Messung fehlgeschlagen: ${outcome}${age === null ? '' : `, vor ${age}`}`,
    pest: (count) =>
      count > 0
        ? `${counted(count, 'Schädling', 'Schädlinge')} festgestellt`
        : 'Schädlinge festgestellt',
    old: (sensor, age, holds, isDated) => {
      const since = !isDated
        ? sensor === ''
          ? 'Keine Messung mit bekannter Zeit'
          : 'kein Messwert mit bekannter Zeit'
        : age === null
          ? sensor === ''
            ? 'Schon länger nicht gemessen'
            : 'schon länger nicht gemessen'
          : sensor === ''
            ? `Seit ${age} nicht gemessen`
            : `seit ${age} kein Messwert`;
      return `${sensor === '' ? '' : `${sensor}: `}${since}${holds === null ? '' : ` (Messwerte gelten ${holds} lang)`}`;
    },
    outOfRange: 'außerhalb des Sollbereichs',
    changed: (reading) => `${reading}: möglicher Sensorfehler`,
    silent: 'Keine Daten vom digitalen Zwilling: Die letzten Daten können veraltet sein',
    stopped: 'Es wird nichts mehr gemessen: Der Roboter steht, oder seine Daten kommen nicht an',
    other: (kind, sensor) => (sensor === '' ? kind : `${sensor}: ${kind}`),
  },
  todo: {
    sensors: {
      temperature: { below: 'Heizen oder Lüftung schließen', above: 'Lüften oder schattieren' },
      humidity: { below: 'Befeuchten', above: 'Lüften und heizen' },
      co2: { below: 'CO₂ dosieren oder lüften', above: 'Lüften, CO₂-Dosierung prüfen' },
      light: { below: 'Assimilationslicht einschalten', above: 'Schattieren' },
      soil_moisture: { below: 'Bewässern', above: 'Weniger bewässern, Drainage prüfen' },
      vpd: { below: 'Lüften und heizen', above: 'Befeuchten oder schattieren' },
    },
    range: 'Klimaregelung prüfen',
    reading_failed: 'Sensor prüfen',
    scan_failed: 'Weg und Messpunkt prüfen',
    pest: 'Prüfen und bekämpfen',
    old: 'Route des Roboters prüfen',
    changed: 'Mit zweitem Messgerät vergleichen',
    silent: 'Zwilling, Server und Netz prüfen',
    stopped: 'Nach dem Roboter sehen',
    other: 'Vor Ort prüfen',
  },
  todoPestAgain: 'Nochmals kontrollieren: Ohne Befund ist der Alarm behoben',
  todoWell: 'Mit der nächsten guten Messung behoben',
  todoAlso: 'auch',
  todoLabel: 'Jetzt zu tun',
  reasonsLabel: 'Warum',
  healthHeading: 'Zustand des Gewächshauses',
  healthDriver: (tag, reason) => `Messpunkt ${tag}: ${reason}`,
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
  healthIdeal: (ideal, low, high, unit) => `${ideal} ${low} bis ${high} ${unit}`.trim(),
  healthAllWell: 'Alle beurteilten Messwerte liegen im Idealbereich',
  healthDespite: (alarms) =>
    alarms === 1
      ? '1 Alarm steht noch an: nach zwei guten Messungen behoben'
      : `${alarms} Alarme stehen noch an: nach je zwei guten Messungen behoben`,
  healthAcknowledged: 'quittiert',
  healthNotCurrent: 'Nicht aktuell',
  healthNothing: 'Noch kein Messwert zu beurteilen',
  healthFilter: ', nur diese Messpunkte anzeigen',
  houseRhythm: (interval) => `alle ${interval} eine Messung`,
  houseLast: (age) => `letzte Messung vor ${age}`,
  houseNever: 'noch keine Messung',
  houseLate: (age, interval) => `Seit ${age} keine Messung (sonst alle ${interval})`,
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

  tooLow: (by) => (by === null ? 'zu niedrig' : `um ${by} zu niedrig`),
  tooHigh: (by) => (by === null ? 'zu hoch' : `um ${by} zu hoch`),
  side: { below: 'tief', above: 'hoch' },
  below: 'unter Ideal',
  above: 'über Ideal',
};
