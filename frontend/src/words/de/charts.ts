/** Die Verläufe und ihre Tabellen. */
import type { CHARTS as ENGLISH } from '../en/charts';
import type { In } from '../shape';
import { counted } from './counted';

export const CHARTS: In<typeof ENGLISH> = {
  charts: 'Verläufe',
  chartOf: (sensor) => `Verlauf: ${sensor}`,
  chartsBy: { tag: 'Ein Messpunkt', sensor: 'Mehrere' },
  chartsByLegend: 'Was gezeigt wird',
  chartSpan: (from, to) => `${from} bis ${to}`,
  chartSummary: (count, latest, at, low, high, gaps) =>
    `${counted(count, 'Messwert', 'Messwerte')}, der letzte ${latest} (${at}), ` +
    `zwischen ${low} und ${high}, ${gaps === 0 ? 'keine Lücke' : counted(gaps, 'Lücke', 'Lücken')}.`,
  chartEmpty: 'Kein Messwert in diesem Zeitraum.',
  chartNeedsDay: (known) =>
    known === null
      ? 'Braucht 24 h Messwerte ohne Lücke von über 3 h'
      : `Braucht 24 h Messwerte; bisher ${known}`,
  chartLoading: 'Frühere Daten werden geladen',
  chartFailed: (reason) =>
    `Frühere Daten konnten nicht geladen werden; die Seite versucht es weiter. ${reason}`,
  chartMissing: 'Dieser Zwilling zeichnet nichts auf.',
  chartMissingHint: 'Ohne Aufzeichnung gibt es keine Verläufe, nur die letzten Messungen.',
  chartMissingMore:
    'Den Zwilling ohne „journal:=off“ starten oder im Parameter „journal“ eine Datei nennen.',
  chartMissingShort: 'Kein Verlauf: Dieser Zwilling zeichnet nichts auf.',
  chartNoTime: 'Der Zwilling kennt noch keine Uhrzeit; es gibt noch keine früheren Daten.',
  chartIdealsDiffer: 'Idealbereiche je nach Art verschieden',
  chartNoSensors: 'Dieser Messpunkt hat keinen Sensor.',
  chartTable: 'Als Tabelle anzeigen',
  chartPlots: 'Als Verlauf anzeigen',
  chartDayBefore: 'Vortag',
  chartBeforeWas: (value) => `Vortag ${value}`,
  chartWhole: 'Ganzer Zeitraum',
  chartCsvShown: 'CSV der Anzeige',
  chartCsvAll: 'CSV aller Messwerte',
  chartAddTag: 'Messpunkt hinzufügen',
  chartRemoveTag: (tag) => `Messpunkt ${tag} aus dem Verlauf entfernen`,
  chartWhich: 'Tabelle von',
  chartHint: 'Ziehen zum Vergrößern; klicken, um zu dieser Zeit zu springen.',
  chartColumns: {
    time: 'Zeit',
    until: 'Bis',
    value: 'Wert',
    count: 'Messwerte',
    mean: 'Mittelwert',
    min: 'Minimum',
    max: 'Maximum',
    event: 'Ereignis',
  },
  chartGap: (length) => `${length} lang keine Daten`,
  missing: { not_kept: 'nicht mehr gespeichert', not_recorded: 'nicht aufgezeichnet' },
  chartFailures: (count) => counted(count, 'fehlgeschlagener Versuch', 'fehlgeschlagene Versuche'),
  chartLooks: (count) => counted(count, 'Blütenkontrolle', 'Blütenkontrollen'),
};
