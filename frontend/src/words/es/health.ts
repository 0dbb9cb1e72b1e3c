/** Los veredictos y sus motivos. */
import type { HEALTH as ENGLISH } from '../en/health';
import type { In } from '../shape';
import { counted } from './counted';

export const HEALTH: In<typeof ENGLISH> = {
  health: {
    healthy: 'Sano',
    stressed: 'Estresado',
    critical: 'Crítico',
    unknown: 'Desconocido',
  },
  reasons: {
    sides: { below: 'por debajo de', above: 'por encima de' },
    range: (reading, side, limit, isCritical) =>
      `${reading}, ${side} ${limit}${isCritical ? ' (crítico)' : ''}`,
    beyond: (sensor, side, limit) => `${sensor} ${side} ${limit}`,
    readingFailed: (sensor) => `${sensor}: el sensor no da ningún valor`,
    implausible: (reading) => `${reading}: ningún sensor sano mide esto`,
    scanFailed: (outcome, age) =>
      `Última medición fallida: ${outcome}${age === null ? '' : `, hace ${age}`}`,
    pest: (count) =>
      count > 0 ? counted(count, 'insecto dañino visto', 'insectos dañinos vistos') : 'Plaga vista',
    old: (sensor, age, holds, isDated) => {
      const since = !isDated
        ? sensor === ''
          ? 'Ninguna medición de hora conocida'
          : 'ninguna lectura de hora conocida'
        : age === null
          ? sensor === ''
            ? 'Sin medir últimamente'
            : 'sin medir últimamente'
          : sensor === ''
            ? `Sin medir desde hace ${age}`
            : `sin lectura desde hace ${age}`;
      return `${sensor === '' ? '' : `${sensor}: `}${since}${holds === null ? '' : ` (las lecturas valen ${holds})`}`;
    },
    outOfRange: 'fuera de su rango',
    changed: (reading) => `${reading}, ha cambiado respecto a su pasado y a sus vecinos`,
    silent: 'El gemelo calla: lo último que se oyó no dice nada de ahora',
    stopped: 'No se mide ningún punto: el robot se ha parado o no se le oye',
    other: (kind, sensor) => (sensor === '' ? kind : `${sensor}: ${kind}`),
  },
  reasonsLabel: 'Por qué',
  healthHeading: 'Estado del invernadero',
  healthDriver: (tag, reason) => `Punto ${tag}: ${reason}`,
  healthMostUnknown: 'De más de la mitad de los puntos no se sabe nada',
  healthSomeUnknown: (count) => `No se puede juzgar ${counted(count, 'punto', 'puntos')}`,
  healthDay: (isDay, source) =>
    `Juzgado según los rangos ${isDay ? 'del día' : 'de la noche'}: ${source}`,
  healthDaySource: {
    light: 'así lo indica la luz del invernadero',
    clock: 'así lo indica el reloj, pues no se mide la luz',
    assumed: 'se supone, pues no lo indican ni la luz ni el reloj',
  },
  idealParts: { any: 'ideal', day: 'ideal de día', night: 'ideal de noche' },
  healthIdeal: (ideal, low, high, unit) => `${ideal} de ${low} a ${high} ${unit}`.trim(),
  healthAllWell: 'Todas las lecturas juzgadas están en su rango ideal',
  healthDespite: (alarms) =>
    alarms === 1
      ? 'Aún hay 1 alarma activa: dos mediciones buenas la resuelven'
      : `Aún hay ${alarms} alarmas activas: dos mediciones buenas resuelven cada una`,
  healthNothing: 'Aún no hay lecturas que juzgar',
  healthFilter: ', mostrar solo estos puntos',
  houseRhythm: (interval) => `una lectura cada ${interval}`,
  houseLast: (age) => `última lectura hace ${age}`,
  houseNever: 'aún sin lecturas',
  houseOverdue: (count) =>
    count === 0
      ? 'ningún punto con retraso'
      : counted(count, 'punto con retraso', 'puntos con retraso'),
  tagChosen: (tag, health, row, rows) => `Punto ${tag}, ${health}, ${row} de ${rows}`,
  attention: 'Requiere atención',
  attentionNone: 'Nada requiere atención',
  attentionNoneKnown: (unknown) =>
    `Que se sepa, nada requiere atención; de ${counted(unknown, 'punto', 'puntos')} no se sabe nada`,
  attentionMore: (count) => `+ ${count} más`,

  tooLow: (by) => (by === null ? 'demasiado bajo' : `demasiado bajo por ${by}`),
  tooHigh: (by) => (by === null ? 'demasiado alto' : `demasiado alto por ${by}`),
  below: 'bajo el ideal',
  above: 'sobre el ideal',
};
