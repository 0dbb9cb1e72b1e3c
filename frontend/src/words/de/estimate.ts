/** Die Schätzung: wie sicher sie ist, wie gut sie vorhersagt, wo ein weiterer Messpunkt hülfe. */
import type { ESTIMATE as ENGLISH } from '../en/estimate';
import type { In } from '../shape';
import { counted, whole } from './counted';

export const ESTIMATE: In<typeof ENGLISH> = {
  about: 'Was ± bedeutet',
  aboutText:
    'Neun von zehn geschätzten Werten sollten höchstens um das ± abweichen (90-%-Intervall). ' +
    'Das ± hängt von Entfernung und Alter der Messwerte und von der Tageszeit ab. Je länger nicht ' +
    'gemessen wird, desto größer wird das ±.',
  onItsWay: 'Die Schätzung wird geladen',
  noneNow: 'Zurzeit keine Schätzung: Angezeigt werden die nächstgelegenen Messwerte',
  computed:
    'Eine berechnete Größe wird nicht geschätzt: Angezeigt werden die nächstgelegenen Messwerte',
  noModel: 'Noch keine Schätzung: Sie braucht zehn Messungen eines Sensors',
  unsure: (error) => `Schraffierte Farbe: ungenauer als ±${error}. Ohne Farbe: keine Daten`,
  error: 'Unsicherheit der Schätzung',
  predicted: (inside, scans) =>
    `${whole(inside)} von ${counted(scans, 'Messung', 'Messungen')} im vorhergesagten Bereich`,
  predictedNone: 'Noch mit keiner Messung verglichen',
  fitProblem: (reason) => `Das Modell passt nicht gut zu diesem Gewächshaus: ${reason}`,
  notTrusted: (count) => `Fehlerbereich zu eng: Nur ${count} statt 9 von 10 Messungen lagen darin.`,
  near: (count) =>
    count === 0
      ? 'kein Messpunkt in der Nähe'
      : counted(count, 'Messpunkt in der Nähe', 'Messpunkte in der Nähe'),
  oldest: (age) => `ältester Messwert vor ${age}`,
  expected: (measured, expected) => `gemessen ${measured}, erwartet ${expected}`,
  leftOut: (sensor) => `${sensor}: möglicher Sensorfehler, nicht in der Schätzung`,
  advised: (place, percent, isFirst) =>
    isFirst
      ? `${place}: Ein Messpunkt hier senkt den Fehler der Karte auf ${percent} des heutigen`
      : `${place}: Messpunkte hier und an allen Marken davor senken den Fehler der Karte auf ${percent} des heutigen`,
  adviceNone: 'Kein Vorschlag für einen weiteren Messpunkt',
  adviceFailed: (reason) => `Kein Vorschlag für einen weiteren Messpunkt: ${reason}`,
  adviceNow: 'Vorschläge für einen weiteren Messpunkt gibt es nur für jetzt',
};
