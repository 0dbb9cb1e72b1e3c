/** Die Karte: Bedienung, Legende, Farbbereich, Vergleich. */
import type { MAP as ENGLISH } from '../en/map';
import type { In } from '../shape';
import { counted } from './counted';

export const MAP: In<typeof ENGLISH> = {
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
    smooth: 'Heatmap glätten',
    grid: 'Meterraster',
    boxes: 'Pflanzkästen',
    blooms: 'Blüten',
    pins: 'Messpunkte',
    labels: 'Beschriftung',
    advice: 'Wo ein weiterer Messpunkt helfen würde',
  },
  scaleBar: (length) => `Maßstab: ${length}`,
  notKnown: 'unbekannt',
  position: (x, y) => `x ${x} m, y ${y} m`,

  legend: 'Legende',
  legendWaiting: 'Namen, Einheiten und Bereiche werden geladen',
  legendFailed: (reason) =>
    `Namen, Einheiten und Bereiche konnten nicht geladen werden; die Seite versucht es weiter. ${reason}`,
  legendTags: (count) => counted(count, 'Messpunkt trägt bei', 'Messpunkte tragen bei'),
  legendFetching: 'Die Heatmap wird geladen',
  legendNoTags: 'Kein Messpunkt trägt bei',
  legendError: (error) => `Typischer Fehler ${error}`,
  legendErrorHint:
    'Typischer Fehler zwischen den Messpunkten: Jeder Messpunkt wird aus allen anderen geschätzt und mit seinem Messwert verglichen.',
  legendErrorWorst: (tag, error) => `Am größten an Messpunkt ${tag}: ${error}.`,
  legendTransparent:
    'Kräftigere Farbe: höherer Wert. Ohne Farbe: kleinster Wert. Schraffiert: keine Daten',
  legendMore: 'Details',
  legendHatched: 'Schraffiert: keine Daten',
  legendOld: 'Blass und schraffiert: Messwerte zu alt',
  readoutOld: 'Messwerte zu alt',
  heat: 'Heatmap zeigt',
  heats: { nearest: 'Nächstgelegene Messwerte', estimate: 'Schätzung', error: 'Unsicherheit' },
  partMissing: 'Dieser Teil der Seite konnte nicht geladen werden. Laden Sie die Seite neu.',
  colouring: 'Farben nach',
  colourings: { ideal: 'Ideal', value: 'Wert' },
  legendNoIdeal: 'Zurzeit kein Idealbereich: Farben nach dem Wert',
  legendBelow: (value) => `unter ${value}`,
  legendAbove: (value) => `über ${value}`,
  legendAgainst: (sensor) => `${sensor} im Vergleich zum Idealbereich`,
  legendIdeal: (ideal, low, high) => `${ideal} ${low} bis ${high}`,
  legendEach: (part) => `${part} je Art`,
  legendOthers: 'andere',
  legendUnknownSpecies: 'Nicht bestimmt',
  pinLacking: 'Sensor nicht vorhanden',
  pinFailed: 'Sensor ausgefallen',
  pinPest: 'Schädling gesehen',
  range: 'Farbbereich',
  rangeAuto: 'Auto',
  rangeFixed: 'Fest',
  rangeLow: 'Minimum',
  rangeHigh: 'Maximum',
  rangeIdeal: 'Idealbereich übernehmen',
  rangeNotBelow: (high) => `Muss unter ${high} liegen: nicht übernommen`,
  rangeNotAbove: (low) => `Muss über ${low} liegen: nicht übernommen`,
  rangeNoNumber: 'Keine Zahl: nicht übernommen',
  fieldFailed: (reason) =>
    `Die Heatmap konnte nicht geladen werden; die Seite versucht es weiter. ${reason}`,

  compare: 'Vergleichen mit',
  compareWith: {
    none: 'nichts',
    day: 'gestern',
    week: 'vor einer Woche',
    own: 'dem gezeigten Zeitpunkt',
  },
  compareMoment: 'Zeitpunkt, mit dem verglichen wird',
  difference: (sensor) => `${sensor}: Unterschied`,
  differenceNone: 'unverändert',
  differenceLoading: 'Der Unterschied wird geladen',
  differenceNothing: (at) => `Keine Daten für ${at}.`,
  differenceFailed: (reason) => `Kein Unterschied: ${reason}`,
  differenceTimes: (at, against) => `${at} minus ${against}`,
  differenceSinceYesterday: (clock) => `gegenüber gestern ${clock}`,
  differenceSinceWeek: (clock) => `gegenüber vor einer Woche, ${clock}`,
  differenceSince: (moment) => `gegenüber ${moment}`,

  robotLayer: 'Roboter',
  robotAt: (x, y) => `Roboter: ${x} m, ${y} m`,
  robotNowhere: 'Roboter: Position unbekannt',
  robotAgeUnknown: 'Alter unbekannt',
  robotBattery: (percent) => `Akku ${percent}`,
  robotReported: (percent, ago) => `Akku ${percent}, gemeldet ${ago}`,
};
