/** Die Schätzung: wie sicher sie ist, wie gut sie vorhersagt, wo ein weiterer Messpunkt hülfe. */
import type { ESTIMATE as ENGLISH } from '../en/estimate';
import type { In } from '../shape';
import { counted } from './counted';

export const ESTIMATE: In<typeof ENGLISH> = {
  about: 'Was ± bedeutet',
  aboutText:
    'Von zehn geschätzten Werten sollten neun um höchstens das ± danebenliegen (90-%-Intervall). ' +
    'Die Schätzung berücksichtigt, wie weit weg und wie alt jeder Messwert ist und wie das Haus ' +
    'durch den Tag geht: Je länger niemand misst, desto größer wird das ±.',
  onItsWay: 'Die Schätzung kommt gleich',
  noService: 'Dieser Zwilling schätzt nicht: Gezeigt sind die nächsten Messwerte',
  noneNow: 'Gerade gibt es keine Schätzung: Gezeigt sind die nächsten Messwerte',
  noModel: 'Noch keine Schätzung: Sie braucht zehn Messungen eines Sensors',
  noSensor: 'Kein Messpunkt misst das, es gibt nichts zu schätzen',
  unsure: (error) =>
    `Schraffiert, wo sie um mehr als ±${error} danebenliegen kann, je dichter, desto mehr. Ohne Farbe: nicht bekannt`,
  errorOf: (sensor) => `${sensor}: wie weit die Schätzung danebenliegen kann`,
  foretold: (inside, scans) =>
    `${inside} von ${counted(scans, 'Messung', 'Messungen')} dort, wo die anderen Messpunkte sie erwarten ließen`,
  foretoldNone: 'Noch keine Messung wurde an ihr gemessen',
  foretoldDay: (inside, scans) =>
    `Letzter Tag: ${inside} von ${counted(scans, 'Messung', 'Messungen')}`,
  foretoldWeek: (inside, scans) =>
    `letzte Woche: ${inside} von ${counted(scans, 'Messung', 'Messungen')}`,
  fitProblem: (reason) => `Das Haus kennenzulernen gelingt nicht recht: ${reason}`,
  notTrusted: (count) =>
    `Nicht auf das ± verlassen: Nur ${count} von 10 Messungen lagen dort, wo die anderen ` +
    'Messpunkte sie erwarten ließen, nicht 9.',
  near: (count) =>
    count === 0
      ? 'kein Messpunkt in der Nähe'
      : counted(count, 'Messpunkt in der Nähe', 'Messpunkte in der Nähe'),
  oldest: (age) => `ältester Messwert ${age}`,
  expected: (measured, expected) => `gemessen ${measured}, erwartet ${expected}`,
  leftOut: (sensor) => `${sensor} hat sich verändert: in der Schätzung weggelassen`,
  advice: 'Wo ein weiterer Messpunkt hülfe',
  advised: (place, percent, isFirst) =>
    isFirst
      ? `${place}: Ein Messpunkt hier bringt den Fehler der ganzen Karte auf ${percent} von jetzt`
      : `${place}: Messpunkte hier und an allen Marken davor bringen den Fehler der ganzen Karte auf ${percent} von jetzt`,
  adviceNone: 'Es ist keine Stelle bekannt, an der ein weiterer Messpunkt hülfe',
  adviceFailed: (reason) => `Wo ein weiterer Messpunkt hülfe, ist nicht bekannt: ${reason}`,
  adviceNow: 'Wo ein weiterer Messpunkt hülfe, ist nur für jetzt bekannt',
};
