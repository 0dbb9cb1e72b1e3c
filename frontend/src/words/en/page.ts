/** The page itself: connection, troubles, menu, help, what is taken away. */
import { counted } from './counted';

export const PAGE = {
  product: 'Lupin twin',
  subtitle: 'Greenhouse',
  skipToTable: 'Skip to the table of tags',
  more: 'More about this',

  language: 'Language',
  languageUnknown: (asked: string): string =>
    `The page does not speak “${asked}”: it is shown in English.`,
  languageMissing: (name: string): string =>
    `${name} could not be loaded: the page is shown in English.`,
  partsLate: 'Part of the page has not arrived.',
  partsLateHint:
    'Cards, lists and the time bar come as soon as the server answers; it is asked again and again.',

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
    reconnecting: 'The connection to the server is lost; the page resumes by itself.',
    connecting: 'Waiting for the server to answer.',
    live: '',
    offline: 'The server answers, but the twin behind it does not.',
  },
  offlineWhy: {
    live: '',
    paused: '',
    no_clock: 'The twin does not know the time yet, and so not how old the readings are.',
    clock_stopped: 'The twin’s clock has stopped. How old the readings are is not known.',
    clock_doubted: 'The twin’s clock is wrong. How old the readings are is not known.',
    never_seen: 'The server has not heard from any twin yet. Is it switched on?',
    stale: 'The twin has fallen silent. Check that it still runs.',
    thread_dead: 'The server has lost touch with the twin and has to be restarted.',
    shutting_down: 'The server is shutting down.',
  },
  /** For whoever looks after the machines; empty: there is nothing to add. */
  offlineMore: {
    live: '',
    paused: '',
    no_clock: 'The twin runs with simulated time, and nothing comes on /clock.',
    clock_stopped: 'The twin runs with simulated time, and nothing comes on /clock any more.',
    clock_doubted: 'It is earlier than what is recorded: set it.',
    never_seen: 'Twin and bridge have to run in the same ROS domain (ROS_DOMAIN_ID).',
    stale: 'The bridge runs, but nothing is published on /twin/state any more.',
    thread_dead: 'The bridge’s ROS thread has ended; its log says why.',
    shutting_down: '',
  },

  unread: (count: number): string =>
    count === 1
      ? 'A message from the server could not be read and was dropped.'
      : `${count} messages from the server could not be read and were dropped.`,
  unreadLast: (why: string): string => `The last: ${why}`,
  paused: 'Time is paused.',
  pausedHint: 'The simulation, or the recording, stands still, and so do all ages.',
  inputProblem: 'The twin does not hear all that is published for it.',
  drops: (count: number): string =>
    `The twin dropped ${counted(count, 'message', 'messages')} in the last minutes.`,
  dropsLast: (message: string): string => `The last: ${message}`,
  /** What to tell of a journal that does not keep what happens, and what to do. */
  journal: {
    off: {
      title: 'Nothing is recorded.',
      hint: 'After a restart the twin knows nothing of before.',
    },
    slow: {
      title: 'The recording lags behind.',
      hint: 'What waits is written as the disk keeps up again; a power cut would lose it.',
    },
    failing: {
      title: 'Nothing is being recorded.',
      hint: 'The twin goes on, tries again and again, and writes what waits once it can: make room, or see to the disk.',
    },
    upgrading: {
      title: 'The recording of an older version is being upgraded.',
      hint: 'What is observed is shown and waits. What was known before is there as soon as that is done; it may take minutes.',
    },
    doubting: {
      title: 'Nothing is being recorded: the clock contradicts the recording.',
      hint: 'What is observed is shown and waits. It is written once the clock is right, or after ten minutes as it is.',
    },
    in_use: {
      title: 'This twin does not record: another one does.',
      hint: 'Stop one of them, or give this one a file of its own.',
    },
    foreign: {
      title: "This twin does not record: its file is somebody else's.",
      hint: 'Nothing in it was changed. Give the twin another file, or move this one.',
    },
  },
  /** What to tell of a channel by which others are told, and are not. */
  outward: {
    mqtt: 'Home automation (MQTT) is not being told.',
    webhook: 'Alarms are not being passed on (webhook).',
  },
  outwardOther: (channel: string): string => `${channel} is not being told.`,
  outwardHint: 'It is tried again and again; this page is not affected.',
  journalMore: 'The file is named by the twin’s parameter “journal”; “off” records nothing.',
  /** What the twin observes where that is no robot's, or not of now. */
  origin: { simulated: 'Simulated', recorded: 'Recording', sim_time: 'Simulated time' },
  originHint: {
    simulated: 'No robot is at work: greenhouse, plants and readings are made up.',
    recorded: 'A recording is being played: nothing here is of now.',
    sim_time:
      'The time is not that of the clock on the wall: what is shown comes from a simulation, or from a recording that is played.',
  },
  recordedIs: { playing: 'Playing', paused: 'Stands still' },
  recordedPaused: 'The recording stands still.',
  recordedPausedHint: 'It is paused or has come to its end, and no age goes on.',
  simulated: 'Simulated.',
  simulatedHint: (until: string): string =>
    `No robot observed this: the demo began with days made up until ${until}.`,
  setAside: 'A damaged recording was set aside.',
  setAsideHint: (name: string): string =>
    `What could be read of it was kept, and recording goes on. The old file is ${name}.`,
  failedTitle: 'The page has failed',
  failedHint: 'What it shows is not to be relied on. The twin and the server are not affected.',
  failedAgain: 'It is loaded anew by itself.',
  reload: 'Reload',

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
  kioskLeave: 'Leave',
  cycleNext: (sensor: string, time: string): string => `next: ${sensor} in ${time}`,
  cycleRefused: (asked: string, least: number, most: number): string =>
    `cycle=${asked} is not in use: it takes ${least} to ${most} seconds.`,
  help: 'Keyboard shortcuts',
  signOut: 'Sign out',
  signOutFailed: (reason: string): string => `You are still signed in: ${reason}`,
  exportFailed: (reason: string): string => `Nothing was saved: ${reason}`,

  emptyConnecting: 'Connecting to the server',
  emptyConnectingHint: 'The greenhouse appears as soon as it answers.',
  emptyUnreachable: 'The server does not answer',
  emptyUnreachableHint: 'Check that it is switched on. The page keeps trying by itself.',
  emptyUnreachableMore:
    'The server is the bridge: “lupin-twin serve” on the robot, or “make run” for the demo.',
  emptyNoTwin: 'No twin yet',
  emptyNoTags: 'No tags yet',
  emptyNoTagsHint:
    'The twin is running and waits. Tags appear when the robot finds or scans one: send it on ' +
    'its round.',
  emptyNoTagsMore: '“lupin-twin demo” shows a simulated patrol.',
  emptyNoPins: 'No tag has a position yet',
  emptyNoPinsHint: 'All tags are listed in the table; a pin appears with the first good scan.',
  emptyNoReading: (sensor: string): string => `No pinned tag has a reading of ${sensor} yet`,
  emptyNoReadingHint: 'Choose another sensor, or wait for the robot to scan more tags.',
  emptyNoMap: 'No floor plan yet: the robot has not sent its map.',
  emptyNoMapMore: 'The floor plan is the robot’s SLAM map, which comes on /map.',

  helpTitle: 'Keyboard shortcuts',
  helpGlobal: 'Anywhere',
  helpMap: 'With the map in focus',
  helpTime: 'With the time bar in focus',
  helpToggle: 'Single-key shortcuts',
  keys: {
    global: [
      ['1 – 9', 'Choose a sensor'],
      ['/', 'Filter the table'],
      ['F', 'Show everything on the map'],
      ['N, P', 'Next and previous tag'],
      ['S', 'Smooth the heat map'],
      ['Y', 'Layers'],
      ['A', 'Alarms'],
      ['C', 'Charts of the chosen tag'],
      ['L', 'Back to live'],
      ['Space', 'Play the past, or pause'],
      ['U', '°C or °F'],
      ['T', 'Light or dark'],
      ['Esc', 'Close, then back to live'],
      ['?', 'This list'],
    ],
    time: [
      ['← →', 'A step back or on; with Shift ten'],
      ['Page ↑ ↓', 'A tenth of the bar'],
      ['Home', 'The beginning'],
      ['End', 'Live'],
    ],
    map: [
      ['← ↑ ↓ →', 'Move; with Shift faster'],
      ['+  −', 'Zoom'],
      ['0', 'Show everything'],
      ['Enter', 'Open the nearest tag'],
    ],
  },

  paper: (taken: string, printed: string): string => `As of ${taken}, printed ${printed}`,
  paperRest: (printed: number, all: number): string =>
    `Printed are the first ${printed} of ${all} tags. The table as CSV has all of them.`,
  paperRange: (sensor: string, range: string): string => `${sensor} ${range}`,
  fileName: (kind: string, stamp: string): string => `lupin-twin-${kind}-${stamp}`,
  asOf: (moment: string): string => `as of ${moment}`,
} as const;
