/** Die Karte: Bedienung, Legende, Farbbereich, Vergleich. */
import type * as EN from '../en/map';
import type { In } from '../shape';
import { counted, whole } from './counted';

const SHORT = new Map([
  ['Temperatur', 'Temp.'],
  ['Luftfeuchte', 'Feuchte'],
  ['Bodenfeuchte', 'Boden'],
  ['Dampfdruckdefizit (VPD)', 'VPD'],
  ['Taupunktabstand', 'TP-Abstand'],
]);

export const MAP: In<typeof EN.MAP> = {
  sensors: 'Sensor',
  mapRegion: 'Karte',
  mapPicture:
    'Karte des Gewächshauses. Die Liste daneben nennt die Messpunkte mit Handlungsbedarf.',
  mapLabel:
    'Karte des Gewächshauses. Pfeiltasten verschieben, Plus und Minus vergrößern und verkleinern, ' +
    '0 zeigt alles an, die Eingabetaste öffnet den Messpunkt, der dem Fadenkreuz am nächsten liegt. ' +
    'Die Tabelle führt dieselben Messpunkte auf.',
  zoomIn: 'Vergrößern',
  zoomOut: 'Verkleinern',
  fit: 'Alles anzeigen',
  layersButton: 'Ebenen',
  layers: {
    map: 'Grundriss',
    field: 'Heatmap',
    unknown: 'Bereiche ohne Daten',
    grid: 'Meterraster',
    boxes: 'Pflanzkästen',
    blooms: 'Blüten',
    pins: 'Messpunkte',
    labels: 'Beschriftung',
    advice: 'Vorschläge für Messpunkte',
  },
  scaleBar: (length) => `Maßstab: ${length}`,
  notKnown: 'unbekannt',
  position: (x, y) => `x ${x} m, y ${y} m`,

  legend: 'Legende',
  legendWaiting: 'Namen, Einheiten und Bereiche werden geladen',
  legendFailed: (reason) =>
    `Namen, Einheiten und Bereiche konnten nicht geladen werden (${reason}); die Seite versucht es weiter.`,
  legendTags: (count) => counted(count, 'Messpunkt trägt bei', 'Messpunkte tragen bei'),
  legendFetching: 'Die Heatmap wird geladen',
  legendNoTags: 'Kein Messpunkt trägt bei',
  legendError: (error) => `Typische Abweichung ${error}`,
  legendErrorHint:
    'Typische Abweichung zwischen den Messpunkten: Jeder Messpunkt wird aus allen anderen geschätzt und mit seinem Messwert verglichen.',
  legendTransparent: 'Kräftigere Farbe: höherer Wert. Ohne Farbe: kleinster Wert.',
  legendMore: 'Details',
  legendHatched: 'Schraffiert: keine Daten',
  legendOld: 'Blass und schraffiert: Messwerte zu alt',
  readoutOld: 'Messwerte zu alt',
  heat: 'Heatmap zeigt',
  heats: { nearest: 'Messwerte', estimate: 'Schätzung', error: 'Unsicherheit' },
  partMissing: 'Dieser Teil der Seite konnte nicht geladen werden. Bitte die Seite neu laden.',
  colouring: 'Farben nach',
  colourings: { ideal: 'Ideal', value: 'Wert' },
  legendNoIdeal: 'Zurzeit kein Idealbereich: Farben nach dem Wert',
  sensorShort: (label) => SHORT.get(label) ?? label,
  legendBelow: (value) => `unter ${value}`,
  legendAbove: (value) => `über ${value}`,
  legendAgainst: (sensor) => `${sensor} im Vergleich zum Idealbereich`,
  valueRange: (low, high) => `${low}\u00a0bis\u00a0${high}`,
  legendEach: (part) => `${part} je Art`,
  legendOthers: 'andere',
  pinLacking: 'Kein Sensor',
  pinFailed: 'Sensor ausgefallen',
  pinPest: 'Schädlinge gefunden',
  rangeKeep: 'Bereich beibehalten',
  fieldFailed: (reason) =>
    `Die Heatmap konnte nicht geladen werden (${reason}); die Seite versucht es weiter.`,

  compare: 'Vergleichen mit',
  compareWith: {
    none: 'nichts',
    day: 'gestern',
    week: 'vor einer Woche',
  },
  compareEnd: 'Vergleich beenden',
  difference: (sensor) => `${sensor}: Unterschied`,
  differenceLoading: 'Der Unterschied wird geladen',
  differenceNothing: (at) => `Keine Daten für ${at}.`,
  differenceFailed: (reason) => `Kein Unterschied: ${reason}`,
  differenceTimes: (at, against) => `${at} verglichen mit ${against}`,
  differenceSince: (moment) => `gegenüber ${moment}`,

  robotLayer: 'Roboter',
  robotAt: (x, y) => `Roboter: x ${x} m, y ${y} m`,
  robotNowhere: 'Roboter: Position unbekannt',
  robotAgeUnknown: 'Alter unbekannt',
  robotBattery: (percent) => `Akku ${percent}`,
  robotReported: (percent, ago) => `Akku ${percent}, gemeldet ${ago}`,
};

/** Die Messpunkte: ihre Tabelle und die Ansicht eines einzelnen. */
export const TAGS: In<typeof EN.TAGS> = {
  tags: 'Messpunkte',
  tableCaption: 'Alle Messpunkte mit ihren neuesten Messwerten',
  filter: 'Messpunkte filtern',
  filterHint: 'Nr., Art, Schädling …',
  filterClear: 'Filter löschen',
  shownOf: (shown, all) =>
    shown === all
      ? counted(all, 'Messpunkt', 'Messpunkte')
      : `${whole(shown)} von ${counted(all, 'Messpunkt', 'Messpunkten')}`,
  nothingMatches: 'Kein Messpunkt passt zum Filter.',
  columns: {
    health: 'Zustand',
    tag: 'Nr.',
    species: 'Art',
    flowers: 'Blüten',
    age: 'Alter',
  },
  pest: 'Schädling',
  pestCount: (count) => counted(count, 'Schädling', 'Schädlinge'),
  notOnMap: 'Ohne Position',
  notOnMapLong: 'Die Position ist noch nicht bekannt; der Messpunkt fehlt auf der Karte.',
  farOff: 'Zu weit entfernt, nicht auf der Karte',
  farOffLong: (place) =>
    `Die Position (${place}) ist weit von allen anderen Messpunkten entfernt; der Messpunkt fehlt auf der Karte.`,
  ageUnknown: 'unbekannt',
  ageUnknownLong: 'Das Alter ist unbekannt, bis die Zeit des Zwillings bekannt ist.',
  neverObserved: 'nie',
  neverObservedLong: 'Noch keine Messung hat einen Wert geliefert.',
  notKnownThenLong: 'Das ist nicht mehr gespeichert oder war noch nicht aufgezeichnet.',
  ageUnreportedLong: 'Dieser Zwilling meldet nicht, von wann seine Messwerte sind.',
  attemptOutcomes: {
    ok: 'OK',
    unreachable: 'nicht erreichbar',
    undecoded: 'nicht lesbar',
    skipped: 'übersprungen',
    failed: 'Grund unbekannt',
  },
  noValue: '–',
  sensorFailed: 'ausgefallen',
  sensorFailedLong: 'Der Sensor hat keinen Wert geliefert',
  confidence: (percent) => `zu ${percent} sicher`,
  notSure: 'unsicher',
  speciesNames: {
    lupin: 'Lupine',
    tulip: 'Tulpe',
    gerbera: 'Gerbera',
    orchid: 'Orchidee',
    rose: 'Rose',
    lettuce: 'Salat',
    tomato: 'Tomate',
    cucumber: 'Gurke',
    strawberry: 'Erdbeere',
  },
  unclassified: 'Nicht bestimmt',
  tableButton: 'Spalten und Zeilen',
  tableColumns: 'Spalten',
  tableByArea: 'Nach Bereich gruppieren',
  areaNone: 'Kein Bereich',
  trend: 'Tendenz',
  trendTitle: (sensor, hour) =>
    `${sensor}, Änderung seit einer ${hour ? `Gewächshausstunde (${hour})` : 'Stunde'}`,
  trendNone: 'vor einer Stunde kein Messwert',
  trendSame: 'kein neuer Wert',
  trendLevel: 'stabil',
  trendUnknown: 'vor einer Stunde: unbekannt',

  card: (tag) => `Messpunkt ${tag}`,
  cardClose: 'Schließen',
  cardGone: 'Der Zwilling kennt diesen Messpunkt nicht.',
  cardGoneThen: 'Der Zwilling kannte diesen Messpunkt damals nicht.',
  cardShow: 'Auf der Karte anzeigen',
  cardMore: (count) => `${count} weitere`,
  cardSource: 'Quelle',
  cardFixed: 'Fester Sensor',
  cardVisited: 'Vom Roboter gemessen',
  cardScanned: 'Letzter Messwert',
  cardInspected: 'Blüten kontrolliert',
  cardLastAttempt: 'Letzter Versuch',
  cardArea: 'Bereich',
  cardPosition: 'Position',
};

/** Die Verläufe und ihre Tabellen. */
export const CHARTS: In<typeof EN.CHARTS> = {
  charts: 'Verläufe',
  chartOf: (sensor) => `Verlauf: ${sensor}`,
  chartsSeveral: 'Mehrere',
  chartSpan: (from, to) => `${from} bis ${to}`,
  chartSummary: (count, latest, at, low, high, gaps) =>
    `${counted(count, 'Messwert', 'Messwerte')}, der letzte ${latest} (${at}), ` +
    `zwischen ${low} und ${high}, ${gaps === 0 ? 'keine Lücke' : counted(gaps, 'Lücke', 'Lücken')}.`,
  chartEmpty: 'Kein Messwert in diesem Zeitraum.',
  chartNeedsDay: (known) =>
    known === null
      ? 'Braucht Messwerte aus 24 h, ohne Lücke von über 3 h'
      : `Braucht Messwerte aus 24 h; bisher ${known}`,
  chartLoading: 'Frühere Daten werden geladen',
  chartFailed: (reason) =>
    `Frühere Daten konnten nicht geladen werden (${reason}); die Seite versucht es weiter.`,
  chartNoTime: 'Der Zwilling kennt noch keine Uhrzeit; es gibt noch keine früheren Daten.',
  chartIdealsDiffer: 'Idealbereich je nach Art',
  chartNoSensors: 'Dieser Messpunkt hat keinen Sensor.',
  chartTable: 'Als Tabelle anzeigen',
  chartPlots: 'Als Verlauf anzeigen',
  chartDayBefore: 'Vortag',
  chartBeforeWas: (value) => `Vortag ${value}`,
  chartWhole: 'Ganzer Zeitraum',
  chartCsvShown: 'CSV der Anzeige',
  chartCsvAll: 'CSV aller Messwerte',
  chartAddTag: '+ Messpunkt',
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
  chartInspections: (count) => counted(count, 'Blütenkontrolle', 'Blütenkontrollen'),
};
