/** La estimación: qué segura es, cómo de bien predijo y dónde ayudaría otro punto. */
import type { ESTIMATE as ENGLISH } from '../en/estimate';
import type { In } from '../shape';
import { counted } from './counted';

export const ESTIMATE: In<typeof ENGLISH> = {
  about: 'Qué significa ±',
  aboutText:
    'De cada diez valores estimados, nueve deberían desviarse como mucho lo que dice el ± ' +
    '(intervalo del 90 %). La estimación tiene en cuenta a qué distancia está y qué antigüedad ' +
    'tiene cada lectura, y cómo pasa el día en la casa: cuanto más tiempo sin medir, mayor es el ±.',
  onItsWay: 'La estimación está en camino',
  noService: 'Este gemelo no hace estimaciones: se muestran las lecturas más cercanas',
  noneNow: 'Ahora no hay estimación: se muestran las lecturas más cercanas',
  noModel: 'Aún no hay estimación: necesita diez mediciones de un sensor',
  noSensor: 'Ningún punto mide esto, así que no hay nada que estimar',
  unsure: (error) =>
    `Rayado donde puede desviarse más de ±${error}; cuanto más denso, más. Sin color: no se sabe`,
  errorOf: (sensor) => `${sensor}: cuánto puede desviarse la estimación`,
  foretold: (inside, scans) =>
    `${inside} de ${counted(scans, 'medición', 'mediciones')} donde indicaban los otros puntos`,
  foretoldNone: 'Aún no se ha comparado con ninguna medición',
  foretoldDay: (inside, scans) =>
    `Último día: ${inside} de ${counted(scans, 'medición', 'mediciones')}`,
  foretoldWeek: (inside, scans) =>
    `última semana: ${inside} de ${counted(scans, 'medición', 'mediciones')}`,
  fitProblem: (reason) => `No se consigue conocer bien la casa: ${reason}`,
  notTrusted: (count) =>
    `No se fíe del ±: solo ${count} de 10 mediciones estaban donde indicaban los otros puntos, no 9.`,
  near: (count) =>
    count === 0 ? 'ningún punto cerca' : counted(count, 'punto cerca', 'puntos cerca'),
  oldest: (age) => `lectura más antigua: ${age}`,
  expected: (measured, expected) => `medido ${measured}, esperado ${expected}`,
  leftOut: (sensor) => `${sensor} ha cambiado: no se usa en la estimación`,
  advice: 'Dónde ayudaría otro punto',
  advised: (place, percent, isFirst) =>
    isFirst
      ? `${place}: un punto aquí deja el error de todo el mapa en el ${percent} del actual`
      : `${place}: puntos aquí y en cada marca anterior dejan el error de todo el mapa en el ${percent} del actual`,
  adviceNone: 'No se conoce ningún lugar donde ayudaría otro punto',
  adviceFailed: (reason) => `No se sabe dónde ayudaría otro punto: ${reason}`,
  adviceNow: 'Dónde ayudaría otro punto solo se sabe para ahora',
};
