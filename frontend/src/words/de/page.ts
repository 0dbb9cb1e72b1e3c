/** Die Seite selbst: Verbindung, Störungen, Menü, Hilfe, was man mitnimmt. */
import type * as EN from '../en/page';
import type { In } from '../shape';
import { counted } from './counted';

export const PAGE: In<typeof EN.PAGE> = {
  product: 'Lupin twin',
  subtitle: 'Gewächshaus',
  skipToTable: 'Zur Tabelle der Messpunkte springen',
  more: 'Mehr dazu',

  language: 'Sprache',
  languageMissing: (name) =>
    `${name} konnte nicht geladen werden: Die Seite wird auf Englisch angezeigt.`,
  partsLate: 'Ein Teil der Seite ist nicht geladen.',
  partsLateHint:
    'Details, Listen und Zeitleiste erscheinen, sobald der Server antwortet. Die Seite versucht es weiter.',

  phase: {
    connecting: 'Verbindet',
    live: 'Live',
    stale: 'Kein Signal',
    offline: 'Zwilling offline',
    noTime: 'Zeit unbekannt',
    reconnecting: 'Verbindet neu',
  },
  phaseLabel: 'Verbindung',
  retryNow: 'Jetzt versuchen',
  frozenSince: (clock) => `Letzte Daten um ${clock}`,
  agoSuffix: (age) => `vor ${age}`,
  hours: 'h',
  frozenWhy: {
    stale: 'Die Verbindung besteht, aber es kommt nichts mehr an.',
    reconnecting: 'Keine Verbindung zum Server.',
    connecting: 'Warten auf Antwort des Servers.',
    offline: 'Der Server antwortet, der Zwilling aber nicht.',
  },
  clockTodo: {
    no_clock: 'Bitte die Simulation oder Aufzeichnung starten.',
    clock_stopped: 'Bitte die Simulation oder Aufzeichnung prüfen.',
    clock_doubted: 'Bitte die Uhr des Zwillings stellen.',
  },
  offlineWhy: {
    no_clock:
      'Von dort bekommt der Zwilling seine Zeit; noch fehlt sie. Das Alter der Werte ist unbekannt.',
    clock_stopped:
      'Von dort bekommt der Zwilling seine Zeit; sie steht still. Das Alter der Werte ist unbekannt.',
    clock_doubted:
      'Sie geht gegenüber der Aufzeichnung nach. Bis sie gestellt ist, höchstens zehn Minuten lang, ist das Alter der Werte unbekannt, und nichts wird aufgezeichnet.',
    clock_ahead: 'Sie geht gegenüber dem Archiv vor; das Alter der Werte ist unbekannt.',
    never_seen:
      'Der Server hat noch keine Daten von einem Zwilling. Ist der Zwilling eingeschaltet?',
    stale: 'Der Zwilling sendet nicht mehr. Bitte prüfen, ob er läuft.',
    thread_dead: 'Der Server hat den Kontakt zum Zwilling verloren und muss neu gestartet werden.',
    shutting_down: 'Der Server wird heruntergefahren.',
  },
  offlineMore: {
    no_clock: 'Der Zwilling läuft mit simulierter Zeit, und auf /clock kommt nichts.',
    clock_stopped: 'Der Zwilling läuft mit simulierter Zeit, und auf /clock kommt nichts mehr.',
    never_seen: 'Zwilling und Bridge müssen in derselben ROS-Domain laufen (ROS_DOMAIN_ID).',
    stale: 'Die Bridge läuft, aber auf /twin/state wird nichts mehr veröffentlicht.',
    thread_dead: 'Der ROS-Thread der Bridge ist beendet; warum, steht in ihrem Log.',
  },

  serverBusy: 'Server überlastet oder nicht erreichbar',
  unread: (count) =>
    count === 1
      ? 'Eine Nachricht vom Server war nicht lesbar und wurde verworfen.'
      : `${count} Nachrichten vom Server waren nicht lesbar und wurden verworfen.`,
  paused: 'Die Zeit ist angehalten.',
  pausedHint: 'Simulation oder Aufzeichnung sind angehalten; die Messwerte altern nicht.',
  mixture:
    'Mehr als ein Zwilling sendet. Die Seite zeigt ein Gemisch: Bitte alle bis auf einen beenden.',
  inputProblem: 'Ein Teil der Daten kommt nicht an.',
  drops: (count) =>
    `Der Zwilling hat in den letzten Minuten ${counted(count, 'Nachricht', 'Nachrichten')} verworfen.`,
  journal: {
    off: {
      title: 'Die Aufzeichnung ist aus.',
      hint: 'Nach einem Neustart sind alle früheren Daten verloren.',
    },
    slow: {
      title: 'Die Aufzeichnung kommt nicht nach.',
      hint: 'Daten warten im Speicher, bis der Datenträger nachkommt. Bei Stromausfall gehen sie verloren.',
    },
    failing: {
      title: 'Die Aufzeichnung schlägt fehl.',
      hint: 'Der Zwilling läuft weiter. Ist der Datenträger voll, bitte Platz schaffen; ist er schreibgeschützt, bitte freigeben. Dann wird wieder aufgezeichnet.',
    },
    upgrading: {
      title: 'Die Aufzeichnung einer älteren Version wird umgestellt.',
      hint: 'Neue Daten werden angezeigt, aber noch nicht aufgezeichnet. Frühere Daten sind danach wieder da; das kann Minuten dauern.',
    },
    in_use: {
      title: 'Dieser Zwilling zeichnet nicht auf: Ein anderer nutzt seine Datei.',
      hint: 'Bitte einen der beiden beenden oder diesem eine eigene Datei geben.',
    },
    foreign: {
      title: 'Dieser Zwilling zeichnet nicht auf: Er kann seine Datei nicht lesen.',
      hint: 'Darin wurde nichts verändert. Bitte dem Zwilling eine andere Datei geben oder diese verschieben.',
    },
  },
  notificationChannels: {
    mqtt: 'Die Hausautomation (MQTT) empfängt keine Daten.',
    webhook: 'Der Webhook empfängt keine Alarme.',
    push: 'Handys erhalten keine Alarme.',
  },
  notificationOther: (channel) => `${channel} empfängt keine Daten.`,
  notificationHint: 'Der Server versucht es weiter. Diese Seite ist nicht betroffen.',
  journalMore: 'Die Datei nennt der Parameter „journal“ des Zwillings; „off“ zeichnet nichts auf.',
  origin: { simulated: 'Simuliert', recorded: 'Aufgezeichnet', sim_time: 'Simulierte Zeit' },
  originDay: (length: string): string => `1 Gewächshaustag = ${length}`,
  originHint: {
    simulated: 'Kein echter Roboter: Gewächshaus, Pflanzen und Messwerte sind simuliert.',
    recorded: 'Eine Aufzeichnung wird abgespielt: Nichts davon ist live.',
    sim_time:
      'Das ist nicht die wirkliche Zeit: Die Daten stammen aus einer Simulation oder einer Aufzeichnung.',
  },
  recordedIs: { playing: 'Läuft', paused: 'Angehalten' },
  recordedPaused: 'Die Aufzeichnung ist angehalten.',
  recordedPausedHint: 'Sie ist angehalten oder zu Ende; die Messwerte altern nicht.',
  simulated: 'Simuliert.',
  simulatedHint: (until) => `Alle Daten bis ${until} sind Demodaten, nicht gemessen.`,
  quarantined: 'Eine beschädigte Aufzeichnung wurde in Quarantäne genommen.',
  quarantinedHint: (name) =>
    `Lesbare Daten wurden übernommen, die Aufzeichnung läuft weiter. Die beschädigte Datei ist ${name}.`,
  failedTitle: 'Diese Seite ist abgestürzt',
  failedHint:
    'Bitte nicht auf die Anzeige verlassen. Zwilling und Server sind nicht betroffen. Die Seite lädt sich von selbst neu.',
  reload: 'Neu laden',

  menu: 'Menü',
  unit: 'Temperatur',
  theme: 'Darstellung',
  themes: { system: 'System', light: 'Hell', dark: 'Dunkel' },
  savePng: 'Karte als PNG speichern',
  saveCsv: 'Tabelle als CSV speichern',
  saveCsvShort: 'CSV',
  report: 'Schichtbericht',
  print: 'Drucken',
  kiosk: 'Wandanzeige',
  kioskLeave: 'Beenden',
  help: 'Tastenkürzel',
  signOut: 'Abmelden',
  signOutFailed: (reason) => `Abmelden fehlgeschlagen: ${reason}`,
  exportFailed: (reason) => `Es wurde nichts gespeichert: ${reason}`,

  emptyConnecting: 'Verbindung zum Server wird aufgebaut',
  emptyConnectingHint: 'Das Gewächshaus erscheint, sobald er antwortet.',
  emptyUnreachable: 'Der Server antwortet nicht',
  emptyUnreachableHint: 'Bitte prüfen, ob er eingeschaltet ist. Die Seite versucht es weiter.',
  emptyUnreachableMore:
    'Der Server ist die Bridge: „lupin-twin serve“ auf dem Roboter oder „make run“ für die Demo.',
  emptyNoTwin: 'Noch keine Daten',
  emptyNoTags: 'Noch keine Messpunkte',
  emptyNoTagsHint:
    'Messpunkte erscheinen, sobald der Roboter sie findet oder misst: Bitte seine Runde starten.',
  emptyNoTagsMore: '„lupin-twin demo“ zeigt eine simulierte Runde.',
  emptyNoPins: 'Noch kein Messpunkt hat eine Position',
  emptyNoPinsHint:
    'Alle Messpunkte stehen in der Tabelle; mit der ersten guten Messung kommen sie auf die Karte.',
  emptyNoReading: (sensor) => `Noch keine Messwerte auf der Karte: ${sensor}`,
  emptyNoReadingHint:
    'Bitte einen anderen Sensor wählen oder warten, bis der Roboter mehr gemessen hat.',
  emptyNoMap: 'Noch kein Grundriss',
  emptyNoMapMore: 'Der Roboter hat seine SLAM-Karte, die auf /map kommt, noch nicht geschickt.',

  helpGlobal: 'Überall',
  helpMap: 'Auf der Karte',
  helpTime: 'Auf der Zeitleiste',
  helpToggle: 'Kürzel mit nur einer Taste',
  keys: {
    global: [
      ['1 bis 9', 'Sensor wählen'],
      ['/', 'Tabelle filtern'],
      ['F', 'Auf der Karte alles anzeigen'],
      ['N, P', 'Nächster und voriger Messpunkt'],
      ['Y', 'Ebenen'],
      ['A', 'Alarme'],
      ['C', 'Verlauf des gewählten Messpunkts'],
      ['L', 'Zurück zu Live'],
      ['Leertaste', 'Rückblick abspielen oder anhalten'],
      ['Esc', 'Schließen, dann zurück zu Live'],
      ['?', 'Diese Liste'],
    ],
    time: [
      ['← →', 'Einen Schritt zurück oder vor; mit Umschalt zehn'],
      ['Bild ↑ ↓', 'Ein Zehntel der Leiste'],
      ['Pos1', 'Zum Anfang'],
      ['Ende', 'Live'],
    ],
    map: [
      ['← ↑ ↓ →', 'Verschieben; schneller mit Umschalt'],
      ['+  −', 'Vergrößern, verkleinern'],
      ['0', 'Alles anzeigen'],
      ['Eingabe', 'Nächstgelegenen Messpunkt öffnen'],
    ],
  },

  paper: (taken, printed) => `Stand ${taken}, gedruckt ${printed}`,
  paperRest: (printed, all) =>
    `Gedruckt sind die ersten ${printed} von ${all} Messpunkten. Die CSV-Datei enthält alle.`,
  asOf: (moment) => `Stand ${moment}`,
};

/** Ein anderer Zeitpunkt als jetzt, und die Zeitleiste. */
export const PAST: In<typeof EN.PAST> = {
  past: 'Rückblick',
  pastTitle: (moment) => `${moment} (Rückblick) · Lupin twin`,
  pastFetching: (moment) => `${moment} wird geladen`,
  pastFetchingHint: 'Bis dahin wird nichts angezeigt.',
  pastFailed: (moment) => `${moment} kann nicht angezeigt werden`,
  pastFuture: 'Dieser Zeitpunkt liegt in der Zukunft.',
  pastNothing: (moment) => `Keine Daten für ${moment}`,
  pastReach: (from) => `Aufzeichnung ab ${from}.`,
  pastReachNothing: 'Noch ist nichts aufgezeichnet.',
  pastFault: (wanted, why) => `${wanted} konnte nicht geladen werden (${why}).`,
  pastFaultShown: (shown) => `Angezeigt wird ${shown}; die Seite versucht es weiter.`,
  backToLive: 'Zurück zu Live',
  backToRecording: 'Zurück zur Aufzeichnung',
  frozenBehindPast: (clock) => `Keine Live-Daten mehr. Letzte Daten um ${clock}`,
  frozenPastStays: 'Der Rückblick ist nicht betroffen.',
  meanwhileShow: (tag) => `Zurück zu Live, zu Messpunkt ${tag}`,

  timebar: 'Zeitleiste',
  timebarSlider: 'Angezeigte Zeit',
  timebarPeriod: 'Zeitraum',
  timebarPeriods: {
    hour: 'Letzte Stunde',
    day: 'Letzter Tag',
    week: 'Letzte Woche',
    month: 'Letzter Monat',
    all: 'Alles',
    own: 'Eigener Zeitraum',
  },
  timebarFrom: 'Von',
  timebarTo: 'Bis',
  timebarOwnHint: 'Der Anfang muss vor dem Ende liegen',
  timebarOwnSimHint: 'hh:mm:ss seit Beginn der Simulation',
  timebarPlay: 'Abspielen',
  timebarPause: 'Anhalten',
  timebarSpeed: 'Geschwindigkeit',
  timebarMarks: 'Zeichenerklärung',
  timebarMark: {
    scans: 'Balken nach oben: Messungen',
    failures: 'Balken nach unten: fehlgeschlagene Versuche',
    pest: 'gefülltes Dreieck: Schädlinge gefunden',
    cleared: 'leerer Ring: wieder befallsfrei',
    silence: 'schraffiert: kein Messversuch',
    before: 'gegenläufig schraffiert: nicht aufgezeichnet oder nicht mehr gespeichert',
    run: 'gestrichelte Linie: Uhr zurückgesetzt',
  },
  timebarCounts: (scans, failures, seen, cleared) =>
    [
      counted(scans, 'Messung', 'Messungen'),
      ...(failures > 0 ? [`${failures} fehlgeschlagen`] : []),
      ...(seen > 0 ? [counted(seen, 'Schädlingsfund', 'Schädlingsfunde')] : []),
      ...(cleared > 0 ? [`${cleared} wieder befallsfrei`] : []),
    ].join(', '),
};
