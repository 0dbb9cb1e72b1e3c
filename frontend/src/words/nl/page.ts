/** De pagina zelf: verbinding, storingen, menu, hulp, wat men meeneemt. */
import type { PAGE as ENGLISH } from '../en/page';
import type { In } from '../shape';
import { counted } from './counted';

export const PAGE: In<typeof ENGLISH> = {
  product: 'Lupin twin',
  subtitle: 'Kas',
  skipToTable: 'Naar de tabel met meetpunten',
  more: 'Meer hierover',

  language: 'Taal',
  languageUnknown: (asked) =>
    `Deze pagina spreekt geen “${asked}”: ze wordt in het Engels getoond.`,
  languageMissing: (name) =>
    `${name} kon niet worden geladen: de pagina wordt in het Engels getoond.`,
  partsLate: 'Een deel van de pagina is niet aangekomen.',
  partsLateHint:
    'Kaarten, lijsten en de tijdbalk komen zodra de server antwoordt; hij wordt steeds opnieuw gevraagd.',

  phase: {
    connecting: 'Verbinden',
    live: 'Live',
    stale: 'Geen signaal',
    offline: 'Tweeling offline',
    reconnecting: 'Opnieuw verbinden',
  },
  phaseLabel: 'Verbinding',
  retryNow: 'Nu proberen',
  nextTry: (seconds) => (seconds > 0 ? `volgende poging over ${seconds} s` : 'wordt nu geprobeerd'),
  frozenSince: (clock) => `De meetwaarden staan stil. Laatste gegevens om ${clock}`,
  agoSuffix: (age) => `${age} geleden`,
  frozenWhy: {
    stale: 'De verbinding is er, maar er komt niets meer door.',
    reconnecting: 'De verbinding met de server is verbroken; de pagina gaat vanzelf weer verder.',
    connecting: 'Wachten op antwoord van de server.',
    live: '',
    offline: 'De server antwoordt, maar de tweeling erachter niet.',
  },
  offlineWhy: {
    live: '',
    paused: '',
    no_clock: 'De tweeling weet nog niet hoe laat het is, en dus niet hoe oud de meetwaarden zijn.',
    clock_stopped:
      'De klok van de tweeling staat stil. Hoe oud de meetwaarden zijn, is niet bekend.',
    clock_doubted:
      'De klok van de tweeling loopt verkeerd. Hoe oud de meetwaarden zijn, is niet bekend.',
    never_seen: 'De server heeft nog van geen tweeling gehoord. Staat hij aan?',
    stale: 'De tweeling laat niets meer horen. Controleer of hij nog draait.',
    thread_dead:
      'De server heeft het contact met de tweeling verloren en moet opnieuw worden gestart.',
    shutting_down: 'De server wordt afgesloten.',
  },
  offlineMore: {
    live: '',
    paused: '',
    no_clock: 'De tweeling draait op gesimuleerde tijd, en op /clock komt niets binnen.',
    clock_stopped: 'De tweeling draait op gesimuleerde tijd, en op /clock komt niets meer binnen.',
    clock_doubted: 'Hij wijst een tijd van vóór de opname aan: zet hem goed.',
    never_seen: 'Tweeling en bridge moeten in hetzelfde ROS-domein draaien (ROS_DOMAIN_ID).',
    stale: 'De bridge draait, maar op /twin/state wordt niets meer gepubliceerd.',
    thread_dead: 'De ROS-thread van de bridge is gestopt; zijn log zegt waarom.',
    shutting_down: '',
  },

  unread: (count) =>
    count === 1
      ? 'Een bericht van de server was onleesbaar en is weggegooid.'
      : `${count} berichten van de server waren onleesbaar en zijn weggegooid.`,
  unreadLast: (why) => `Het laatste: ${why}`,
  paused: 'De tijd staat stil.',
  pausedHint: 'De simulatie of de opname staat stil, en niets wordt ouder.',
  inputProblem: 'De tweeling hoort niet alles wat voor hem wordt gepubliceerd.',
  drops: (count) =>
    `De tweeling heeft de afgelopen minuten ${counted(count, 'bericht', 'berichten')} weggegooid.`,
  dropsLast: (message) => `Het laatste: ${message}`,
  journal: {
    off: {
      title: 'Er wordt niets vastgelegd.',
      hint: 'Na een herstart weet de tweeling niets meer van ervoor.',
    },
    slow: {
      title: 'Het vastleggen loopt achter.',
      hint: 'Wat wacht, wordt geschreven zodra de schijf het weer bijhoudt; bij stroomuitval gaat het verloren.',
    },
    failing: {
      title: 'Het vastleggen mislukt.',
      hint: 'De tweeling gaat door, blijft het proberen en schrijft wat wacht zodra het kan: maak ruimte vrij of kijk de schijf na.',
    },
    upgrading: {
      title: 'De opname van een oudere versie wordt omgezet.',
      hint: 'Wat wordt waargenomen, is te zien en wacht. Wat eerder bekend was, is er weer zodra dat klaar is; dat kan minuten duren.',
    },
    doubting: {
      title: 'Er wordt niets vastgelegd: de klok spreekt de opname tegen.',
      hint: 'Wat wordt waargenomen, is te zien en wacht. Het wordt geschreven zodra de klok klopt, of na tien minuten zoals het is.',
    },
    in_use: {
      title: 'Deze tweeling legt niets vast: een andere doet het al.',
      hint: 'Stop een van beide, of geef deze een eigen bestand.',
    },
    foreign: {
      title: 'Deze tweeling legt niets vast: zijn bestand is van iemand anders.',
      hint: 'Er is niets in veranderd. Geef de tweeling een ander bestand, of verplaats dit.',
    },
  },
  outward: {
    mqtt: 'De domotica (MQTT) krijgt niets door.',
    webhook: 'Alarmen worden niet doorgegeven (webhook).',
  },
  outwardOther: (channel) => `${channel} krijgt niets door.`,
  outwardHint: 'Het wordt steeds opnieuw geprobeerd; deze pagina heeft er geen last van.',
  journalMore:
    'Het bestand staat in de parameter “journal” van de tweeling; “off” legt niets vast.',
  origin: { simulated: 'Gesimuleerd', recorded: 'Opname', sim_time: 'Gesimuleerde tijd' },
  originHint: {
    simulated: 'Hier werkt geen robot: kas, planten en metingen zijn verzonnen.',
    recorded: 'Er wordt een opname afgespeeld: niets hiervan is van nu.',
    sim_time:
      'De tijd is niet die van de klok aan de muur: wat te zien is, komt uit een simulatie of uit een opname die wordt afgespeeld.',
  },
  recordedIs: { playing: 'Speelt af', paused: 'Staat stil' },
  recordedPaused: 'De opname staat stil.',
  recordedPausedHint: 'Ze is gepauzeerd of afgelopen, en niets wordt ouder.',
  simulated: 'Gesimuleerd.',
  simulatedHint: (until) =>
    `Geen robot heeft dit waargenomen: de demo begon met verzonnen dagen tot ${until}.`,
  setAside: 'Een beschadigde opname is opzijgezet.',
  setAsideHint: (name) =>
    `Wat nog leesbaar was, is bewaard, en het vastleggen gaat door. Het oude bestand is ${name}.`,
  failedTitle: 'Deze pagina is vastgelopen',
  failedHint: 'Vertrouw niet op wat ze toont. De tweeling en de server hebben er geen last van.',
  failedAgain: 'Ze wordt vanzelf opnieuw geladen.',
  reload: 'Opnieuw laden',

  menu: 'Menu',
  unit: 'Temperatuur',
  theme: 'Weergave',
  themes: { system: 'Systeem', light: 'Licht', dark: 'Donker' },
  copyLink: 'Link naar deze weergave kopiëren',
  linkCopied: 'Link gekopieerd',
  linkInBar: 'In de adresbalk staat de link naar deze weergave',
  savePng: 'Kaart opslaan als PNG',
  saveCsv: 'Tabel opslaan als CSV',
  saveCsvShort: 'CSV',
  print: 'Afdrukken',
  kiosk: 'Wandscherm',
  kioskLeave: 'Verlaten',
  cycleNext: (sensor, time) => `daarna: ${sensor} over ${time}`,
  cycleRefused: (asked, least, most) =>
    `cycle=${asked} geldt niet: mogelijk is ${least} tot ${most} seconden.`,
  help: 'Sneltoetsen',
  signOut: 'Afmelden',
  signOutFailed: (reason) => `U bent nog aangemeld: ${reason}`,
  exportFailed: (reason) => `Er is niets opgeslagen: ${reason}`,

  emptyConnecting: 'Verbinden met de server',
  emptyConnectingHint: 'De kas verschijnt zodra hij antwoordt.',
  emptyUnreachable: 'De server antwoordt niet',
  emptyUnreachableHint: 'Controleer of hij aanstaat. De pagina blijft het vanzelf proberen.',
  emptyUnreachableMore:
    'De server is de bridge: “lupin-twin serve” op de robot, of “make run” voor de demo.',
  emptyNoTwin: 'Nog geen tweeling',
  emptyNoTags: 'Nog geen meetpunten',
  emptyNoTagsHint:
    'De tweeling draait en wacht. Meetpunten verschijnen zodra de robot er een vindt of uitleest: ' +
    'stuur hem op zijn ronde.',
  emptyNoTagsMore: '“lupin-twin demo” toont een gesimuleerde ronde.',
  emptyNoPins: 'Nog geen meetpunt heeft een positie',
  emptyNoPinsHint:
    'Alle meetpunten staan in de tabel; na de eerste geslaagde meting komen ze op de kaart.',
  emptyNoReading: (sensor) => `Nog geen meetpunt op de kaart heeft een meetwaarde: ${sensor}`,
  emptyNoReadingHint: 'Kies een andere sensor, of wacht tot de robot meer heeft uitgelezen.',
  emptyNoMap: 'Nog geen plattegrond: de robot heeft zijn kaart niet gestuurd.',
  emptyNoMapMore: 'De plattegrond is de SLAM-kaart van de robot, die op /map komt.',

  helpTitle: 'Sneltoetsen',
  helpGlobal: 'Overal',
  helpMap: 'Op de kaart',
  helpTime: 'Op de tijdbalk',
  helpToggle: 'Sneltoetsen van één toets',
  keys: {
    global: [
      ['1 – 9', 'Een sensor kiezen'],
      ['/', 'De tabel filteren'],
      ['F', 'Alles tonen op de kaart'],
      ['N, P', 'Volgend en vorig meetpunt'],
      ['S', 'Kleurenkaart vloeiend'],
      ['Y', 'Lagen'],
      ['A', 'Alarmen'],
      ['C', 'Grafieken van het gekozen meetpunt'],
      ['L', 'Terug naar live'],
      ['Spatie', 'Verleden afspelen of pauzeren'],
      ['U', '°C of °F'],
      ['T', 'Licht of donker'],
      ['Esc', 'Sluiten, daarna terug naar live'],
      ['?', 'Deze lijst'],
    ],
    time: [
      ['← →', 'Een stap terug of verder; met Shift tien'],
      ['Page ↑ ↓', 'Een tiende van de balk'],
      ['Home', 'Naar het begin'],
      ['End', 'Live'],
    ],
    map: [
      ['← ↑ ↓ →', 'Verschuiven; met Shift sneller'],
      ['+  −', 'In- en uitzoomen'],
      ['0', 'Alles tonen'],
      ['Enter', 'Dichtstbijzijnd meetpunt openen'],
    ],
  },

  paper: (taken, printed) => `Stand van ${taken}, afgedrukt ${printed}`,
  paperRest: (printed, all) =>
    `Afgedrukt zijn de eerste ${printed} van ${all} meetpunten. De tabel als CSV bevat ze allemaal.`,
  paperRange: (sensor, range) => `${sensor} ${range}`,
  fileName: (kind, stamp) => `lupin-twin-${kind}-${stamp}`,
  asOf: (moment) => `stand van ${moment}`,
};
