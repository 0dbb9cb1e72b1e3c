/** The map: its controls, legend, colour range and comparison. */
import { counted, whole } from './counted';

const SHORT = new Map([
  ['Temperature', 'Temp.'],
  ['Soil moisture', 'Soil'],
  ['Vapour pressure deficit', 'VPD'],
]);

export const MAP = {
  sensors: 'Sensor',
  mapRegion: 'Map',
  mapPicture: 'Map of the greenhouse. The list beside it names the tags that need attention.',
  mapLabel:
    'Map of the greenhouse. Arrow keys move it, plus and minus zoom, 0 shows everything, ' +
    'Enter opens the tag nearest to the crosshair. The table lists the same tags.',
  zoomIn: 'Zoom in',
  zoomOut: 'Zoom out',
  fit: 'Fit to view',
  layersButton: 'Layers',
  layers: {
    map: 'Floor plan',
    field: 'Heat map',
    unknown: 'Areas without data',
    grid: 'Metre grid',
    boxes: 'Planter boxes',
    blooms: 'Blooms',
    pins: 'Tag pins',
    labels: 'Labels',
    advice: 'Suggested tag positions',
  },
  scaleBar: (length: string): string => `Scale: ${length}`,
  notKnown: 'unknown',
  position: (x: string, y: string): string => `x ${x} m, y ${y} m`,

  legend: 'Legend',
  legendWaiting: 'Loading names, units and ranges',
  legendFailed: (reason: string): string =>
    `Names, units and ranges could not be loaded (${reason}); the page keeps trying.`,
  legendTags: (count: number): string => counted(count, 'tag contributes', 'tags contribute'),
  legendFetching: 'Loading the heat map',
  legendNoTags: 'No tag contributes',
  legendError: (error: string): string => `Typical error ${error}`,
  legendErrorHint:
    'Typical error between tags: each tag is estimated from all the others and compared with its own reading.',
  legendTransparent: 'Stronger colour: higher value. No colour: minimum.',
  legendMore: 'Details',
  legendHatched: 'Hatched: no data',
  legendOld: 'Faint and hatched: readings too old',
  readoutOld: 'readings too old',
  heat: 'Heat map shows',
  heats: { nearest: 'Readings', estimate: 'Estimate', error: 'Uncertainty' },
  partMissing: 'This part of the page could not be loaded. Reload the page.',
  colouring: 'Colour by',
  colourings: { ideal: 'Ideal', value: 'Value' },
  legendNoIdeal: 'No ideal range for now: coloured by value',
  /** Short sensor name for the sensor picker and table headings; a site's own name stays as it is. */
  sensorShort: (label: string): string => SHORT.get(label) ?? label,
  legendBelow: (value: string): string => `below ${value}`,
  legendAbove: (value: string): string => `above ${value}`,
  legendAgainst: (sensor: string): string => `${sensor} compared with its ideal range`,
  /** A word, not a dash: "−2 to 5". No-break spaces keep it on one line. */
  valueRange: (low: string, high: string): string => `${low}\u00a0to\u00a0${high}`,
  legendEach: (part: string): string => `${part} per species`,
  legendOthers: 'others',
  pinLacking: 'No sensor',
  pinFailed: 'Sensor failed',
  pinPest: 'Pest seen',
  rangeKeep: 'Keep this range',
  fieldFailed: (reason: string): string =>
    `The heat map could not be loaded (${reason}); the page keeps trying.`,

  compare: 'Compare with',
  compareWith: {
    none: 'nothing',
    day: 'yesterday',
    week: 'a week ago',
  },
  compareEnd: 'Stop comparing',
  difference: (sensor: string): string => `${sensor}: difference`,
  differenceLoading: 'Loading the difference',
  differenceNothing: (at: string): string => `No data for ${at}.`,
  differenceFailed: (reason: string): string => `No difference: ${reason}`,
  differenceTimes: (at: string, against: string): string => `${at} compared with ${against}`,
  differenceSince: (moment: string): string => `since ${moment}`,

  robotLayer: 'Robot',
  robotAt: (x: string, y: string): string => `Robot: x ${x} m, y ${y} m`,
  robotNowhere: 'Robot: position unknown',
  robotAgeUnknown: 'age unknown',
  robotBattery: (percent: string): string => `battery ${percent}`,
  robotReported: (percent: string, ago: string): string => `battery ${percent}, reported ${ago}`,
} as const;

/** The tags: their table, and a tag's card. */
export const TAGS = {
  tags: 'Tags',
  tableCaption: 'All tags with their latest readings',
  filter: 'Filter tags',
  filterHint: 'Tag, species, pest…',
  filterClear: 'Clear filter',
  shownOf: (shown: number, all: number): string =>
    shown === all
      ? counted(all, 'tag', 'tags')
      : `${whole(shown)} of ${counted(all, 'tag', 'tags')}`,
  nothingMatches: 'No tag matches the filter.',
  columns: {
    health: 'Status',
    tag: 'Tag',
    species: 'Species',
    flowers: 'Blooms',
    age: 'Age',
  },
  pest: 'Pest',
  pestCount: (count: number): string => counted(count, 'pest', 'pests'),
  notOnMap: 'No pin',
  notOnMapLong: 'No position known yet, so the tag has no pin on the map.',
  farOff: 'Too far away, not on the map',
  farOffLong: (place: string): string =>
    `Its position (${place}) is far from all other tags, so the tag has no pin on the map.`,
  ageUnknown: 'unknown',
  ageUnknownLong: 'The age is unknown until the twin’s time is known.',
  neverObserved: 'never',
  neverObservedLong: 'No scan has returned a reading yet.',
  notKnownThenLong: 'This is no longer stored, or was not recorded yet.',
  ageUnreportedLong: 'This twin does not report when readings were taken.',
  attemptOutcomes: {
    ok: 'OK',
    unreachable: 'not reachable',
    undecoded: 'not readable',
    skipped: 'skipped',
    failed: 'reason unknown',
  },
  noValue: '–',
  sensorFailed: 'failed',
  sensorFailedLong: 'The sensor returned no value',
  confidence: (percent: string): string => `${percent} certain`,
  notSure: 'uncertain',
  /** Common species, by their name on the wire; others are shown as received. */
  speciesNames: {
    lupin: 'Lupin',
    tulip: 'Tulip',
    gerbera: 'Gerbera',
    orchid: 'Orchid',
    rose: 'Rose',
    lettuce: 'Lettuce',
    tomato: 'Tomato',
    cucumber: 'Cucumber',
    strawberry: 'Strawberry',
  },
  unclassified: 'Not classified',
  tableButton: 'Columns and rows',
  tableColumns: 'Columns',
  tableByArea: 'Group by area',
  areaNone: 'No area',
  trend: 'Trend',
  /** `hour` is the length of a shortened greenhouse hour; null: a normal hour. */
  trendTitle: (sensor: string, hour: string | null): string =>
    `${sensor} compared with ${hour ? `a greenhouse hour (${hour})` : 'an hour'} ago`,
  trendNone: 'no reading an hour ago',
  trendSame: 'no new reading',
  trendLevel: 'steady',
  trendUnknown: 'an hour ago: unknown',

  card: (tag: string): string => `Tag ${tag}`,
  cardClose: 'Close',
  cardGone: 'The twin does not know this tag.',
  cardGoneThen: 'The twin did not know this tag then.',
  cardShow: 'Show on map',
  cardMore: (count: number): string => `${count} more`,
  cardSource: 'Source',
  cardFixed: 'Fixed sensor',
  cardVisited: 'Visited by the robot',
  cardScanned: 'Last reading',
  cardInspected: 'Flowers inspected',
  cardLastAttempt: 'Last attempt',
  cardArea: 'Area',
  cardPosition: 'Position',
} as const;

/** The charts and their tables. */
export const CHARTS = {
  charts: 'Charts',
  chartOf: (sensor: string): string => `Chart of ${sensor}`,
  chartsSeveral: 'Several tags',
  chartSpan: (from: string, to: string): string => `${from} to ${to}`,
  chartSummary: (
    count: number,
    latest: string,
    at: string,
    low: string,
    high: string,
    gaps: number,
  ): string =>
    `${counted(count, 'reading', 'readings')}, the latest ${latest} (${at}), ` +
    `between ${low} and ${high}, ${gaps === 0 ? 'no gap' : counted(gaps, 'gap', 'gaps')}.`,
  chartEmpty: 'No reading in this period.',
  /** For a daily quantity. `known`: how far back data reaches; null: a day, but with a gap. */
  chartNeedsDay: (known: string | null): string =>
    known === null
      ? 'Needs 24 h of readings without a gap longer than 3 h'
      : `Needs 24 h of readings; ${known} so far`,
  chartLoading: 'Loading history',
  chartFailed: (reason: string): string =>
    `History could not be loaded (${reason}); the page keeps trying.`,
  chartNoTime: 'The twin’s time is not known yet, so there is no history.',
  chartIdealsDiffer: 'Ideal ranges differ by species',
  chartNoSensors: 'This tag has no sensor.',
  chartTable: 'Show as table',
  chartPlots: 'Show as charts',
  chartDayBefore: 'Day before',
  chartBeforeWas: (value: string): string => `day before ${value}`,
  chartWhole: 'Whole period',
  chartCsvShown: 'CSV of this view',
  chartCsvAll: 'CSV of all readings',
  chartAddTag: 'Add a tag',
  chartRemoveTag: (tag: string): string => `Remove tag ${tag} from the chart`,
  chartWhich: 'Table of',
  chartHint: 'Drag to zoom; click to go to that time.',
  chartColumns: {
    time: 'Time',
    until: 'Until',
    value: 'Value',
    count: 'Readings',
    mean: 'Mean',
    min: 'Lowest',
    max: 'Highest',
    event: 'Event',
  },
  chartGap: (length: string): string => `no data for ${length}`,
  missing: { not_kept: 'no longer stored', not_recorded: 'not recorded' },
  chartFailures: (count: number): string => counted(count, 'failed attempt', 'failed attempts'),
  chartInspections: (count: number): string =>
    counted(count, 'flower inspection', 'flower inspections'),
} as const;
