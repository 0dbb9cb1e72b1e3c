/** Alarmen: wat actief, uitgesteld en voorbij is, en hoe het wordt gemeld. */
import type { ALARMS as ENGLISH } from '../en/alarms';
import type { In } from '../shape';
import { counted } from './counted';

export const ALARMS: In<typeof ENGLISH> = {
  alarms: 'Alarmen',
  listChoice: 'Naast de kaart',
  alarmsCount: (unseen, active) =>
    active === 0 ? 'geen actief' : `${active} actief, waarvan ${unseen} niet gezien`,
  alarmGroups: {
    active: (count) => `Actief (${count})`,
    shelved: (count) => `Uitgesteld (${count})`,
    over: (count) => `Vanzelf voorbij in de laatste 24 h (${count})`,
  },
  alarmHouse: 'Hele kas',
  alarmWhat: (where, what) => `${where}: ${what}`,
  alarmSince: (when, length) => (length === null ? `sinds ${when}` : `sinds ${when} (${length})`),
  alarmUntil: (from, until, length) => `${from} tot ${until} (${length})`,
  alarmWorst: (reading, isCritical) => `op zijn ergst ${reading}${isCritical ? ' (kritiek)' : ''}`,
  alarmNew: 'niet gezien',
  alarmFollow: 'Tonen waar en wanneer het begon',
  alarmSeen: 'Als gezien markeren',
  alarmSeenOf: (what) => `Als gezien markeren: ${what}`,
  alarmAllSeen: 'Alles als gezien markeren',
  alarmShelve: 'Uitstellen',
  alarmShelveOf: (what) => `Uitstellen: ${what}`,
  alarmShelveHint: 'Het wordt een tijd niet gemeld, tenzij het erger wordt',
  alarmShelveMinutes: (minutes) => `Voor ${minutes} min`,
  alarmShelveHours: (hours) => `Voor ${hours} h`,
  alarmShelved: (until) => `uitgesteld tot ${until}`,
  alarmUnshelve: 'Terughalen',
  alarmUnshelveOf: (what) => `Terughalen: ${what}`,
  alarmMore: (count) => `Nog ${count} tonen`,
  alarmsNone: 'Geen alarm actief',
  alarmsNoneHint:
    'Een alarm komt als er bij twee metingen na elkaar iets niet klopt; bij een plaag, of als er van de kas niets wordt gehoord, meteen.',
  alarmsNotYet: 'Of er alarmen zijn, is nog niet bekend',
  alarmsStarting: 'Het verleden wordt nog doorgenomen: er kunnen alarmen bijkomen.',
  alarmsHeard: (since) => `Er wordt niets opgenomen: alarmen van voor ${since} zijn niet bekend.`,
  alarmsLost: (clock) =>
    `Zoals het laatst gehoord om ${clock}. Wat er sindsdien kwam, is niet bekend.`,
  alarmsOfNow: (moment) => `Dit zijn de alarmen van nu. De rest van de pagina toont ${moment}.`,
  alarmsMine: '“Gezien” en “uitgesteld” gelden alleen in deze browser.',

  alarmTell: 'Alarmen melden',
  alarmSound: 'Geluid',
  alarmSoundHint: 'Een kort geluid bij nieuwe alarmen, hoogstens één per 10 s.',
  alarmSoundWaits: 'De browser speelt het na uw eerste klik op deze pagina.',
  alarmSoundNone: 'Deze browser kan het niet spelen.',
  alarmNotify: 'Melding',
  alarmNotifyHint: 'De browser meldt nieuwe alarmen terwijl u naar iets anders kijkt.',
  alarmNotifyInsecure:
    'Browsers staan dit alleen toe als het adres van de pagina begint met https:// of met http://localhost.',
  alarmNotifyRefused:
    'Deze browser weigert. Sta meldingen voor deze pagina toe in de instellingen van de browser.',
  alarmNotifyNone: 'Deze browser kan dat niet.',
  alarmNotifyTitle: (count) => counted(count, 'nieuw alarm', 'nieuwe alarmen'),

  alarmsRaised: (alarms, more) => `Nieuw: ${alarms.join('; ')}${more > 0 ? ` en nog ${more}` : ''}`,
  alarmsCleared: (alarms, more) =>
    `Voorbij: ${alarms.join('; ')}${more > 0 ? ` en nog ${more}` : ''}`,
  alarmsMeanwhile: (alarm, more) =>
    `Nu: ${alarm}${more > 0 ? ` en nog ${counted(more, 'alarm', 'alarmen')}` : ''}`,
  alarmsTitle: (count, title) => `(${count}) ${title}`,
};
