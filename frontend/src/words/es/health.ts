/** Los veredictos y sus motivos. */
import type { HEALTH as ENGLISH } from '../en/health';
import type { In } from '../shape';
import { counted } from './counted';

export const HEALTH: In<typeof ENGLISH> = {
  health: {
    healthy: 'Sano',
    stressed: 'Con estrés',
    critical: 'Crítico',
    unknown: 'Desconocido',
  },
  healthMany: {
    healthy: 'Sanos',
    stressed: 'Con estrés',
    critical: 'Críticos',
    unknown: 'Desconocidos',
  },
  reasons: {
    sides: { below: 'inferior a', above: 'superior a' },
    wasBeyond: (side, limit, status, until) =>
      `ha sido ${side} ${limit}; sigue ${status} hasta ${until}`,
    just: {
      below: (limit) => `justo por debajo de ${limit}`,
      above: (limit) => `justo por encima de ${limit}`,
    },
    readingFailed: (sensor) => `${sensor}: el sensor no da ningún valor`,
    implausible: (reading) => `${reading}: valor inverosímil`,
    scanFailed: (outcome, age) =>
      `Última medición fallida: ${outcome}${age === null ? '' : `, hace ${age}`}`,
    pest: (count) =>
      count > 0
        ? `Plaga detectada: ${counted(count, 'individuo', 'individuos')}`
        : 'Plaga detectada',
    old: (sensor, age, holds, isDated) => {
      const since = !isDated
        ? sensor === ''
          ? 'Ninguna medición con hora conocida'
          : 'ninguna lectura con hora conocida'
        : age === null
          ? sensor === ''
            ? 'Sin medir últimamente'
            : 'sin medir últimamente'
          : sensor === ''
            ? `Sin medir desde hace ${age}`
            : `sin lectura desde hace ${age}`;
      return `${sensor === '' ? '' : `${sensor}: `}${since}${holds === null ? '' : ` (las lecturas valen ${holds})`}`;
    },
    outOfRange: 'fuera de rango',
    changed: (reading) => `${reading}: posible fallo del sensor`,
    silent: 'Sin datos del gemelo: los últimos pueden estar desactualizados',
    stopped: 'No se mide ningún punto: el robot se ha parado o no llegan sus datos',
    other: (kind, sensor) => (sensor === '' ? kind : `${sensor}: ${kind}`),
  },
  todo: {
    sensors: {
      temperature: { below: 'Calentar o cerrar ventanas', above: 'Ventilar o sombrear' },
      humidity: { below: 'Humidificar', above: 'Ventilar y calentar' },
      co2: {
        below: 'Dosificar CO₂ o ventilar',
        above: 'Ventilar y revisar la dosificación de CO₂',
      },
      light: { below: 'Encender la iluminación', above: 'Sombrear' },
      soil_moisture: { below: 'Regar', above: 'Regar menos y revisar el drenaje' },
      vpd: { below: 'Ventilar y calentar', above: 'Humidificar o sombrear' },
    },
    range: 'Revisar el control del clima',
    reading_failed: 'Revisar el sensor',
    scan_failed: 'Revisar el acceso y el punto',
    pest: 'Revisar y tratar',
    old: 'Revisar la ruta del robot',
    changed: 'Comparar con otro medidor',
    silent: 'Revisar gemelo, servidor y red',
    stopped: 'Revisar el robot',
    other: 'Comprobar in situ',
  },
  todoPestAgain: 'Revisar otra vez: si no hay plaga, queda resuelta',
  todoWell: 'Queda resuelta con la próxima medición buena',
  todoAlso: 'también',
  todoLabel: 'Hacer ahora',
  reasonsLabel: 'Por qué',
  healthHeading: 'Estado del invernadero',
  healthDriver: (tag, reason) => `Punto ${tag}: ${reason}`,
  healthMostUnknown: 'Se desconoce el estado de más de la mitad de los puntos',
  healthSomeUnknown: (count) =>
    `No se ${count === 1 ? 'puede' : 'pueden'} evaluar ${counted(count, 'punto', 'puntos')}`,
  healthDay: (isDay, source) => `Se aplican los rangos de ${isDay ? 'día' : 'noche'}: ${source}`,
  healthDaySource: {
    light: 'según la luz medida en el invernadero',
    clock: 'según el reloj, porque no se mide la luz',
    assumed: 'supuesto, porque no se conocen ni la luz ni la hora',
  },
  idealParts: { any: 'ideal', day: 'ideal de día', night: 'ideal de noche' },
  healthIdeal: (ideal, low, high, unit) => `${ideal} de ${low} a ${high} ${unit}`.trim(),
  healthAllWell: 'Todas las lecturas evaluadas están en su rango ideal',
  healthDespite: (alarms) =>
    alarms === 1
      ? 'Aún hay 1 alarma activa: dos mediciones buenas la resuelven'
      : `Aún hay ${alarms} alarmas activas: cada una se resuelve con dos mediciones buenas`,
  healthAcknowledged: 'reconocida',
  healthNotCurrent: 'Desactualizado',
  healthNothing: 'Aún no hay lecturas que evaluar',
  healthFilter: ', mostrar solo estos puntos',
  houseRhythm: (interval) => `una medición cada ${interval}`,
  houseLast: (age) => `última medición hace ${age}`,
  houseNever: 'aún sin mediciones',
  houseLate: (age, interval) => `Sin mediciones desde hace ${age} (normalmente cada ${interval})`,
  houseOverdue: (count) =>
    count === 0
      ? 'ningún punto con retraso'
      : counted(count, 'punto con retraso', 'puntos con retraso'),
  tagChosen: (tag, health, row, rows) => `Punto ${tag}, ${health}, ${row} de ${rows}`,
  attention: 'Requiere atención',
  attentionNone: 'Nada requiere atención',
  attentionNoneKnown: (unknown) =>
    `Sin problemas conocidos; sin datos de ${counted(unknown, 'punto', 'puntos')}`,
  attentionMore: (count) => `+ ${count} más`,

  tooLow: (by) => (by === null ? 'por debajo del límite' : `${by} por debajo del ideal`),
  tooHigh: (by) => (by === null ? 'por encima del límite' : `${by} por encima del ideal`),
  side: { below: 'bajo', above: 'alto' },
  below: 'por debajo del ideal',
  above: 'por encima del ideal',
};
