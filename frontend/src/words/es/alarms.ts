/** Alarmas: lo activo, lo aplazado y lo resuelto, y cómo se avisa. */
import type * as EN from '../en/alarms';
import type { In } from '../shape';
import { counted } from './counted';

/** Lo que no se nombra. */
const further = (more: number): string => (more > 0 ? ` y ${more} más` : '');

export const ALARMS: In<typeof EN.ALARMS> = {
  alarms: 'Alarmas',
  listChoice: 'Junto al mapa',
  alarmsCount: (unseen, active) =>
    active === '0'
      ? 'ninguna activa'
      : `${active} ${active === '1' ? 'activa' : 'activas'}, ${unseen} sin reconocer`,
  alarmsNow: (active) => `${active} ahora`,
  alarmGroups: {
    active: (count) => `Activas (${count})`,
    shelved: (count) => `Aplazadas (${count})`,
    resolved: (count) => `Resueltas en las últimas 24 h (${count})`,
  },
  alarmHouse: 'Todo el invernadero',
  alarmWhat: (where, what) => `${where}: ${what}`,
  alarmSince: (when) => `desde ${when}`,
  alarmForOver: (length) => `más de ${length}`,
  alarmUntil: (from, until, length) => `de ${from} a ${until} (${length})`,
  alarmNow: (reading) => `ahora ${reading}`,
  alarmNowUnknown: (last, age) =>
    last === null
      ? 'ahora sin dato'
      : `ahora sin dato, último ${last}${age === null ? '' : ` hace ${age}`}`,
  alarmPests: { seen: 'detectada', still: 'aún se detecta', gone: 'ya no se detecta' },
  alarmWorst: {
    below: (reading) => `mín. ${reading}`,
    above: (reading) => `máx. ${reading}`,
    pest: (reading) => `máx. ${reading}`,
  },
  alarmFirst: (reading) => `al inicio ${reading}`,
  alarmStatus: { critical: 'crítico', healthy: 'dentro del rango' },
  alarmBack: 'De nuevo normal',
  alarmShow: 'Mostrar este punto ahora',
  alarmStart: 'Ir al inicio',
  alarmActionsOf: (what) => `Acciones: ${what}`,
  alarmAcknowledge: 'Reconocer',
  alarmAll: (what, count) => `${what}${what.includes(' ') ? ':' : ''} todas (${count})`,
  alarmAcknowledgedBy: (name, at) => `reconocida por ${name}, ${at}`,
  alarmUnacknowledge: 'Anular reconocimiento',
  alarmShelve: 'Aplazar',
  alarmShelveHint: 'Sin avisos hasta entonces, salvo que empeore.',
  alarmShelveCritical:
    'Si la alarma es o fue crítica, se puede aplazar 1 h como máximo, indicando el motivo.',
  alarmShelfReason: 'Motivo',
  alarmShelfReasonOptional: 'Motivo (opcional)',
  alarmShelveFor: (time) => `Durante ${time}`,
  alarmShelved: (until, reason, by) =>
    `aplazada ${by === '' ? '' : `por ${by} `}hasta ${until}${reason === '' ? '' : `: ${reason}`}`,
  alarmUnshelve: 'Reactivar',
  alarmResolved: 'resuelta',
  alarmUndo: 'Deshacer',
  alarmDone: {
    acknowledge: (count) => counted(count, 'alarma reconocida', 'alarmas reconocidas'),
    unacknowledge: (count) =>
      counted(count, 'alarma de nuevo sin reconocer', 'alarmas de nuevo sin reconocer'),
    shelve: (count) => counted(count, 'alarma aplazada', 'alarmas aplazadas'),
    unshelve: (count) => counted(count, 'alarma reactivada', 'alarmas reactivadas'),
  },
  alarmsNew: (count) => counted(count, 'nueva', 'nuevas'),
  alarmsNewHint: 'El orden no cambia mientras usa la lista. Mostrar las alarmas nuevas',
  alarmFilter: 'Filtrar alarmas',
  alarmFilterHint: 'Filtrar…',
  alarmOrder: 'Orden',
  alarmOrders: { cause: 'Por causa', newest: 'Más recientes primero', tag: 'Por punto' },
  alarmSaveCsv: 'Guardar alarmas como CSV',
  alarmsNoMatch: 'Ninguna alarma coincide con el filtro.',
  alarmCount: (count) => counted(count, 'alarma', 'alarmas'),
  further,
  alarmTags: (tags, more) =>
    `${tags.length === 1 ? 'Punto' : 'Puntos'} ${tags.join(', ')}${further(more)}`,
  alarmsNone: 'Ninguna alarma activa',
  alarmsNoneHint:
    'La alarma salta tras dos mediciones anómalas seguidas. Si hay plaga o faltan datos del invernadero, salta enseguida.',
  alarmsWait: (tags) =>
    `${counted(tags, 'punto', 'puntos')} a la espera de otra medición: aún sin alarma`,
  alarmNotYet: 'aún sin alarma',
  alarmsNotYet: 'Esperando la lista de alarmas',
  alarmsStarting: 'Todavía se está leyendo el registro: pueden aparecer más alarmas.',
  alarmsNoTime: 'Mientras se desconozca la hora, pueden faltar alarmas.',
  alarmsReceived: (since) =>
    `No se registra nada: se desconocen las alarmas anteriores a ${since}.`,
  alarmsLost: 'Últimos datos recibidos. Se desconoce lo ocurrido después.',
  alarmsOfNow: (moment) =>
    `Estas son las alarmas actuales. El resto de la página muestra ${moment}.`,
  alarmsMine: '«Reconocida» y «aplazada» solo valen en este navegador.',

  alarmNotifyMe: 'Avisarme de las alarmas',
  alarmSound: 'Sonido',
  alarmSoundHints: {
    ready: 'Un sonido breve con las alarmas nuevas, como mucho uno cada 10 s.',
    waits: 'El navegador permite el sonido tras su primer clic en esta página.',
    none: 'Este navegador no puede reproducir sonido.',
  },
  alarmNotify: 'Notificación',
  alarmNotifyHint:
    'El navegador avisa de las alarmas nuevas mientras esta página esté abierta en segundo plano.',
  alarmNotifyPushed: 'Las alarmas críticas llegan también con la página cerrada.',
  alarmNotifyNot: {
    insecure:
      'Los navegadores solo lo permiten en direcciones que empiezan por https:// o http://localhost.',
    refused:
      'Este navegador bloquea las notificaciones. Permítalas para esta página en sus ajustes.',
    none: 'Este navegador no admite notificaciones.',
  },
  alarmNotifyTitle: (count) => counted(count, 'alarma nueva', 'alarmas nuevas'),

  alarmsRaised: (alarms, more) => `Nuevas: ${alarms.join('; ')}${further(more)}`,
  alarmsCleared: (alarms, more) => `Resueltas: ${alarms.join('; ')}${further(more)}`,
  alarmsMeanwhile: (alarm, more) =>
    `Alarma nueva: ${alarm}${more > 0 ? ` y ${counted(more, 'alarma más', 'alarmas más')}` : ''}`,
};

/** Los veredictos y sus motivos. */
export const HEALTH: In<typeof EN.HEALTH> = {
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
    must: {
      below: (limit) => `aún no supera ${limit}`,
      above: (limit) => `aún no baja de ${limit}`,
    },
    just: {
      below: (limit) => `justo bajo ${limit}`,
      above: (limit) => `justo sobre ${limit}`,
    },
    readingFailed: (sensor) => `${sensor}: el sensor no da ningún valor`,
    implausible: (reading) => `${reading}: valor inverosímil`,
    scanFailed: (outcome, age) =>
      `Medición fallida: ${outcome}${age === null ? '' : `, hace ${age}`}`,
    pest: (count) =>
      count > 0
        ? `Plaga detectada: ${counted(count, 'individuo', 'individuos')}`
        : 'Plaga detectada',
    old: (sensor, age, holds, isDated) => {
      if (!isDated) {
        return sensor === ''
          ? 'Aún sin lecturas'
          : `${sensor}: ninguna lectura de antigüedad conocida`;
      }
      const since =
        age === null
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
    silent: 'Sin datos actuales del gemelo digital',
    stopped: 'No se mide ningún punto: el robot se ha parado o no llegan sus datos',
    other: (kind, sensor) => (sensor === '' ? kind : `${sensor}: ${kind}`),
  },
  airCause: { damp: 'Aire demasiado húmedo', dry: 'Aire demasiado seco' },
  todo: {
    sensors: {
      temperature: { below: 'Calefactar o cerrar ventanas', above: 'Ventilar o sombrear' },
      co2: {
        below: 'Dosificar CO₂ o ventilar',
        above: 'Ventilar y revisar la dosificación de CO₂',
      },
      light: { below: 'Encender la iluminación', above: 'Sombrear' },
      soil_moisture: { below: 'Regar', above: 'Regar menos y revisar el drenaje' },
    },
    air: { damp: 'Ventilar y calefactar', dry: 'Humidificar' },
    range: 'Revisar el control del clima',
    watch: 'Vigilar',
    reading_failed: 'Revisar el sensor',
    scan_failed: 'Revisar el acceso y el punto',
    pest: 'Revisar y tratar',
    old: 'Revisar la ruta del robot',
    changed: 'Comparar con otro medidor',
    silent: 'Revisar gemelo digital, servidor y red',
    stopped: 'Revisar el robot',
    other: 'Comprobar in situ',
  },
  todoPestAgain: 'Revisar otra vez',
  todoWell: 'Esperar otra medición correcta',
  todoAlso: (tags) => (tags === 1 ? 'también el punto' : 'también los puntos'),
  todoLabel: 'Hacer ahora',
  reasonsLabel: 'Por qué',
  healthHeading: 'Estado del invernadero',
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
  healthAllWell: 'Todas las lecturas evaluadas están en su rango ideal',
  healthDespite: (alarms) =>
    alarms === '1'
      ? 'Aún hay 1 alarma activa: quedará resuelta con la próxima medición o revisión correcta'
      : `Aún hay ${alarms} alarmas activas: quedarán resueltas con la próxima medición o revisión correcta`,
  healthAcknowledged: 'reconocida',
  healthNotCurrent: 'Desactualizado',
  healthNoTime: 'Sin evaluar mientras se desconozca la hora',
  healthNothing: 'Aún no hay lecturas que evaluar',
  healthNoRange: 'Ninguna lectura con rango ideal',
  healthFilter: ', mostrar solo estos puntos',
  scanInterval: (interval) => `cada punto se mide cada ${interval}`,
  houseLast: (age) => `última medición hace ${age}`,
  houseNever: 'aún sin mediciones',
  houseLate: (age, interval) =>
    `Sin mediciones desde hace ${age} (lo normal: cada punto cada ${interval})`,
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

  tooLow: (by) => (by === null ? 'bajo el mínimo' : `${by} por debajo del ideal`),
  tooHigh: (by) => (by === null ? 'sobre el máximo' : `${by} por encima del ideal`),
  side: { below: 'bajo', above: 'alto' },
};
