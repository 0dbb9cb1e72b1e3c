/** Alarmas: lo activo, lo aplazado y lo pasado, y cómo se avisa. */
import type { ALARMS as ENGLISH } from '../en/alarms';
import type { In } from '../shape';
import { counted } from './counted';

export const ALARMS: In<typeof ENGLISH> = {
  alarms: 'Alarmas',
  listChoice: 'Junto al mapa',
  alarmsCount: (unseen, active) =>
    active === 0 ? 'ninguna activa' : `${active} activas, ${unseen} sin ver`,
  alarmGroups: {
    active: (count) => `Activas (${count})`,
    shelved: (count) => `Aplazadas (${count})`,
    over: (count) => `Terminadas por sí solas en las últimas 24 h (${count})`,
  },
  alarmHouse: 'Todo el invernadero',
  alarmWhat: (where, what) => `${where}: ${what}`,
  alarmSince: (when, length) => (length === null ? `desde ${when}` : `desde ${when} (${length})`),
  alarmUntil: (from, until, length) => `${from} hasta ${until} (${length})`,
  alarmWorst: (reading, isCritical) =>
    `en el peor momento ${reading}${isCritical ? ' (crítico)' : ''}`,
  alarmNew: 'sin ver',
  alarmFollow: 'Mostrar dónde y cuándo empezó',
  alarmSeen: 'Marcar vista',
  alarmSeenOf: (what) => `Marcar vista: ${what}`,
  alarmAllSeen: 'Marcar todas vistas',
  alarmShelve: 'Aplazar',
  alarmShelveOf: (what) => `Aplazar: ${what}`,
  alarmShelveHint: 'No se avisa de ella durante un tiempo, salvo que empeore',
  alarmShelveMinutes: (minutes) => `Durante ${minutes} min`,
  alarmShelveHours: (hours) => `Durante ${hours} h`,
  alarmShelved: (until) => `aplazada hasta ${until}`,
  alarmUnshelve: 'Recuperar',
  alarmUnshelveOf: (what) => `Recuperar: ${what}`,
  alarmMore: (count) => `Mostrar ${count} más`,
  alarmsNone: 'Ninguna alarma activa',
  alarmsNoneHint:
    'Una alarma salta cuando algo va mal en dos mediciones seguidas; con una plaga, o si no se sabe nada del invernadero, de inmediato.',
  alarmsNotYet: 'Aún no se sabe si hay alarmas',
  alarmsStarting: 'Todavía se está repasando el pasado: pueden aparecer más alarmas.',
  alarmsHeard: (since) => `No se graba nada: no se conocen las alarmas anteriores a ${since}.`,
  alarmsLost: (clock) =>
    `Según lo último recibido a las ${clock}. Lo ocurrido desde entonces no se conoce.`,
  alarmsOfNow: (moment) =>
    `Estas son las alarmas de ahora. El resto de la página muestra ${moment}.`,
  alarmsMine: '«Vista» y «aplazada» valen solo en este navegador.',

  alarmTell: 'Avisarme de las alarmas',
  alarmSound: 'Sonido',
  alarmSoundHint: 'Un sonido breve con las alarmas nuevas, como mucho uno cada 10 s.',
  alarmSoundWaits: 'El navegador lo reproduce tras su primer clic en esta página.',
  alarmSoundNone: 'Este navegador no puede reproducirlo.',
  alarmNotify: 'Notificación',
  alarmNotifyHint: 'El navegador avisa de las alarmas nuevas mientras usted mira otra cosa.',
  alarmNotifyInsecure:
    'Los navegadores solo lo permiten si la dirección de la página empieza por https:// o por http://localhost.',
  alarmNotifyRefused:
    'Este navegador lo rechaza. Permita las notificaciones de esta página en sus ajustes.',
  alarmNotifyNone: 'Este navegador no puede hacerlo.',
  alarmNotifyTitle: (count) => counted(count, 'alarma nueva', 'alarmas nuevas'),

  alarmsRaised: (alarms, more) => `Nuevo: ${alarms.join('; ')}${more > 0 ? ` y ${more} más` : ''}`,
  alarmsCleared: (alarms, more) =>
    `Terminado: ${alarms.join('; ')}${more > 0 ? ` y ${more} más` : ''}`,
  alarmsMeanwhile: (alarm, more) =>
    `Ahora: ${alarm}${more > 0 ? ` y ${counted(more, 'alarma más', 'alarmas más')}` : ''}`,
  alarmsTitle: (count, title) => `(${count}) ${title}`,
};
