/** Alarmen: wat actief, uitgesteld en opgelost is, en hoe het wordt gemeld. */
import type * as EN from '../en/alarms';
import type { In } from '../shape';
import { counted } from './counted';

/** Wat niet genoemd is. */
const further = (more: number): string => (more > 0 ? ` en nog ${more}` : '');

export const ALARMS: In<typeof EN.ALARMS> = {
  alarms: 'Alarmen',
  listChoice: 'Naast de kaart',
  alarmsCount: (unseen, active) =>
    active === '0' ? 'geen actief' : `${active} actief, waarvan ${unseen} niet bevestigd`,
  alarmsNow: (active) => `nu ${active}`,
  alarmGroups: {
    active: (count) => `Actief (${count})`,
    shelved: (count) => `Uitgesteld (${count})`,
    resolved: (count) => `Opgelost in de afgelopen 24 uur (${count})`,
  },
  alarmHouse: 'Hele kas',
  alarmWhat: (where, what) => `${where}: ${what}`,
  alarmSince: (when) => `sinds ${when}`,
  alarmForOver: (length) => `al meer dan ${length}`,
  alarmUntil: (from, until, length) => `${from} tot ${until} (${length})`,
  alarmNow: (reading) => `nu ${reading}`,
  alarmNowUnknown: (last, age) =>
    last === null
      ? 'nu onbekend'
      : `nu onbekend, laatst ${last}${age === null ? '' : ` ${age} geleden`}`,
  alarmPests: { seen: 'gezien', still: 'nog steeds gezien', gone: 'niet meer gezien' },
  alarmWorst: {
    below: (reading) => `min. ${reading}`,
    above: (reading) => `max. ${reading}`,
    pest: (reading) => `max. ${reading}`,
  },
  alarmFirst: (reading) => `bij aanvang ${reading}`,
  alarmStatus: { critical: 'kritiek', healthy: 'binnen de grenzen' },
  alarmBack: 'Weer normaal',
  alarmShow: 'Dit meetpunt nu tonen',
  alarmStart: 'Naar het begin',
  alarmActionsOf: (what) => `Acties: ${what}`,
  alarmAcknowledge: 'Bevestigen',
  alarmAll: (what, count) =>
    what.includes(' ') ? `${what}: alle (${count})` : `Alle ${what.toLowerCase()} (${count})`,
  alarmAcknowledgedBy: (name, at) => `bevestigd door ${name}, ${at}`,
  alarmUnacknowledge: 'Bevestiging intrekken',
  alarmShelve: 'Uitstellen',
  alarmShelveHint: 'Tot dan geen melding, tenzij het erger wordt.',
  alarmShelveCritical:
    'Een alarm dat kritiek is of was, kunt u hoogstens 1 uur uitstellen, met opgave van reden.',
  alarmShelfReason: 'Reden',
  alarmShelfReasonOptional: 'Reden (optioneel)',
  alarmShelveFor: (time) => `Voor ${time}`,
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
  alarmFilterHint: 'Filteren…',
  alarmOrder: 'Volgorde',
  alarmOrders: { cause: 'Per oorzaak', newest: 'Nieuwste eerst', tag: 'Per meetpunt' },
  alarmSaveCsv: 'Alarmen opslaan als CSV',
  alarmsNoMatch: 'Geen alarm voldoet aan het filter.',
  alarmCount: (count) => counted(count, 'alarm', 'alarmen'),
  further,
  alarmTags: (tags, more) =>
    `${tags.length === 1 ? 'Meetpunt' : 'Meetpunten'} ${tags.join(', ')}${further(more)}`,
  alarmsNone: 'Geen actieve alarmen',
  alarmsNoneHint:
    'Een alarm gaat af na twee afwijkende metingen achter elkaar. Bij een plaag of ontbrekende gegevens gaat het meteen af.',
  alarmsWait: (tags) =>
    `${counted(tags, 'meetpunt wacht', 'meetpunten wachten')} op een tweede meting: nog geen alarm`,
  alarmNotYet: 'nog geen alarm',
  alarmsNotYet: 'Wachten op de lijst met alarmen',
  alarmsStarting: 'De vastgelegde gegevens worden nog gelezen: er kunnen alarmen bijkomen.',
  alarmsNoTime: 'Zolang de tijd onbekend is, kunnen er alarmen ontbreken.',
  alarmsReceived: (since) =>
    `Er wordt niets vastgelegd; alarmen van vóór ${since} zijn niet bekend.`,
  alarmsLost: 'Laatst ontvangen stand. Latere gebeurtenissen zijn niet bekend.',
  alarmsOfNow: (moment) => `Dit zijn de huidige alarmen. De rest van de pagina toont ${moment}.`,
  alarmsMine: '“Bevestigd” en “uitgesteld” gelden alleen in deze browser.',

  alarmNotifyMe: 'Alarmen melden',
  alarmSound: 'Geluid',
  alarmSoundHints: {
    ready: 'Een kort geluid bij nieuwe alarmen, hoogstens één keer per 10 s.',
    waits: 'De browser staat geluid toe na uw eerste klik op deze pagina.',
    none: 'Deze browser kan geen geluid afspelen.',
  },
  alarmNotify: 'Melding',
  alarmNotifyHint: 'De browser meldt nieuwe alarmen zolang deze pagina op de achtergrond open is.',
  alarmNotifyPushed: 'Kritieke alarmen komen ook als de pagina gesloten is.',
  alarmNotifyNot: {
    insecure:
      'Browsers staan dit alleen toe op adressen die beginnen met https:// of http://localhost.',
    refused: 'Deze browser blokkeert meldingen. Sta ze voor deze pagina toe in de instellingen.',
    none: 'Deze browser ondersteunt geen meldingen.',
  },
  alarmNotifyTitle: (count) => counted(count, 'nieuw alarm', 'nieuwe alarmen'),

  alarmsRaised: (alarms, more) => `Nieuw: ${alarms.join('; ')}${further(more)}`,
  alarmsCleared: (alarms, more) => `Opgelost: ${alarms.join('; ')}${further(more)}`,
  alarmsMeanwhile: (alarm, more) =>
    `Nieuw alarm: ${alarm}${more > 0 ? ` en nog ${counted(more, 'alarm', 'alarmen')}` : ''}`,
};

const ONE_OR_MANY = {
  healthy: 'Gezond',
  stressed: 'Onder stress',
  critical: 'Kritiek',
  unknown: 'Onbekend',
};

/** Oordelen en hun redenen. */
export const HEALTH: In<typeof EN.HEALTH> = {
  health: ONE_OR_MANY,
  healthMany: ONE_OR_MANY,
  reasons: {
    sides: { below: 'onder', above: 'boven' },
    must: {
      below: (limit) => `nog niet boven ${limit}`,
      above: (limit) => `nog niet onder ${limit}`,
    },
    just: {
      below: (limit) => `net onder ${limit}`,
      above: (limit) => `net boven ${limit}`,
    },
    readingFailed: (sensor) => `${sensor}: sensor geeft geen waarde`,
    implausible: (reading) => `${reading}: onwaarschijnlijke waarde`,
    scanFailed: (outcome, age) =>
      `Meting mislukt: ${outcome}${age === null ? '' : `, ${age} geleden`}`,
    pest: (count) =>
      count > 0 ? `${counted(count, 'plaagdier', 'plaagdieren')} gezien` : 'Plaag gezien',
    old: (sensor, age, holds, isDated) => {
      if (!isDated) {
        return sensor === ''
          ? 'Nog geen meetwaarde'
          : `${sensor}: geen meetwaarde met bekende leeftijd`;
      }
      const since =
        age === null
          ? sensor === ''
            ? 'Al een tijd niet gemeten'
            : 'al een tijd niet gemeten'
          : sensor === ''
            ? `Al ${age} niet gemeten`
            : `al ${age} geen meetwaarde`;
      return `${sensor === '' ? '' : `${sensor}: `}${since}${holds === null ? '' : ` (meetwaarden zijn ${holds} geldig)`}`;
    },
    outOfRange: 'buiten de grenzen',
    changed: (reading) => `${reading}: mogelijke sensorfout`,
    silent: 'Geen actuele gegevens van de digital twin',
    stopped: 'Er wordt niets meer gemeten: de robot staat stil, of zijn gegevens komen niet aan',
    other: (kind, sensor) => (sensor === '' ? kind : `${sensor}: ${kind}`),
  },
  airCause: { damp: 'Lucht te vochtig', dry: 'Lucht te droog' },
  todo: {
    sensors: {
      temperature: { below: 'Stoken of luchtramen sluiten', above: 'Luchten of schermen' },
      co2: { below: 'CO₂ doseren of luchten', above: 'Luchten, CO₂-dosering controleren' },
      light: { below: 'Belichting aanzetten', above: 'Schermen' },
      soil_moisture: { below: 'Water geven', above: 'Minder water geven, drain controleren' },
    },
    air: { damp: 'Luchten en stoken', dry: 'Bevochtigen' },
    range: 'Klimaatregeling controleren',
    watch: 'In de gaten houden',
    reading_failed: 'Sensor controleren',
    scan_failed: 'Pad en meetpunt controleren',
    pest: 'Controleren en bestrijden',
    old: 'Route van de robot controleren',
    changed: 'Vergelijken met een tweede meter',
    silent: 'Digital twin, server en netwerk controleren',
    stopped: 'Bij de robot gaan kijken',
    other: 'Ter plaatse gaan kijken',
  },
  todoPestAgain: 'Nogmaals controleren',
  todoWell: 'Volgende goede meting afwachten',
  todoAlso: (tags) => (tags === 1 ? 'ook meetpunt' : 'ook meetpunten'),
  todoLabel: 'Nu doen',
  reasonsLabel: 'Waarom',
  healthHeading: 'Toestand van de kas',
  healthMostUnknown: 'Van meer dan de helft van de meetpunten is niets bekend',
  healthSomeUnknown: (count) =>
    `${counted(count, 'meetpunt is', 'meetpunten zijn')} niet te beoordelen`,
  healthDay: (isDay, source) => `De ${isDay ? 'dag' : 'nacht'}grenzen gelden: ${source}`,
  healthDaySource: {
    light: 'volgens het gemeten licht in de kas',
    clock: 'volgens de klok, want er wordt geen licht gemeten',
    assumed: 'aangenomen, want licht en tijd zijn onbekend',
  },
  idealParts: { any: 'ideaal', day: 'ideaal overdag', night: 'ideaal ’s nachts' },
  healthAllWell: 'Alle beoordeelde meetwaarden liggen binnen de ideale grenzen',
  healthDespite: (alarms) =>
    alarms === '1'
      ? '1 alarm is nog actief: opgelost bij de volgende goede meting of controle'
      : `${alarms} alarmen zijn nog actief: opgelost bij de volgende goede meting of controle`,
  healthAcknowledged: 'bevestigd',
  healthNotCurrent: 'Niet actueel',
  healthNoTime: 'Niet beoordeeld zolang de tijd onbekend is',
  healthNothing: 'Nog geen meetwaarde om te beoordelen',
  healthNoRange: 'Geen meetwaarde met ideale grenzen',
  healthFilter: ', alleen deze meetpunten tonen',
  scanInterval: (interval) => `elk meetpunt om de ${interval}`,
  houseLast: (age) => `laatste meting ${age} geleden`,
  houseNever: 'nog geen meting',
  houseLate: (age, interval) => `Al ${age} geen meting (normaal elk meetpunt om de ${interval})`,
  houseOverdue: (count) =>
    count === 0
      ? 'alle meetpunten op tijd'
      : counted(count, 'meetpunt te laat', 'meetpunten te laat'),
  tagChosen: (tag, health, row, rows) => `Meetpunt ${tag}, ${health}, ${row} van ${rows}`,
  attention: 'Aandachtspunten',
  attentionNone: 'Geen aandachtspunten',
  attentionNoneKnown: (unknown) =>
    `Geen bekende problemen; geen gegevens van ${counted(unknown, 'meetpunt', 'meetpunten')}`,
  attentionMore: (count) => `+ nog ${count}`,

  tooLow: (by) => (by === null ? 'te laag' : `${by} te laag`),
  tooHigh: (by) => (by === null ? 'te hoog' : `${by} te hoog`),
  side: { below: 'laag', above: 'hoog' },
};
