/** Every word that the page shows, in one place. It knows nobody: whoever looks a word up has it typed. */
const counted = (count: number, one: string, many: string): string =>
  `${count} ${count === 1 ? one : many}`;

export const S = {
  product: 'Lupin twin',
  subtitle: 'Greenhouse',
  skipToTable: 'Skip to the table of tags',

  phase: {
    connecting: 'Connecting',
    live: 'Live',
    stale: 'No signal',
    offline: 'Twin offline',
    reconnecting: 'Reconnecting',
  },
  phaseLabel: 'Connection',
  retryNow: 'Try now',
  nextTry: (seconds: number): string => (seconds > 0 ? `next try in ${seconds} s` : 'trying now'),
  frozenSince: (clock: string): string => `Readings are frozen. Last data at ${clock}`,
  agoSuffix: (age: string): string => `${age} ago`,
  frozenWhy: {
    stale: 'The connection is open, but nothing comes through it any more.',
    reconnecting: 'The connection to the bridge is lost; the page resumes by itself.',
    connecting: 'Waiting for the bridge to answer.',
    live: '',
    offline: 'The bridge answers, but the twin behind it does not.',
  },
  offlineWhy: {
    live: '',
    paused: '',
    no_clock:
      'The twin has no time: nothing comes on /clock. How old the readings are is not known.',
    clock_stopped:
      'The twin’s time has stopped: nothing comes on /clock any more. How old the readings are is not known.',
    never_seen: 'The bridge has not heard from any twin yet. Is it running in this ROS domain?',
    stale: 'The twin has stopped publishing. Check that it still runs.',
    thread_dead: 'The bridge has lost its ROS thread and has to be restarted.',
    shutting_down: 'The server is shutting down.',
  } as const,

  unread: (count: number): string =>
    count === 1
      ? 'A message from the bridge could not be read and was dropped.'
      : `${count} messages from the bridge could not be read and were dropped.`,
  unreadLast: (why: string): string => `The last: ${why}`,
  failedTitle: 'The page has failed',
  failedHint: 'What it shows is not to be relied on. The twin and the bridge are not affected.',
  failedAgain: 'It is loaded anew by itself.',
  reload: 'Reload',

  health: {
    healthy: 'Healthy',
    stressed: 'Stressed',
    critical: 'Critical',
    'no-data': 'No data',
  },
  healthHeading: 'House health',
  healthDriver: (tag: string, sensor: string, value: string, ideal: string): string =>
    `Tag ${tag}: ${sensor} ${value}, ${ideal}`,
  healthIdeal: (low: string, high: string, unit: string): string =>
    `ideal ${low} to ${high} ${unit}`,
  healthAllWell: 'Every judged reading lies within its ideal range',
  healthNothing: 'No reading with an ideal range yet',
  healthFilter: ', show only these tags',
  /** Told to screen readers. */
  tagChosen: (tag: string, health: string, row: number, rows: number): string =>
    `Tag ${tag}, ${health}, ${row} of ${rows}`,
  tagsCritical: (tags: readonly string[], more: number): string =>
    `Critical now: ${tags.join('; ')}${more > 0 ? ` and ${more} more` : ''}`,
  attention: 'Needs attention',
  attentionNone: 'Nothing needs attention',
  below: 'below ideal',
  above: 'above ideal',

  sensors: 'Sensor',
  mapRegion: 'Map',
  mapPicture: 'Map of the greenhouse. The list beside it names the tags that need somebody.',
  mapLabel:
    'Map of the greenhouse. Arrow keys move it, plus and minus zoom, 0 shows everything, ' +
    'Enter opens the tag nearest to the crosshair. The table lists the same tags.',
  zoomIn: 'Zoom in',
  zoomOut: 'Zoom out',
  fit: 'Show everything',
  layersButton: 'Layers',
  layers: {
    map: 'SLAM map',
    field: 'Heat map',
    smooth: 'Smooth heat map',
    grid: 'Metre grid',
    boxes: 'Planter boxes',
    blooms: 'Blooms',
    pins: 'Tag pins',
    labels: 'Labels',
  },
  scaleBar: (length: string): string => `Scale: ${length}`,
  notKnown: 'not known',
  position: (x: string, y: string): string => `x ${x} m, y ${y} m`,

  legend: 'Legend',
  legendTags: (count: number): string => counted(count, 'tag contributes', 'tags contribute'),
  legendFetching: 'The heat map is on its way',
  legendNoTags: 'No tag contributes',
  legendError: (error: string): string => `leave-one-out error ${error}`,
  legendErrorHint:
    'Each tag is guessed from the others; this is the root mean square of the misses.',
  legendErrorWorst: (tag: string, error: string): string => `Worst at tag ${tag}: ${error}.`,
  legendTransparent:
    'Colour grows from the minimum to the maximum. No colour: the minimum, or not known; ' +
    'point at the map to tell.',
  legendTransparentShort: 'No colour: the minimum, or not known',
  legendIdeal: (low: string, high: string): string => `ideal ${low} to ${high}`,
  legendUnknownSpecies: 'Not classified',
  pinValue: 'reading',
  pinLacking: 'has no such sensor',
  pinFailed: 'sensor failed',
  pinPest: 'pest seen',
  range: 'Colour range',
  rangeAuto: 'Auto',
  rangeFixed: 'Fixed',
  rangeLow: 'Lowest',
  rangeHigh: 'Highest',
  rangeIdeal: 'Use ideal range',
  rangeNotBelow: (high: string): string => `Not below ${high}: not in use`,
  rangeNotAbove: (low: string): string => `Not above ${low}: not in use`,
  rangeNoNumber: 'No number: not in use',
  fieldFailed: (reason: string): string => `The heat map could not be fetched: ${reason}`,

  tags: 'Tags',
  tableCaption: 'All tags with their latest readings',
  filter: 'Filter tags',
  filterHint: 'tag, species, pest …',
  filterClear: 'Clear filter',
  shownOf: (shown: number, all: number): string =>
    shown === all ? counted(all, 'tag', 'tags') : `${shown} of ${counted(all, 'tag', 'tags')}`,
  nothingMatches: 'No tag matches the filter.',
  columns: {
    health: 'Health',
    tag: 'Tag',
    species: 'Species',
    flowers: 'Blooms',
    pest: 'Pest',
    age: 'Age',
  },
  pest: 'Pest',
  pestCount: (count: number): string => counted(count, 'bug', 'bugs'),
  notOnMap: 'No pin',
  notOnMapLong: 'No position known yet, so the tag has no pin on the map.',
  ageUnknown: 'not known',
  ageUnknownLong: 'How old this is nobody knows until the twin tells its time anew.',
  neverObserved: 'never',
  neverObservedLong: 'Discovered, but not scanned yet.',
  noSensor: '–',
  noSensorLong: 'no such sensor',
  sensorFailed: 'failed',
  sensorFailedLong: 'The sensor gave no number',
  confidence: (percent: string): string => `${percent} sure`,
  unclassified: 'not classified',

  card: (tag: string): string => `Tag ${tag}`,
  cardClose: 'Close',
  cardGone: 'The twin does not list this tag (any more).',
  cardShow: 'Show on map',
  cardMore: (count: number): string => `${count} more`,
  cardNoReadings: 'No readings yet.',
  cardHistory: (count: number, from: string, to: string): string =>
    `Last ${count} readings, between ${from} and ${to}`,
  cardBlooms: 'Blooms',
  cardPosition: 'Position',

  menu: 'Menu',
  unit: 'Temperature',
  theme: 'Theme',
  themes: { system: 'System', light: 'Light', dark: 'Dark' },
  copyLink: 'Copy link to this view',
  linkCopied: 'Link copied',
  linkInBar: 'The address bar holds the link to this view',
  savePng: 'Save map as PNG',
  saveCsv: 'Save table as CSV',
  saveCsvShort: 'CSV',
  print: 'Print',
  kiosk: 'Kiosk mode',
  help: 'Keyboard shortcuts',
  exportFailed: (reason: string): string => `Nothing was saved: ${reason}`,

  emptyConnecting: 'Connecting to the bridge',
  emptyConnectingHint: 'The greenhouse appears as soon as it answers.',
  emptyUnreachable: 'The bridge does not answer',
  emptyUnreachableHint:
    'Start it with “lupin-twin serve” on the robot, or “make run” for the demo. ' +
    'The page keeps trying by itself.',
  emptyNoTwin: 'No twin yet',
  emptyNoTags: 'No tags yet',
  emptyNoTagsHint:
    'The twin is running and waits. Tags appear when perception discovers them or the robot ' +
    'scans one: start a mission, or “lupin-twin demo” for a simulated patrol.',
  emptyNoPins: 'No tag has a position yet',
  emptyNoPinsHint: 'All tags are listed in the table; a pin appears with the first good scan.',
  emptyNoReading: (sensor: string): string => `No pinned tag has a reading of ${sensor} yet`,
  emptyNoReadingHint: 'Choose another sensor, or wait for the robot to scan more tags.',
  emptyNoMap: 'No SLAM map yet: is /map published?',

  helpTitle: 'Keyboard shortcuts',
  helpGlobal: 'Anywhere',
  helpMap: 'With the map in focus',
  helpToggle: 'Single-key shortcuts',
  keys: {
    global: [
      ['1 – 9', 'Choose a sensor'],
      ['/', 'Filter the table'],
      ['F', 'Show everything on the map'],
      ['N, P', 'Next and previous tag'],
      ['S', 'Smooth the heat map'],
      ['L', 'Layers'],
      ['U', '°C or °F'],
      ['T', 'Light or dark'],
      ['Esc', 'Close'],
      ['?', 'This list'],
    ],
    map: [
      ['← ↑ ↓ →', 'Move; with Shift faster'],
      ['+  −', 'Zoom'],
      ['0', 'Show everything'],
      ['Enter', 'Open the nearest tag'],
    ],
  } as const,

  csv: {
    tag: 'tag',
    health: 'health',
    driver: 'health driven by',
    x: 'x [m]',
    y: 'y [m]',
    species: 'species',
    confidence: 'species confidence',
    flowers: 'blooms',
    bugs: 'bugs',
    pest: 'pest',
    age: 'age [s]',
    observed: 'last observed [UTC]',
    yes: 'yes',
    no: 'no',
  },
  paper: (taken: string, printed: string): string => `As of ${taken}, printed ${printed}`,
  paperRest: (printed: number, all: number): string =>
    `Printed are the first ${printed} of ${all} tags. The table as CSV has all of them.`,
  paperRange: (sensor: string, range: string): string => `${sensor} ${range}`,
  fileName: (kind: string, stamp: string): string => `lupin-twin-${kind}-${stamp}`,
} as const;
