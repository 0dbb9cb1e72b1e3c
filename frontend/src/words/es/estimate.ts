/** La estimación: qué segura es, cómo de bien predijo y dónde ayudaría otro punto. */
import type { ESTIMATE as ENGLISH } from '../en/estimate';
import type { In } from '../shape';
import { counted, whole } from './counted';

export const ESTIMATE: In<typeof ENGLISH> = {
  about: 'Qué significa ±',
  aboutText:
    'En nueve de cada diez casos, el error no debería superar el ± (intervalo del 90 %). ' +
    'El ± depende de la distancia y la antigüedad de las lecturas y de la hora del día. ' +
    'Cuanto más tiempo sin medir, mayor es el ±.',
  onItsWay: 'Cargando la estimación',
  noneNow: 'Ahora no hay estimación: se muestran las lecturas más cercanas',
  computed: 'Una magnitud calculada no se estima: se muestran las lecturas más cercanas',
  noModel: 'Aún no hay estimación: hacen falta diez mediciones de un sensor',
  unsure: (error) => `Color rayado: menos preciso que ±${error}. Sin color: sin datos`,
  error: 'Incertidumbre de la estimación',
  predicted: (inside, scans) =>
    `${whole(inside)} de ${counted(scans, 'medición', 'mediciones')} dentro del rango previsto`,
  predictedNone: 'Aún no se ha comparado con ninguna medición',
  fitProblem: (reason) => `El modelo no se ajusta bien a este invernadero: ${reason}`,
  notTrusted: (count) =>
    `Margen de error demasiado estrecho: solo acertó en ${count} de 10 mediciones, no en 9.`,
  near: (count) =>
    count === 0 ? 'ningún punto cerca' : counted(count, 'punto cerca', 'puntos cerca'),
  oldest: (age) => `lectura más antigua hace ${age}`,
  expected: (measured, expected) => `medido ${measured}, esperado ${expected}`,
  leftOut: (sensor) => `${sensor}: posible fallo del sensor, no se usa en la estimación`,
  advised: (place, percent, isFirst) =>
    isFirst
      ? `${place}: un punto aquí reduce el error del mapa al ${percent} del actual`
      : `${place}: puntos aquí y en cada marca anterior reducen el error del mapa al ${percent} del actual`,
  adviceNone: 'No se propone ningún otro punto',
  adviceFailed: (reason) => `No se propone ningún otro punto: ${reason}`,
  adviceNow: 'Solo se proponen puntos para el momento actual',
};
