/** Alarmen: wat actief, uitgesteld en opgelost is, en hoe het wordt gemeld. */
import type { ALARMS as ENGLISH } from '../en/alarms';
import type { In } from '../shape';
import { counted } from './counted';

export const ALARMS: In<typeof ENGLISH> = {
  alarms: 'Alarmen',
  listChoice: 'Naast de kaart',
  alarmsCount: (unseen, active) =>
    active === 0 ? 'geen actief' : `${active} actief, waarvan ${unseen} niet bevestigd`,
  alarmGroups: {
    active: (count) => `Actief (${count})`,
    shelved: (count) => `Uitgesteld (${count})`,
    resolved: (count) => `Opgelost in de afgelopen 24 uur (${count})`,
  },
  alarmHouse: 'Hele kas',
  alarmWhat: (where, what) => `${where}: ${what}`,
  alarmSince: (when, length) => (length === null ? `sinds ${when}` : `sinds ${when} (${length})`),
  alarmUntil: (from, until, length) => `${from} tot ${until} (${length})`,
  alarmNow: (reading) => `nu ${reading}`,
  alarmNowUnknown: (last, age) =>
    last === null
      ? 'nu onbekend'
      : `nu onbekend, laatst ${last}${age === null ? '' : ` ${age} geleden`}`,
  alarmPests: { none: 'geen gezien', seen: 'gezien' },
  alarmWorst: {
    below: (reading) => `laagste ${reading}`,
    above: (reading) => `hoogste ${reading}`,
    pest: (reading) => `hoogste aantal ${reading}`,
  },
  alarmFirst: (reading) => `bij aanvang ${reading}`,
  alarmStatus: { critical: 'kritiek', healthy: 'binnen de grenzen' },
  alarmBack: 'Weer normaal',
  alarmShow: 'Dit meetpunt nu tonen',
  alarmStart: 'Naar begin',
  alarmActionsOf: (what) => `Acties: ${what}`,
  alarmAcknowledge: 'Bevestigen',
  alarmAcknowledgeOf: (what) => `Bevestigen: ${what}`,
  alarmAcknowledgeAll: (count) => `Alles bevestigen (${count})`,
  alarmUnacknowledge: 'Bevestiging intrekken',
  alarmShelve: 'Uitstellen',
  alarmShelveHint: 'Tot dan geen melding, tenzij het erger wordt.',
  alarmShelveCritical:
    'Een alarm dat kritiek is of was, kunt u hoogstens 1 uur uitstellen, met opgave van reden.',
  alarmShelfReason: 'Reden',
  alarmShelfReasonOptional: 'Reden (optioneel)',
  alarmShelveMinutes: (minutes) => `${minutes} min`,
  alarmShelveHours: (hours) => `${hours} uur`,
  alarmShelved: (until, reason, by) =>
    `uitgesteld ${by === '' ? '' : `door ${by} `}tot ${until}${reason === '' ? '' : `: ${reason}`}`,
  alarmUnshelve: 'Uitstel opheffen',
  alarmResolved: 'opgelost',
  alarmUndo: 'Ongedaan maken',
  alarmDone: {
    acknowledge: (count) => `${counted(count, 'alarm', 'alarmen')} bevestigd`,
    unacknowledge: (count) => `${counted(count, 'alarm', 'alarmen')} niet meer bevestigd`,
    shelve: (count) => `${counted(count, 'alarm', 'alarmen')} uitgesteld`,
    unshelve: (count) => `${counted(count, 'alarm', 'alarmen')} niet meer uitgesteld`,
  },
  alarmsNew: (count) => `${count} nieuw`,
  alarmsNewHint: 'De volgorde blijft gelijk zolang u de lijst gebruikt. Nieuwe alarmen tonen',
  alarmFilter: 'Alarmen filteren',
  alarmFilterHint: 'Filteren …',
  alarmOrder: 'Volgorde',
  alarmOrders: { cause: 'Per oorzaak', newest: 'Nieuwste eerst', tag: 'Per meetpunt' },
  alarmSaveCsv: 'Alarmen opslaan als CSV',
  alarmsNoMatch: 'Geen alarm voldoet aan het filter.',
  alarmCount: (count) => counted(count, 'alarm', 'alarmen'),
  alarmTags: (tags, more) =>
    `${tags.length === 1 ? 'Meetpunt' : 'Meetpunten'} ${tags.join(', ')}${more > 0 ? ` en nog ${more}` : ''}`,
  alarmsNone: 'Geen actieve alarmen',
  alarmsNoneHint:
    'Een alarm gaat af na twee afwijkende metingen achter elkaar. Bij een plaag of ontbrekende gegevens gaat het meteen af.',
  alarmsWait: (tags) =>
    `${counted(tags, 'meetpunt wacht', 'meetpunten wachten')} op een tweede meting: nog geen alarm`,
  alarmNotYet: 'wacht op een tweede meting',
  alarmsNotYet: 'Wachten op de lijst met alarmen',
  alarmsStarting: 'De vastgelegde gegevens worden nog gelezen: er kunnen alarmen bijkomen.',
  alarmsHeard: (since) => `Er wordt niets vastgelegd; alarmen van vóór ${since} zijn niet bekend.`,
  alarmsLost: (clock) => `Laatst ontvangen om ${clock}. Latere gebeurtenissen zijn niet bekend.`,
  alarmsOfNow: (moment) => `Dit zijn de huidige alarmen. De rest van de pagina toont ${moment}.`,
  alarmsMine: '“Bevestigd” en “uitgesteld” gelden alleen in deze browser.',

  alarmTell: 'Alarmen melden',
  alarmSound: 'Geluid',
  alarmSoundHint: 'Een kort geluid bij nieuwe alarmen, hoogstens één per 10 s.',
  alarmSoundWaits: 'De browser staat geluid toe na uw eerste klik op deze pagina.',
  alarmSoundNone: 'Deze browser kan geen geluid afspelen.',
  alarmNotify: 'Melding',
  alarmNotifyHint: 'De browser meldt nieuwe alarmen, ook als u in een ander venster werkt.',
  alarmNotifyInsecure:
    'Browsers staan dit alleen toe op adressen die beginnen met https:// of http://localhost.',
  alarmNotifyRefused:
    'Deze browser blokkeert meldingen. Sta ze voor deze pagina toe in de instellingen.',
  alarmNotifyNone: 'Deze browser ondersteunt geen meldingen.',
  alarmNotifyTitle: (count) => counted(count, 'nieuw alarm', 'nieuwe alarmen'),

  alarmsRaised: (alarms, more) => `Nieuw: ${alarms.join('; ')}${more > 0 ? ` en nog ${more}` : ''}`,
  alarmsCleared: (alarms, more) =>
    `Opgelost: ${alarms.join('; ')}${more > 0 ? ` en nog ${more}` : ''}`,
  alarmsMeanwhile: (alarm, more) =>
    `Nieuw alarm: ${alarm}${more > 0 ? ` en nog ${counted(more, 'alarm', 'alarmen')}` : ''}`,
};
