/** Urteile und ihre Gründe. */
import type { HEALTH as ENGLISH } from '../en/health';
import type { In } from '../shape';
import { counted } from './counted';

export const HEALTH: In<typeof ENGLISH> = {
  health: {
    healthy: 'Gesund',
    stressed: 'Gestresst',
    critical: 'Kritisch',
    unknown: 'Unbekannt',
  },
  reasons: {
    sides: { below: 'unter', above: 'über' },
    range: (reading, side, limit, isCritical) =>
      `${reading}, ${side} ${limit}${isCritical ? ' (kritisch)' : ''}`,
    beyond: (sensor, side, limit) => `${sensor} ${side} ${limit}`,
    readingFailed: (sensor) => `${sensor}: Der Sensor liefert keinen Wert`,
    implausible: (reading) => `${reading}: Das misst kein heiler Sensor`,
    scanFailed: (outcome, age) =>
      `Letzte Messung gescheitert: ${outcome}${age === null ? '' : `, vor ${age}`}`,
    pest: (count) =>
      count > 0 ? `${counted(count, 'Schädling', 'Schädlinge')} gesehen` : 'Schädling gesehen',
    old: (sensor, age, holds, isDated) => {
      const since = !isDated
        ? sensor === ''
          ? 'Keine Messung mit bekannter Zeit'
          : 'kein Messwert mit bekannter Zeit'
        : age === null
          ? sensor === ''
            ? 'Länger nicht gemessen'
            : 'länger nicht gemessen'
          : sensor === ''
            ? `Seit ${age} nicht gemessen`
            : `seit ${age} kein Messwert`;
      return `${sensor === '' ? '' : `${sensor}: `}${since}${holds === null ? '' : ` (Messwerte gelten ${holds})`}`;
    },
    outOfRange: 'außerhalb des Bereichs',
    changed: (reading) =>
      `${reading}, verändert gegenüber den eigenen früheren Werten und den Nachbarn`,
    silent: 'Der Zwilling schweigt: Was zuletzt gehört wurde, sagt nichts über jetzt',
    stopped:
      'Es wird kein Messpunkt mehr gemessen: Der Roboter steht, oder man hört nichts von ihm',
    other: (kind, sensor) => (sensor === '' ? kind : `${sensor}: ${kind}`),
  },
  reasonsLabel: 'Warum',
  healthHeading: 'Zustand des Gewächshauses',
  healthDriver: (tag, reason) => `Messpunkt ${tag}: ${reason}`,
  healthMostUnknown: 'Mehr als die Hälfte der Messpunkte ist unbekannt',
  healthSomeUnknown: (count) =>
    `${counted(count, 'Messpunkt lässt', 'Messpunkte lassen')} sich nicht beurteilen`,
  healthDay: (isDay, source) =>
    `Beurteilt nach den Bereichen für ${isDay ? 'den Tag' : 'die Nacht'}: ${source}`,
  healthDaySource: {
    light: 'So sagt es das Licht im Haus',
    clock: 'So sagt es die Uhr, denn Licht wird nicht gemessen',
    assumed: 'angenommen, denn weder Licht noch Uhr geben Auskunft',
  },
  idealParts: { any: 'ideal', day: 'ideal am Tag', night: 'ideal bei Nacht' },
  healthIdeal: (ideal, low, high, unit) => `${ideal} ${low} bis ${high} ${unit}`.trim(),
  healthAllWell: 'Jeder beurteilte Messwert liegt im Idealbereich',
  healthDespite: (alarms) =>
    alarms === 1
      ? '1 Alarm steht noch an: Zwei gute Messungen beheben ihn'
      : `${alarms} Alarme stehen noch an: Je zwei gute Messungen beheben sie`,
  healthNothing: 'Noch kein Messwert zu beurteilen',
  healthFilter: ', nur diese Messpunkte zeigen',
  houseRhythm: (interval) => `alle ${interval} ein Scan`,
  houseLast: (age) => `letzter Scan vor ${age}`,
  houseNever: 'noch kein Scan',
  houseOverdue: (count) =>
    count === 0
      ? 'kein Messpunkt überfällig'
      : counted(count, 'Messpunkt überfällig', 'Messpunkte überfällig'),
  tagChosen: (tag, health, row, rows) => `Messpunkt ${tag}, ${health}, ${row} von ${rows}`,
  attention: 'Braucht Aufmerksamkeit',
  attentionNone: 'Nichts braucht Aufmerksamkeit',
  attentionNoneKnown: (unknown) =>
    `Soweit bekannt, braucht nichts Aufmerksamkeit; über ${counted(unknown, 'Messpunkt', 'Messpunkte')} ist nichts bekannt`,
  attentionMore: (count) => `+ ${count} weitere`,

  tooLow: (by) => (by === null ? 'zu niedrig' : `zu niedrig um ${by}`),
  tooHigh: (by) => (by === null ? 'zu hoch' : `zu hoch um ${by}`),
  below: 'unter ideal',
  above: 'über ideal',
};
