/** The page itself: connection, troubles, menu, help, exports. */
import { counted } from './counted';

export const PAGE = {
  product: 'Lupin twin',
  subtitle: 'Greenhouse',
  skipToTable: 'Skip to the table of tags',
  more: 'More about this',

  language: 'Language',
  languageMissing: (name: string): string =>
    `${name} could not be loaded. The page is shown in English.`,
  partsLate: 'Part of the page has not loaded.',
  partsLateHint:
    'Cards, lists and the time bar appear when the server responds. The page keeps trying.',

  phase: {
    connecting: 'Connecting',
    live: 'Live',
    stale: 'No signal',
    offline: 'Twin offline',
    /** Data arrives, but the twin has no valid time. */
    noTime: 'Time unknown',
    reconnecting: 'Reconnecting',
  },
  phaseLabel: 'Connection',
  retryNow: 'Try now',
  frozenSince: (clock: string): string => `Last data at ${clock}`,
  agoSuffix: (age: string): string => `${age} ago`,
  /** The unit within an age: "1 h 18 min". */
  hours: 'h',
  frozenWhy: {
    stale: 'The connection is open, but no data arrives.',
    reconnecting: 'Connection to the server lost.',
    connecting: 'Waiting for the server to respond.',
    offline: 'The server responds, but the twin does not.',
  },
  /** What to do about a twin without a valid time; the reasons below continue it. */
  clockTodo: {
    no_clock: 'Start the simulation or the recording.',
    clock_stopped: 'Check the simulation or the recording.',
    clock_doubted: 'Set the twin’s clock.',
  },
  offlineWhy: {
    no_clock:
      'The twin takes its time from it and has none yet. The age of the readings is unknown.',
    clock_stopped:
      'The twin takes its time from it, and that has stopped. The age of the readings is unknown.',
    clock_doubted:
      'It is behind the recorded data. Until it is set, for ten minutes at most, ages are unknown and nothing is recorded.',
    clock_ahead: 'It is ahead of the archive’s clock, so ages are unknown.',
    never_seen: 'The server has received nothing from a twin yet. Is the twin switched on?',
    stale: 'The twin has stopped sending. Check that it is running.',
    thread_dead: 'The server has lost contact with the twin and must be restarted.',
    shutting_down: 'The server is shutting down.',
  },
  /** For whoever maintains the system; empty: nothing to add. */
  offlineMore: {
    no_clock: 'The twin uses simulated time, but nothing is published on /clock.',
    clock_stopped: 'The twin uses simulated time, but /clock has stopped.',
    never_seen: 'Twin and bridge must use the same ROS domain (ROS_DOMAIN_ID).',
    stale: 'The bridge is running, but nothing is published on /twin/state.',
    thread_dead: 'The bridge’s ROS thread has ended; its log says why.',
  },

  /** Replaces the server's error if it may recover soon. */
  serverBusy: 'Server busy or unreachable',
  unread: (count: number): string =>
    count === 1
      ? 'A message from the server could not be read and was dropped.'
      : `${count} messages from the server could not be read and were dropped.`,
  paused: 'Time is paused.',
  pausedHint: 'The simulation or recording is paused, so ages do not increase.',
  mixture: 'More than one twin sends data. The page shows a mixture of them: stop all but one.',
  inputProblem: 'Some data does not arrive.',
  drops: (count: number): string =>
    `The twin dropped ${counted(count, 'message', 'messages')} in the last few minutes.`,
  /** For a journal that does not record: the problem, and what to do. */
  journal: {
    off: {
      title: 'Recording is off.',
      hint: 'A restart loses all earlier data.',
    },
    slow: {
      title: 'Recording has fallen behind.',
      hint: 'Data waits in memory until the disk catches up. A power cut would lose it.',
    },
    failing: {
      title: 'Recording has failed.',
      hint: 'The twin keeps running. If the disk is full, free space; if it is read-only, make it writable. Recording then resumes by itself.',
    },
    upgrading: {
      title: 'The recording of an older version is being upgraded.',
      hint: 'New data is shown but not yet recorded. Earlier data returns after the upgrade, which may take minutes.',
    },
    in_use: {
      title: 'This twin is not recording: another twin uses its file.',
      hint: 'Stop one of them, or give this one a file of its own.',
    },
    foreign: {
      title: 'This twin is not recording: it cannot read its file.',
      hint: 'Nothing in it was changed. Give the twin another file, or move this one.',
    },
  },
  /** For a notification channel that fails. */
  notificationChannels: {
    mqtt: 'Home automation (MQTT) receives no updates.',
    webhook: 'The webhook receives no alarms.',
    push: 'Phones receive no alarms.',
  },
  notificationOther: (channel: string): string => `${channel} receives no updates.`,
  notificationHint: 'The server keeps trying. This page is not affected.',
  journalMore: 'The file is named by the twin’s parameter “journal”; “off” records nothing.',
  /** Origin of the data, unless it is a real robot's, live. */
  origin: { simulated: 'Simulated', recorded: 'Recorded', sim_time: 'Simulated time' },
  originDay: (length: string): string => `1 greenhouse day = ${length}`,
  originHint: {
    simulated: 'No real robot: greenhouse, plants and readings are simulated.',
    recorded: 'A recording is playing: nothing here is current.',
    sim_time: 'Not real time: the data comes from a simulation or a recording.',
  },
  recordedIs: { playing: 'Playing', paused: 'Paused' },
  recordedPaused: 'The recording is paused.',
  recordedPausedHint: 'It is paused or has ended, so ages do not increase.',
  simulated: 'Simulated.',
  simulatedHint: (until: string): string => `All data until ${until} is demo data, not measured.`,
  quarantined: 'A damaged recording was quarantined.',
  quarantinedHint: (name: string): string =>
    `Readable data was kept, and recording continues. The damaged file is ${name}.`,
  failedTitle: 'The page has failed',
  failedHint:
    'Do not rely on what it shows. The twin and the server are not affected. The page reloads automatically.',
  reload: 'Reload',

  menu: 'Menu',
  unit: 'Temperature',
  theme: 'Theme',
  themes: { system: 'System', light: 'Light', dark: 'Dark' },
  savePng: 'Save map as PNG',
  saveCsv: 'Save table as CSV',
  saveCsvShort: 'CSV',
  report: 'Shift report',
  print: 'Print',
  kiosk: 'Wall screen',
  kioskLeave: 'Exit',
  help: 'Keyboard shortcuts',
  signOut: 'Sign out',
  signOutFailed: (reason: string): string => `You are still signed in: ${reason}`,
  exportFailed: (reason: string): string => `Nothing was saved: ${reason}`,

  emptyConnecting: 'Connecting to the server',
  emptyConnectingHint: 'The greenhouse appears when the server responds.',
  emptyUnreachable: 'The server is not responding',
  emptyUnreachableHint: 'Check that it is switched on. The page keeps trying.',
  emptyUnreachableMore:
    'The server is the bridge: “lupin-twin serve” on the robot, or “make run” for the demo.',
  emptyNoTwin: 'No data yet',
  emptyNoTags: 'No tags yet',
  emptyNoTagsHint: 'Tags appear when the robot finds or scans them: start its patrol.',
  emptyNoTagsMore: '“lupin-twin demo” shows a simulated patrol.',
  emptyNoPins: 'No tag has a position yet',
  emptyNoPinsHint: 'All tags are listed in the table; a pin appears with the first good scan.',
  emptyNoReading: (sensor: string): string => `No readings on the map yet: ${sensor}`,
  emptyNoReadingHint: 'Choose another sensor, or wait for the robot to scan more tags.',
  emptyNoMap: 'No floor plan yet',
  emptyNoMapMore: 'The robot has not sent its SLAM map, which comes on /map.',

  helpGlobal: 'Anywhere',
  helpMap: 'With the map in focus',
  helpTime: 'With the time bar in focus',
  helpToggle: 'Single-key shortcuts',
  keys: {
    global: [
      ['1 to 9', 'Choose a sensor'],
      ['/', 'Filter the table'],
      ['F', 'Fit the map to view'],
      ['N, P', 'Next and previous tag'],
      ['Y', 'Layers'],
      ['A', 'Alarms'],
      ['C', 'Charts of the chosen tag'],
      ['L', 'Back to live'],
      ['Space', 'Play or pause the past'],
      ['Esc', 'Close, then back to live'],
      ['?', 'This list'],
    ],
    time: [
      ['← →', 'One step back or forward; with Shift ten'],
      ['Page ↑ ↓', 'A tenth of the bar'],
      ['Home', 'Start of the bar'],
      ['End', 'Live'],
    ],
    map: [
      ['← ↑ ↓ →', 'Move; faster with Shift'],
      ['+  −', 'Zoom'],
      ['0', 'Fit to view'],
      ['Enter', 'Open the nearest tag'],
    ],
  },

  paper: (taken: string, printed: string): string => `As of ${taken}, printed ${printed}`,
  paperRest: (printed: number, all: number): string =>
    `The first ${printed} of ${all} tags are printed. The CSV file has all of them.`,
  asOf: (moment: string): string => `as of ${moment}`,
} as const;

/** Past moments, and the time bar. */
export const PAST = {
  past: 'Past',
  pastTitle: (moment: string): string => `${moment} (past) · Lupin twin`,
  pastFetching: (moment: string): string => `Loading ${moment}`,
  pastFetchingHint: 'Nothing is shown until it has loaded.',
  pastFailed: (moment: string): string => `${moment} cannot be shown`,
  pastFuture: 'This moment is in the future.',
  pastNothing: (moment: string): string => `No data for ${moment}`,
  pastReach: (from: string): string => `Recorded data begins at ${from}.`,
  pastReachNothing: 'Nothing has been recorded yet.',
  pastFault: (wanted: string, why: string): string => `${wanted} could not be loaded (${why}).`,
  pastFaultShown: (shown: string): string => `Showing ${shown} while the page retries.`,
  backToLive: 'Back to live',
  backToRecording: 'Back to the recording',
  frozenBehindPast: (clock: string): string => `Live data has stopped. Last data at ${clock}`,
  frozenPastStays: 'The past shown is not affected.',
  meanwhileShow: (tag: string): string => `Back to live, show tag ${tag}`,

  timebar: 'Time bar',
  timebarSlider: 'Time shown',
  timebarPeriod: 'Period',
  timebarPeriods: {
    hour: 'Last hour',
    day: 'Last day',
    week: 'Last week',
    month: 'Last month',
    all: 'All',
    own: 'Custom',
  },
  timebarFrom: 'From',
  timebarTo: 'To',
  timebarOwnHint: 'The start must be before the end',
  timebarOwnSimHint: 'hh:mm:ss since the simulation began',
  timebarPlay: 'Play',
  timebarPause: 'Pause',
  timebarSpeed: 'Playback speed',
  timebarMarks: 'What the marks mean',
  timebarMark: {
    scans: 'upward bar: scans',
    failures: 'downward bar: failed attempts',
    pest: 'solid triangle: pest seen',
    cleared: 'open ring: pest gone',
    silence: 'hatched: no scan attempted',
    before: 'reverse hatching: not recorded, or no longer stored',
    run: 'dashed line: clock set back',
  },
  timebarCounts: (scans: number, failures: number, seen: number, cleared: number): string =>
    [
      counted(scans, 'scan', 'scans'),
      ...(failures > 0 ? [`${failures} failed`] : []),
      ...(seen > 0 ? [counted(seen, 'pest seen', 'pests seen')] : []),
      ...(cleared > 0 ? [counted(cleared, 'pest gone', 'pests gone')] : []),
    ].join(', '),
} as const;
