/** De pagina zelf: verbinding, storingen, menu, hulp, wat men meeneemt. */
import type * as EN from '../en/page';
import type { In } from '../shape';
import { counted } from './counted';

export const PAGE: In<typeof EN.PAGE> = {
  product: 'Lupin twin',
  subtitle: 'Kas',
  skipToTable: 'Naar de tabel met meetpunten',
  more: 'Meer hierover',

  language: 'Taal',
  languageMissing: (name) => `${name} kon niet worden geladen: u ziet de Engelse versie.`,
  partsLate: 'Een deel van de pagina is niet geladen.',
  partsLateHint:
    'Details, lijsten en de tijdbalk verschijnen zodra de server antwoordt. De pagina blijft het proberen.',

  phase: {
    connecting: 'Verbinden',
    live: 'Live',
    stale: 'Geen signaal',
    offline: 'Twin offline',
    noTime: 'Tijd onbekend',
    reconnecting: 'Opnieuw verbinden',
  },
  phaseLabel: 'Verbinding',
  retryNow: 'Nu proberen',
  frozenSince: (clock) => `Laatste gegevens om ${clock}`,
  agoSuffix: (age) => `${age} geleden`,
  hours: 'u',
  frozenWhy: {
    stale: 'De verbinding is er, maar er komen geen gegevens binnen.',
    reconnecting: 'Geen verbinding met de server.',
    connecting: 'Wachten op antwoord van de server.',
    offline: 'De server antwoordt, maar de digital twin niet.',
  },
  clockTodo: {
    no_clock: 'Start de simulatie of de opname.',
    clock_stopped: 'Controleer de simulatie of de opname.',
    clock_doubted: 'Zet de klok van de digital twin gelijk.',
  },
  offlineWhy: {
    no_clock:
      'Daar haalt de digital twin zijn tijd vandaan, maar die is er nog niet. Hoe oud de meetwaarden zijn, is onbekend.',
    clock_stopped:
      'Daar haalt de digital twin zijn tijd vandaan, maar die staat stil. Hoe oud de meetwaarden zijn, is onbekend.',
    clock_doubted:
      'Die loopt achter op de vastgelegde gegevens. Tot de klok gelijk is gezet, hooguit tien minuten, is onbekend hoe oud de meetwaarden zijn en wordt er niets vastgelegd.',
    clock_ahead: 'Die loopt voor op het archief; hoe oud de meetwaarden zijn, is onbekend.',
    never_seen:
      'De server heeft nog niets van een digital twin ontvangen. Staat de digital twin aan?',
    stale: 'De digital twin stuurt niets meer. Controleer of hij draait.',
    thread_dead:
      'De server heeft het contact met de digital twin verloren en moet opnieuw worden gestart.',
    shutting_down: 'De server wordt afgesloten.',
  },
  offlineMore: {
    no_clock: 'De digital twin draait op gesimuleerde tijd, en op /clock komt niets binnen.',
    clock_stopped:
      'De digital twin draait op gesimuleerde tijd, en op /clock komt niets meer binnen.',
    never_seen: 'Digital twin en bridge moeten in hetzelfde ROS-domein draaien (ROS_DOMAIN_ID).',
    stale: 'De bridge draait, maar op /twin/state wordt niets meer gepubliceerd.',
    thread_dead: 'De ROS-thread van de bridge is gestopt; zijn log zegt waarom.',
  },

  serverBusy: 'Server overbelast of niet bereikbaar',
  unread: (count) =>
    count === 1
      ? 'Een bericht van de server was onleesbaar en is genegeerd.'
      : `${count} berichten van de server waren onleesbaar en zijn genegeerd.`,
  paused: 'De tijd staat stil.',
  pausedHint: 'De simulatie of opname is gepauzeerd; de meetwaarden worden niet ouder.',
  mixture:
    'Meer dan één digital twin stuurt gegevens. De pagina toont ze door elkaar: stop alle op één na.',
  inputProblem: 'Een deel van de gegevens komt niet aan.',
  drops: (count) =>
    `De digital twin heeft de afgelopen minuten ${counted(count, 'bericht', 'berichten')} niet verwerkt.`,
  journal: {
    off: {
      title: 'Het vastleggen staat uit.',
      hint: 'Na een herstart zijn alle eerdere gegevens weg.',
    },
    slow: {
      title: 'Het vastleggen loopt achter.',
      hint: 'Gegevens wachten in het geheugen tot de schijf weer bij is. Bij stroomuitval gaan ze verloren.',
    },
    failing: {
      title: 'Het vastleggen mislukt.',
      hint: 'De digital twin draait door. Is de schijf vol, maak dan ruimte vrij; is hij alleen-lezen, maak hem dan beschrijfbaar. Het vastleggen gaat vanzelf verder.',
    },
    upgrading: {
      title: 'De gegevens van een oudere versie worden omgezet.',
      hint: 'Nieuwe gegevens worden getoond, maar nog niet vastgelegd. Eerdere gegevens zijn er weer na het omzetten; dat kan enkele minuten duren.',
    },
    in_use: {
      title: 'Deze digital twin legt niets vast: een andere gebruikt zijn bestand.',
      hint: 'Stop een van beide, of geef deze een eigen bestand.',
    },
    foreign: {
      title: 'Deze digital twin legt niets vast: hij kan zijn bestand niet lezen.',
      hint: 'Er is niets in veranderd. Geef de digital twin een ander bestand, of verplaats dit.',
    },
  },
  notificationChannels: {
    mqtt: 'De domotica (MQTT) ontvangt geen gegevens.',
    webhook: 'De webhook ontvangt geen alarmen.',
    push: 'Telefoons ontvangen geen alarmen.',
  },
  notificationOther: (channel) => `${channel} ontvangt geen gegevens.`,
  notificationHint: 'De server blijft het proberen. Deze pagina heeft er geen last van.',
  journalMore:
    'Het bestand staat in de parameter “journal” van de digital twin; “off” legt niets vast.',
  origin: { simulated: 'Gesimuleerd', recorded: 'Opgenomen', sim_time: 'Gesimuleerde tijd' },
  originDay: (length: string): string => `1 kasdag = ${length}`,
  originHint: {
    simulated: 'Geen echte robot: kas, planten en metingen zijn gesimuleerd.',
    recorded: 'Er wordt een opname afgespeeld: niets hiervan is live.',
    sim_time: 'Dit is niet de echte tijd: de gegevens komen uit een simulatie of een opname.',
  },
  recordedIs: { playing: 'Speelt af', paused: 'Gepauzeerd' },
  recordedPaused: 'De opname is gepauzeerd.',
  recordedPausedHint: 'Gepauzeerd of afgelopen; de meetwaarden worden niet ouder.',
  simulated: 'Gesimuleerd.',
  simulatedHint: (until) => `Alle gegevens tot ${until} zijn demogegevens, niet gemeten.`,
  quarantined: 'Een beschadigd bestand is in quarantaine gezet.',
  quarantinedHint: (name) =>
    `Leesbare gegevens zijn bewaard en het vastleggen gaat door. Het beschadigde bestand is ${name}.`,
  failedTitle: 'Deze pagina is vastgelopen',
  failedHint:
    'Vertrouw niet op wat u hier ziet. De digital twin en de server hebben er geen last van. De pagina laadt vanzelf opnieuw.',
  reload: 'Opnieuw laden',

  menu: 'Menu',
  unit: 'Temperatuur',
  theme: 'Weergave',
  themes: { system: 'Systeem', light: 'Licht', dark: 'Donker' },
  savePng: 'Kaart opslaan als PNG',
  saveCsv: 'Tabel opslaan als CSV',
  saveCsvShort: 'CSV',
  report: 'Dienstrapport',
  print: 'Afdrukken',
  kiosk: 'Wandscherm',
  kioskLeave: 'Verlaten',
  help: 'Sneltoetsen',
  signOut: 'Afmelden',
  signOutFailed: (reason) => `U bent nog aangemeld: ${reason}`,
  exportFailed: (reason) => `Er is niets opgeslagen: ${reason}`,

  emptyConnecting: 'Verbinden met de server',
  emptyConnectingHint: 'De kas verschijnt zodra hij antwoordt.',
  emptyUnreachable: 'De server antwoordt niet',
  emptyUnreachableHint: 'Controleer of hij aanstaat. De pagina blijft het proberen.',
  emptyUnreachableMore:
    'De server is de bridge: “lupin-twin serve” op de robot, of “make run” voor de demo.',
  emptyNoTwin: 'Nog geen gegevens',
  emptyNoTags: 'Nog geen meetpunten',
  emptyNoTagsHint: 'Meetpunten verschijnen zodra de robot ze vindt of meet: start zijn ronde.',
  emptyNoTagsMore: '“lupin-twin demo” toont een gesimuleerde ronde.',
  emptyNoPins: 'Nog geen meetpunt heeft een positie',
  emptyNoPinsHint:
    'Alle meetpunten staan in de tabel; na de eerste goede meting komen ze op de kaart.',
  emptyNoReading: (sensor) => `Nog geen meetwaarden op de kaart: ${sensor}`,
  emptyNoReadingHint: 'Kies een andere sensor, of wacht tot de robot meer heeft gemeten.',
  emptyNoMap: 'Nog geen plattegrond',
  emptyNoMapMore: 'De robot heeft zijn SLAM-kaart, die op /map komt, nog niet gestuurd.',

  helpGlobal: 'Overal',
  helpMap: 'Op de kaart',
  helpTime: 'Op de tijdbalk',
  helpToggle: 'Sneltoetsen met één toets',
  keys: {
    global: [
      ['1 tot 9', 'Een sensor kiezen'],
      ['/', 'De tabel filteren'],
      ['F', 'Alles tonen op de kaart'],
      ['N, P', 'Volgend en vorig meetpunt'],
      ['Y', 'Lagen'],
      ['A', 'Alarmen'],
      ['C', 'Grafieken van het gekozen meetpunt'],
      ['L', 'Naar live'],
      ['Spatie', 'Terugblik afspelen of pauzeren'],
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
      ['← ↑ ↓ →', 'Verschuiven; sneller met Shift'],
      ['+  −', 'In- en uitzoomen'],
      ['0', 'Alles tonen'],
      ['Enter', 'Dichtstbijzijnd meetpunt openen'],
    ],
  },

  paper: (taken, printed) => `Stand van ${taken}, afgedrukt ${printed}`,
  paperRest: (printed, all) =>
    `De eerste ${printed} van ${all} meetpunten zijn afgedrukt. Het CSV-bestand bevat ze allemaal.`,
  asOf: (moment) => `stand van ${moment}`,
};

/** Een ander moment dan nu, en de tijdbalk. */
export const PAST: In<typeof EN.PAST> = {
  past: 'Terugblik',
  pastTitle: (moment) => `${moment} (terugblik) · Lupin twin`,
  pastFetching: (moment) => `${moment} wordt geladen`,
  pastFetchingHint: 'Tot het geladen is, wordt niets getoond.',
  pastFailed: (moment) => `${moment} kan niet worden getoond`,
  pastFuture: 'Dit moment ligt in de toekomst.',
  pastNothing: (moment) => `Geen gegevens van ${moment}`,
  pastReach: (from) => `Er zijn vastgelegde gegevens vanaf ${from}.`,
  pastReachNothing: 'Er is nog niets vastgelegd.',
  pastFault: (wanted, why) => `${wanted} kon niet worden geladen (${why}).`,
  pastFaultShown: (shown) => `Getoond wordt ${shown}; de pagina blijft het proberen.`,
  backToLive: 'Naar live',
  backToRecording: 'Terug naar de opname',
  frozenBehindPast: (clock) => `Geen live gegevens meer. Laatste gegevens om ${clock}`,
  frozenPastStays: 'De terugblik heeft er geen last van.',
  meanwhileShow: (tag) => `Naar live, naar meetpunt ${tag}`,

  timebar: 'Tijdbalk',
  timebarSlider: 'Getoonde tijd',
  timebarPeriod: 'Periode',
  timebarPeriods: {
    hour: 'Afgelopen uur',
    day: 'Afgelopen dag',
    week: 'Afgelopen week',
    month: 'Afgelopen maand',
    all: 'Alles',
    own: 'Aangepast',
  },
  timebarFrom: 'Van',
  timebarTo: 'Tot',
  timebarOwnHint: 'Het begin moet vóór het einde liggen',
  timebarOwnSimHint: 'uu:mm:ss sinds het begin van de simulatie',
  timebarPlay: 'Afspelen',
  timebarPause: 'Pauzeren',
  timebarSpeed: 'Afspeelsnelheid',
  timebarMarks: 'Verklaring van de tekens',
  timebarMark: {
    scans: 'balk omhoog: metingen',
    failures: 'balk omlaag: mislukte pogingen',
    pest: 'gevulde driehoek: plaag gezien',
    cleared: 'lege ring: weer plaagvrij',
    silence: 'gearceerd: geen meetpoging',
    before: 'andersom gearceerd: niet vastgelegd of niet meer bewaard',
    run: 'streepjeslijn: klok teruggezet',
  },
  timebarCounts: (scans, failures, seen, cleared) =>
    [
      counted(scans, 'meting', 'metingen'),
      ...(failures > 0 ? [`${failures} mislukt`] : []),
      ...(seen > 0 ? [counted(seen, 'plaag gezien', 'plagen gezien')] : []),
      ...(cleared > 0 ? [`${cleared} weer plaagvrij`] : []),
    ].join(', '),
};
