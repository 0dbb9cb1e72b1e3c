/** Oordelen en hun redenen. */
import type { HEALTH as ENGLISH } from '../en/health';
import type { In } from '../shape';
import { counted } from './counted';

const ONE_OR_MANY = {
  healthy: 'Gezond',
  stressed: 'Gestrest',
  critical: 'Kritiek',
  unknown: 'Onbekend',
};

export const HEALTH: In<typeof ENGLISH> = {
  health: ONE_OR_MANY,
  healthMany: ONE_OR_MANY,
  reasons: {
    sides: { below: 'onder', above: 'boven' },
    wasBeyond: (side, limit, status, until) =>
      `was ${side} ${limit}; blijft ${status} tot ${until}`,
    just: {
      below: (limit) => `net onder ${limit}`,
      above: (limit) => `net boven ${limit}`,
    },
    readingFailed: (sensor) => `${sensor}: de sensor geeft geen waarde`,
    implausible: (reading) => `${reading}: onwaarschijnlijke waarde`,
    scanFailed: (outcome, age) =>
      `Laatste meting mislukt: ${outcome}${age === null ? '' : `, ${age} geleden`}`,
    pest: (count) =>
      count > 0 ? `${counted(count, 'plaagdier', 'plaagdieren')} gezien` : 'Plaag gezien',
    old: (sensor, age, holds, isDated) => {
      const since = !isDated
        ? sensor === ''
          ? 'Geen meting met bekende tijd'
          : 'geen meetwaarde met bekende tijd'
        : age === null
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
    silent: 'Geen gegevens van de digital twin: de laatste gegevens kunnen verouderd zijn',
    stopped: 'Er wordt niets meer gemeten: de robot staat stil, of zijn gegevens komen niet aan',
    other: (kind, sensor) => (sensor === '' ? kind : `${sensor}: ${kind}`),
  },
  todo: {
    sensors: {
      temperature: { below: 'Stoken of luchting sluiten', above: 'Luchten of schermen' },
      humidity: { below: 'Bevochtigen', above: 'Luchten en stoken' },
      co2: { below: 'CO₂ doseren of luchten', above: 'Luchten, CO₂-dosering controleren' },
      light: { below: 'Belichting aanzetten', above: 'Schermen' },
      soil_moisture: { below: 'Water geven', above: 'Minder water geven, drainage controleren' },
      vpd: { below: 'Luchten en stoken', above: 'Bevochtigen of schermen' },
    },
    range: 'Klimaatregeling controleren',
    reading_failed: 'Sensor controleren',
    scan_failed: 'Pad en meetpunt controleren',
    pest: 'Controleren en bestrijden',
    old: 'Route van de robot controleren',
    changed: 'Vergelijken met een tweede meter',
    silent: 'Digital twin, server en netwerk controleren',
    stopped: 'Bij de robot gaan kijken',
    other: 'Ter plaatse gaan kijken',
  },
  todoPestAgain: 'Nogmaals controleren: zonder plaag is het alarm opgelost',
  todoWell: 'Opgelost bij de volgende goede meting',
  todoAlso: 'ook',
  todoLabel: 'Nu doen',
  reasonsLabel: 'Waarom',
  healthHeading: 'Toestand van de kas',
  healthDriver: (tag, reason) => `Meetpunt ${tag}: ${reason}`,
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
  healthIdeal: (ideal, low, high, unit) => `${ideal} ${low} tot ${high} ${unit}`.trim(),
  healthAllWell: 'Alle beoordeelde meetwaarden liggen binnen het ideale bereik',
  healthDespite: (alarms) =>
    alarms === 1
      ? '1 alarm is nog actief: na twee goede metingen is het opgelost'
      : `${alarms} alarmen zijn nog actief: elk is na twee goede metingen opgelost`,
  healthAcknowledged: 'bevestigd',
  healthNotCurrent: 'Niet actueel',
  healthNothing: 'Nog geen meetwaarde om te beoordelen',
  healthFilter: ', alleen deze meetpunten tonen',
  houseRhythm: (interval) => `elke ${interval} een meting`,
  houseLast: (age) => `laatste meting ${age} geleden`,
  houseNever: 'nog geen meting',
  houseLate: (age, interval) => `Al ${age} geen meting (normaal elke ${interval})`,
  houseOverdue: (count) =>
    count === 0
      ? 'alle meetpunten op tijd'
      : counted(count, 'meetpunt te laat', 'meetpunten te laat'),
  tagChosen: (tag, health, row, rows) => `Meetpunt ${tag}, ${health}, ${row} van ${rows}`,
  attention: 'Vraagt aandacht',
  attentionNone: 'Niets vraagt aandacht',
  attentionNoneKnown: (unknown) =>
    `Geen bekende problemen; geen gegevens van ${counted(unknown, 'meetpunt', 'meetpunten')}`,
  attentionMore: (count) => `+ nog ${count}`,

  tooLow: (by) => (by === null ? 'te laag' : `${by} te laag`),
  tooHigh: (by) => (by === null ? 'te hoog' : `${by} te hoog`),
  side: { below: 'laag', above: 'hoog' },
  below: 'onder ideaal',
  above: 'boven ideaal',
};
