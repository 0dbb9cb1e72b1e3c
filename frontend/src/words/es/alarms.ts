/** Alarmas: lo activo, lo aplazado y lo resuelto, y cómo se avisa. */
import type { ALARMS as ENGLISH } from '../en/alarms';
import type { In } from '../shape';
import { counted } from './counted';

export const ALARMS: In<typeof ENGLISH> = {
  alarms: 'Alarmas',
  listChoice: 'Junto al mapa',
  alarmsCount: (unseen, active) =>
    active === 0
      ? 'ninguna activa'
      : `${counted(active, 'activa', 'activas')}, ${unseen} sin reconocer`,
  alarmGroups: {
    active: (count) => `Activas (${count})`,
    shelved: (count) => `Aplazadas (${count})`,
    resolved: (count) => `Resueltas en las últimas 24 h (${count})`,
  },
  alarmHouse: 'Todo el invernadero',
  alarmWhat: (where, what) => `${where}: ${what}`,
  alarmSince: (when, length) => (length === null ? `desde ${when}` : `desde ${when} (${length})`),
  alarmUntil: (from, until, length) => `de ${from} a ${until} (${length})`,
  alarmNow: (reading) => `ahora ${reading}`,
  alarmNowUnknown: (last, age) =>
    last === null
      ? 'ahora sin dato'
      : `ahora sin dato, último ${last}${age === null ? '' : ` hace ${age}`}`,
  alarmPests: { none: 'no detectada', seen: 'detectada' },
  alarmWorst: {
    below: (reading) => `mínimo ${reading}`,
    above: (reading) => `máximo ${reading}`,
    pest: (reading) => `máximo ${reading}`,
  },
  alarmFirst: (reading) => `al inicio ${reading}`,
  alarmStatus: { critical: 'crítico', healthy: 'dentro del rango' },
  alarmBack: 'Ya sin anomalía',
  alarmShow: 'Mostrar este punto ahora',
  alarmStart: 'Ir al inicio',
  alarmActionsOf: (what) => `Acciones: ${what}`,
  alarmAcknowledge: 'Reconocer',
  alarmAcknowledgeOf: (what) => `Reconocer: ${what}`,
  alarmAcknowledgeAll: (count) => `Reconocer todas (${count})`,
  alarmUnacknowledge: 'Anular reconocimiento',
  alarmShelve: 'Aplazar',
  alarmShelveHint: 'Sin avisos hasta entonces, salvo que empeore.',
  alarmShelveCritical:
    'Si la alarma es o fue crítica, se puede aplazar 1 h como máximo, indicando el motivo.',
  alarmShelfReason: 'Motivo',
  alarmShelfReasonOptional: 'Motivo (opcional)',
  alarmShelveMinutes: (minutes) => `Durante ${minutes} min`,
  alarmShelveHours: (hours) => `Durante ${hours} h`,
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
  alarmFilterHint: 'Filtrar …',
  alarmOrder: 'Orden',
  alarmOrders: { cause: 'Por causa', newest: 'Más recientes primero', tag: 'Por punto' },
  alarmSaveCsv: 'Guardar alarmas como CSV',
  alarmsNoMatch: 'Ninguna alarma coincide con el filtro.',
  alarmCount: (count) => counted(count, 'alarma', 'alarmas'),
  alarmTags: (tags, more) =>
    `${tags.length === 1 ? 'Punto' : 'Puntos'} ${tags.join(', ')}${more > 0 ? ` y ${more} más` : ''}`,
  alarmsNone: 'Ninguna alarma activa',
  alarmsNoneHint:
    'La alarma salta tras dos mediciones anómalas seguidas. Si hay plaga o faltan datos del invernadero, salta enseguida.',
  alarmsWait: (tags) =>
    `${counted(tags, 'punto', 'puntos')} a la espera de otra medición: aún sin alarma`,
  alarmNotYet: 'a la espera de otra medición',
  alarmsNotYet: 'Esperando la lista de alarmas',
  alarmsStarting: 'Todavía se está leyendo el registro: pueden aparecer más alarmas.',
  alarmsHeard: (since) => `No se registra nada: se desconocen las alarmas anteriores a ${since}.`,
  alarmsLost: (clock) => `Último dato recibido a las ${clock}. Se desconoce lo ocurrido después.`,
  alarmsOfNow: (moment) =>
    `Estas son las alarmas actuales. El resto de la página muestra ${moment}.`,
  alarmsMine: '«Reconocida» y «aplazada» solo valen en este navegador.',

  alarmTell: 'Avisarme de las alarmas',
  alarmSound: 'Sonido',
  alarmSoundHint: 'Un sonido breve con las alarmas nuevas, como mucho uno cada 10 s.',
  alarmSoundWaits: 'El navegador permite el sonido tras su primer clic en esta página.',
  alarmSoundNone: 'Este navegador no puede reproducir sonido.',
  alarmNotify: 'Notificación',
  alarmNotifyHint: 'El navegador avisa de las alarmas nuevas aunque usted esté en otra ventana.',
  alarmNotifyInsecure:
    'Los navegadores solo lo permiten en direcciones que empiezan por https:// o http://localhost.',
  alarmNotifyRefused:
    'Este navegador bloquea las notificaciones. Permítalas para esta página en sus ajustes.',
  alarmNotifyNone: 'Este navegador no admite notificaciones.',
  alarmNotifyTitle: (count) => counted(count, 'alarma nueva', 'alarmas nuevas'),

  alarmsRaised: (alarms, more) => `Nuevas: ${alarms.join('; ')}${more > 0 ? ` y ${more} más` : ''}`,
  alarmsCleared: (alarms, more) =>
    `Resueltas: ${alarms.join('; ')}${more > 0 ? ` y ${more} más` : ''}`,
  alarmsMeanwhile: (alarm, more) =>
    `Alarma nueva: ${alarm}${more > 0 ? ` y ${counted(more, 'alarma más', 'alarmas más')}` : ''}`,
};
