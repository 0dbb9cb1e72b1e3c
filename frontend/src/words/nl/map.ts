/** De kaart: bediening, legenda, kleurbereik, vergelijking. */
import type * as EN from '../en/map';
import type { In } from '../shape';
import { counted, whole } from './counted';

const SHORT = new Map([
  ['Temperatuur', 'Temp.'],
  ['Luchtvochtigheid (RV)', 'RV'],
  ['Bodemvocht', 'Bodem'],
  ['Dampdrukdeficit (VPD)', 'VPD'],
]);

export const MAP: In<typeof EN.MAP> = {
  sensors: 'Sensor',
  mapRegion: 'Kaart',
  mapPicture: 'Kaart van de kas. De lijst ernaast noemt de meetpunten die aandacht vragen.',
  mapLabel:
    'Kaart van de kas. Pijltoetsen verschuiven, plus en min zoomen, 0 toont alles, ' +
    'Enter opent het meetpunt dat het dichtst bij het kruis ligt. ' +
    'De tabel noemt dezelfde meetpunten.',
  zoomIn: 'Inzoomen',
  zoomOut: 'Uitzoomen',
  fit: 'Alles tonen',
  layersButton: 'Lagen',
  layers: {
    map: 'Plattegrond',
    field: 'Heatmap',
    unknown: 'Gebieden zonder gegevens',
    grid: 'Meterraster',
    boxes: 'Plantenbakken',
    blooms: 'Bloemen',
    pins: 'Meetpunten',
    labels: 'Bijschriften',
    advice: 'Voorgestelde meetpunten',
  },
  scaleBar: (length) => `Schaal: ${length}`,
  notKnown: 'onbekend',
  position: (x, y) => `x ${x} m, y ${y} m`,

  legend: 'Legenda',
  legendWaiting: 'Namen, eenheden en grenzen worden geladen',
  legendFailed: (reason) =>
    `Namen, eenheden en grenzen konden niet worden geladen (${reason}); de pagina blijft het proberen.`,
  legendTags: (count) => counted(count, 'meetpunt telt mee', 'meetpunten tellen mee'),
  legendFetching: 'De heatmap wordt geladen',
  legendNoTags: 'Geen meetpunt telt mee',
  legendError: (error) => `Gebruikelijke afwijking ${error}`,
  legendErrorHint:
    'Gebruikelijke afwijking tussen de meetpunten: elk meetpunt wordt uit alle andere geschat en vergeleken met de eigen meetwaarde.',
  legendTransparent: 'Sterkere kleur: hogere waarde. Geen kleur: laagste waarde.',
  legendMore: 'Details',
  legendHatched: 'Gearceerd: geen gegevens',
  legendOld: 'Bleek en gearceerd: meetwaarden te oud',
  readoutOld: 'meetwaarden te oud',
  heat: 'Heatmap toont',
  heats: { nearest: 'Meetwaarden', estimate: 'Schatting', error: 'Onzekerheid' },
  partMissing: 'Dit deel van de pagina kon niet worden geladen. Laad de pagina opnieuw.',
  colouring: 'Kleuren naar',
  colourings: { ideal: 'Ideaal', value: 'Waarde' },
  legendNoIdeal: 'Nu geen ideale grenzen: gekleurd naar waarde',
  sensorShort: (label) => SHORT.get(label) ?? label,
  legendBelow: (value) => `onder ${value}`,
  legendAbove: (value) => `boven ${value}`,
  legendAgainst: (sensor) => `${sensor} vergeleken met de ideale grenzen`,
  valueRange: (low, high) => `${low}\u00a0tot\u00a0${high}`,
  legendEach: (part) => `${part} per soort`,
  legendOthers: 'andere',
  pinLacking: 'Geen sensor',
  pinFailed: 'Sensor uitgevallen',
  pinPest: 'Plaag gezien',
  rangeKeep: 'Bereik vasthouden',
  fieldFailed: (reason) =>
    `De heatmap kon niet worden geladen (${reason}); de pagina blijft het proberen.`,

  compare: 'Vergelijken met',
  compareWith: {
    none: 'niets',
    day: 'gisteren',
    week: 'een week geleden',
  },
  compareEnd: 'Vergelijking stoppen',
  difference: (sensor) => `${sensor}: verschil`,
  differenceLoading: 'Het verschil wordt geladen',
  differenceNothing: (at) => `Geen gegevens van ${at}.`,
  differenceFailed: (reason) => `Geen verschil: ${reason}`,
  differenceTimes: (at, against) => `${at} vergeleken met ${against}`,
  differenceSince: (moment) => `ten opzichte van ${moment}`,

  robotLayer: 'Robot',
  robotAt: (x, y) => `Robot: x ${x} m, y ${y} m`,
  robotNowhere: 'Robot: positie onbekend',
  robotAgeUnknown: 'tijd onbekend',
  robotBattery: (percent) => `accu ${percent}`,
  robotReported: (percent, ago) => `accu ${percent}, gemeld: ${ago}`,
};

/** De meetpunten: hun tabel en de kaart van één ervan. */
export const TAGS: In<typeof EN.TAGS> = {
  tags: 'Meetpunten',
  tableCaption: 'Alle meetpunten met hun nieuwste meetwaarden',
  filter: 'Meetpunten filteren',
  filterHint: 'Nr., soort, plaag…',
  filterClear: 'Filter wissen',
  shownOf: (shown, all) =>
    shown === all
      ? counted(all, 'meetpunt', 'meetpunten')
      : `${whole(shown)} van ${counted(all, 'meetpunt', 'meetpunten')}`,
  nothingMatches: 'Geen meetpunt voldoet aan het filter.',
  columns: {
    health: 'Toestand',
    tag: 'Nr.',
    species: 'Soort',
    flowers: 'Bloemen',
    age: 'Geleden',
  },
  pest: 'Plaag',
  pestCount: (count) => counted(count, 'plaagdier', 'plaagdieren'),
  notOnMap: 'Geen positie',
  notOnMapLong: 'De positie is nog niet bekend; het meetpunt staat niet op de kaart.',
  farOff: 'Te ver weg, niet op de kaart',
  farOffLong: (place) =>
    `De positie (${place}) ligt ver van alle andere meetpunten; het meetpunt staat niet op de kaart.`,
  ageUnknown: 'onbekend',
  ageUnknownLong: 'Onbekend hoe lang geleden, tot de tijd van de digital twin bekend is.',
  neverObserved: 'nooit',
  neverObservedLong: 'Nog geen meting heeft een waarde opgeleverd.',
  notKnownThenLong: 'Dit wordt niet meer bewaard of was nog niet vastgelegd.',
  ageUnreportedLong: 'Deze digital twin meldt niet van wanneer zijn meetwaarden zijn.',
  attemptOutcomes: {
    ok: 'OK',
    unreachable: 'niet bereikbaar',
    undecoded: 'niet leesbaar',
    skipped: 'overgeslagen',
    failed: 'reden onbekend',
  },
  noValue: '–',
  sensorFailed: 'uitgevallen',
  sensorFailedLong: 'De sensor gaf geen waarde',
  confidence: (percent) => `${percent} zeker`,
  notSure: 'onzeker',
  speciesNames: {
    lupin: 'Lupine',
    tulip: 'Tulp',
    gerbera: 'Gerbera',
    orchid: 'Orchidee',
    rose: 'Roos',
    lettuce: 'Sla',
    tomato: 'Tomaat',
    cucumber: 'Komkommer',
    strawberry: 'Aardbei',
  },
  unclassified: 'Niet herkend',
  tableButton: 'Kolommen en rijen',
  tableColumns: 'Kolommen',
  tableByArea: 'Groeperen per afdeling',
  areaNone: 'Geen afdeling',
  trend: 'Trend',
  trendTitle: (sensor, hour) =>
    `${sensor} vergeleken met een ${hour ? `kasuur (${hour})` : 'uur'} geleden`,
  trendNone: 'een uur geleden geen meting',
  trendSame: 'geen nieuwe waarde',
  trendLevel: 'gelijk',
  trendUnknown: 'een uur geleden: onbekend',

  card: (tag) => `Meetpunt ${tag}`,
  cardClose: 'Sluiten',
  cardGone: 'De digital twin kent dit meetpunt niet.',
  cardGoneThen: 'De digital twin kende dit meetpunt toen niet.',
  cardShow: 'Op de kaart tonen',
  cardMore: (count) => `nog ${count}`,
  cardSource: 'Bron',
  cardFixed: 'Vaste sensor',
  cardVisited: 'Bezocht door de robot',
  cardScanned: 'Laatste meetwaarde',
  cardInspected: 'Bloemen gecontroleerd',
  cardLastAttempt: 'Laatste poging',
  cardArea: 'Afdeling',
  cardPosition: 'Positie',
};

/** De grafieken en hun tabellen. */
export const CHARTS: In<typeof EN.CHARTS> = {
  charts: 'Grafieken',
  chartOf: (sensor) => `Grafiek: ${sensor}`,
  chartsSeveral: 'Meerdere',
  chartSpan: (from, to) => `${from} tot ${to}`,
  chartSummary: (count, latest, at, low, high, gaps) =>
    `${counted(count, 'meetwaarde', 'meetwaarden')}, de laatste ${latest} (${at}), ` +
    `tussen ${low} en ${high}, ${gaps === 0 ? 'geen gat' : counted(gaps, 'gat', 'gaten')}.`,
  chartEmpty: 'Geen meetwaarde in deze periode.',
  chartNeedsDay: (known) =>
    known === null
      ? 'Heeft 24 u aan meetwaarden nodig, zonder gat van meer dan 3 u'
      : `Heeft 24 u aan meetwaarden nodig; tot nu toe ${known}`,
  chartLoading: 'De historie wordt geladen',
  chartFailed: (reason) =>
    `De historie kon niet worden geladen (${reason}); de pagina blijft het proberen.`,
  chartNoTime: 'De tijd van de digital twin is nog niet bekend; er is nog geen historie.',
  chartIdealsDiffer: 'Ideaal verschilt per soort',
  chartNoSensors: 'Dit meetpunt heeft geen sensor.',
  chartTable: 'Als tabel tonen',
  chartPlots: 'Als grafiek tonen',
  chartDayBefore: 'Dag ervoor',
  chartBeforeWas: (value) => `dag ervoor ${value}`,
  chartWhole: 'Hele periode',
  chartCsvShown: 'CSV van de weergave',
  chartCsvAll: 'CSV van alle meetwaarden',
  chartAddTag: '+ Meetpunt',
  chartRemoveTag: (tag) => `Meetpunt ${tag} uit de grafiek halen`,
  chartWhich: 'Tabel van',
  chartHint: 'Sleep om in te zoomen; klik om naar dat moment te gaan.',
  chartColumns: {
    time: 'Tijd',
    until: 'Tot',
    value: 'Waarde',
    count: 'Meetwaarden',
    mean: 'Gemiddelde',
    min: 'Laagste',
    max: 'Hoogste',
    event: 'Gebeurtenis',
  },
  chartGap: (length) => `${length} geen gegevens`,
  missing: { not_kept: 'niet meer bewaard', not_recorded: 'niet vastgelegd' },
  chartFailures: (count) => counted(count, 'mislukte poging', 'mislukte pogingen'),
  chartInspections: (count) => counted(count, 'bloemcontrole', 'bloemcontroles'),
};
