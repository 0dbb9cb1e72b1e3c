/** Die Seite selbst: Verbindung, Störungen, Menü, Hilfe, was man mitnimmt. */
import type { PAGE as ENGLISH } from '../en/page';
import type { In } from '../shape';
import { counted } from './counted';

export const PAGE: In<typeof ENGLISH> = {
  product: 'Lupin twin',
  subtitle: 'Gewächshaus',
  skipToTable: 'Zur Tabelle der Messpunkte springen',
  more: 'Mehr dazu',

  language: 'Sprache',
  languageUnknown: (asked) =>
    `„${asked}“ spricht diese Seite nicht: Sie wird auf Englisch angezeigt.`,
  languageMissing: (name) =>
    `${name} konnte nicht geladen werden: Die Seite wird auf Englisch angezeigt.`,
  partsLate: 'Ein Teil der Seite ist nicht angekommen.',
  partsLateHint:
    'Karten, Listen und Zeitleiste kommen, sobald der Server antwortet; er wird immer wieder gefragt.',

  phase: {
    connecting: 'Verbindet',
    live: 'Live',
    stale: 'Kein Signal',
    offline: 'Zwilling offline',
    reconnecting: 'Verbindet neu',
  },
  phaseLabel: 'Verbindung',
  retryNow: 'Jetzt versuchen',
  nextTry: (seconds) => (seconds > 0 ? `nächster Versuch in ${seconds} s` : 'wird gerade versucht'),
  frozenSince: (clock) => `Die Messwerte stehen still. Letzte Daten um ${clock}`,
  agoSuffix: (age) => `vor ${age}`,
  frozenWhy: {
    stale: 'Die Verbindung besteht, aber es kommt nichts mehr an.',
    reconnecting:
      'Die Verbindung zum Server ist unterbrochen; es geht von selbst weiter, sobald sie wieder steht.',
    connecting: 'Warten auf Antwort des Servers.',
    live: '',
    offline: 'Der Server antwortet, aber der Zwilling dahinter nicht.',
  },
  offlineWhy: {
    live: '',
    paused: '',
    no_clock: 'Der Zwilling kennt die Uhrzeit noch nicht und damit auch nicht das Alter der Werte.',
    clock_stopped:
      'Die Uhr des Zwillings ist stehen geblieben. Wie alt die Werte sind, ist nicht bekannt.',
    clock_doubted: 'Die Uhr des Zwillings geht falsch. Wie alt die Werte sind, ist nicht bekannt.',
    never_seen: 'Der Server hat noch von keinem Zwilling gehört. Ist er eingeschaltet?',
    stale: 'Der Zwilling meldet sich nicht mehr. Bitte prüfen, ob er noch läuft.',
    thread_dead: 'Der Server hat den Kontakt zum Zwilling verloren und muss neu gestartet werden.',
    shutting_down: 'Der Server wird gerade beendet.',
  },
  offlineMore: {
    live: '',
    paused: '',
    no_clock: 'Der Zwilling läuft mit simulierter Zeit, und auf /clock kommt nichts.',
    clock_stopped: 'Der Zwilling läuft mit simulierter Zeit, und auf /clock kommt nichts mehr.',
    clock_doubted: 'Sie zeigt eine Zeit vor der Aufzeichnung: bitte stellen.',
    never_seen: 'Zwilling und Bridge müssen in derselben ROS-Domain laufen (ROS_DOMAIN_ID).',
    stale: 'Die Bridge läuft, aber auf /twin/state wird nichts mehr veröffentlicht.',
    thread_dead: 'Der ROS-Thread der Bridge ist beendet; warum, steht in ihrem Log.',
    shutting_down: '',
  },

  unread: (count) =>
    count === 1
      ? 'Eine Nachricht vom Server war nicht lesbar und wurde verworfen.'
      : `${count} Nachrichten vom Server waren nicht lesbar und wurden verworfen.`,
  unreadLast: (why) => `Die letzte: ${why}`,
  paused: 'Die Zeit ist angehalten.',
  pausedHint: 'Die Simulation oder die Aufzeichnung steht still, und kein Messwert altert.',
  inputProblem: 'Der Zwilling hört nicht alles, was für ihn veröffentlicht wird.',
  drops: (count) =>
    `Der Zwilling hat in den letzten Minuten ${counted(count, 'Nachricht', 'Nachrichten')} verworfen.`,
  dropsLast: (message) => `Die letzte: ${message}`,
  journal: {
    off: {
      title: 'Es wird nichts aufgezeichnet.',
      hint: 'Nach einem Neustart weiß der Zwilling nichts mehr von vorher.',
    },
    slow: {
      title: 'Die Aufzeichnung kommt nicht nach.',
      hint: 'Was wartet, wird geschrieben, sobald der Datenträger wieder nachkommt; bei Stromausfall wäre es verloren.',
    },
    failing: {
      title: 'Die Aufzeichnung schlägt fehl.',
      hint: 'Der Zwilling läuft weiter, versucht es immer wieder und schreibt alles, was wartet, sobald er kann: Bitte Platz schaffen oder den Datenträger prüfen.',
    },
    upgrading: {
      title: 'Die Aufzeichnung einer älteren Version wird umgestellt.',
      hint: 'Was beobachtet wird, ist zu sehen und wartet. Was vorher bekannt war, ist wieder da, sobald das getan ist; das kann Minuten dauern.',
    },
    doubting: {
      title: 'Es wird nichts aufgezeichnet: Die Uhr widerspricht der Aufzeichnung.',
      hint: 'Was beobachtet wird, ist zu sehen und wartet. Es wird geschrieben, sobald die Uhr stimmt, oder nach zehn Minuten, wie es ist.',
    },
    in_use: {
      title: 'Dieser Zwilling zeichnet nicht auf: Ein anderer tut es bereits.',
      hint: 'Einen der beiden beenden oder diesem eine eigene Datei geben.',
    },
    foreign: {
      title: 'Dieser Zwilling zeichnet nicht auf: Seine Datei gehört jemand anderem.',
      hint: 'Darin wurde nichts verändert. Dem Zwilling eine andere Datei geben oder diese verschieben.',
    },
  },
  outward: {
    mqtt: 'Die Hausautomation (MQTT) erfährt nichts.',
    webhook: 'Alarme werden nicht weitergegeben (Webhook).',
  },
  outwardOther: (channel) => `${channel} erfährt nichts.`,
  outwardHint: 'Es wird immer wieder versucht; diese Seite ist nicht betroffen.',
  journalMore: 'Die Datei nennt der Parameter „journal“ des Zwillings; „off“ zeichnet nichts auf.',
  origin: { simulated: 'Simuliert', recorded: 'Aufzeichnung', sim_time: 'Simulierte Zeit' },
  originHint: {
    simulated: 'Hier arbeitet kein Roboter: Haus, Pflanzen und Messwerte sind erfunden.',
    recorded: 'Hier wird eine Aufzeichnung abgespielt: Nichts davon ist von jetzt.',
    sim_time:
      'Die Zeit ist nicht die der Uhr an der Wand: Was zu sehen ist, kommt aus einer Simulation oder aus einer Aufzeichnung, die abgespielt wird.',
  },
  recordedIs: { playing: 'Läuft', paused: 'Steht still' },
  recordedPaused: 'Die Aufzeichnung steht still.',
  recordedPausedHint: 'Sie ist angehalten oder zu Ende, und kein Messwert altert.',
  simulated: 'Simuliert.',
  simulatedHint: (until) =>
    `Das hat kein Roboter beobachtet: Die Vorführung begann mit erfundenen Tagen bis ${until}.`,
  setAside: 'Eine beschädigte Aufzeichnung wurde beiseitegelegt.',
  setAsideHint: (name) =>
    `Was noch lesbar war, wurde übernommen, und es wird weiter aufgezeichnet. Die alte Datei ist ${name}.`,
  failedTitle: 'Diese Seite ist ausgefallen',
  failedHint: 'Was sie zeigt, ist nicht verlässlich. Zwilling und Server sind nicht betroffen.',
  failedAgain: 'Sie wird von selbst neu geladen.',
  reload: 'Neu laden',

  menu: 'Menü',
  unit: 'Temperatur',
  theme: 'Darstellung',
  themes: { system: 'System', light: 'Hell', dark: 'Dunkel' },
  copyLink: 'Link zu dieser Ansicht kopieren',
  linkCopied: 'Link kopiert',
  linkInBar: 'In der Adresszeile steht der Link zu dieser Ansicht',
  savePng: 'Karte als PNG speichern',
  saveCsv: 'Tabelle als CSV speichern',
  saveCsvShort: 'CSV',
  print: 'Drucken',
  kiosk: 'Wandanzeige',
  kioskLeave: 'Verlassen',
  cycleNext: (sensor, time) => `danach: ${sensor} in ${time}`,
  cycleRefused: (asked, least, most) =>
    `cycle=${asked} gilt nicht: möglich sind ${least} bis ${most} Sekunden.`,
  help: 'Tastenkürzel',
  signOut: 'Abmelden',
  signOutFailed: (reason) => `Sie sind noch angemeldet: ${reason}`,
  exportFailed: (reason) => `Es wurde nichts gespeichert: ${reason}`,

  emptyConnecting: 'Verbindung zum Server wird aufgebaut',
  emptyConnectingHint: 'Das Gewächshaus erscheint, sobald er antwortet.',
  emptyUnreachable: 'Der Server antwortet nicht',
  emptyUnreachableHint:
    'Bitte prüfen, ob er eingeschaltet ist. Die Seite versucht es von selbst weiter.',
  emptyUnreachableMore:
    'Der Server ist die Bridge: „lupin-twin serve“ auf dem Roboter oder „make run“ für die Vorführung.',
  emptyNoTwin: 'Noch kein Zwilling',
  emptyNoTags: 'Noch keine Messpunkte',
  emptyNoTagsHint:
    'Der Zwilling läuft und wartet. Messpunkte erscheinen, wenn der Roboter einen findet oder ' +
    'abliest: Schicken Sie ihn auf seine Runde.',
  emptyNoTagsMore: '„lupin-twin demo“ zeigt eine simulierte Runde.',
  emptyNoPins: 'Noch kein Messpunkt hat eine Position',
  emptyNoPinsHint:
    'Alle Messpunkte stehen in der Tabelle; mit der ersten gelungenen Messung kommen sie auf die Karte.',
  emptyNoReading: (sensor) => `Noch kein Messpunkt auf der Karte hat einen Messwert: ${sensor}`,
  emptyNoReadingHint:
    'Wählen Sie einen anderen Sensor, oder warten Sie, bis der Roboter mehr abgelesen hat.',
  emptyNoMap: 'Noch kein Grundriss: Der Roboter hat seine Karte nicht geschickt.',
  emptyNoMapMore: 'Der Grundriss ist die SLAM-Karte des Roboters, die auf /map kommt.',

  helpTitle: 'Tastenkürzel',
  helpGlobal: 'Überall',
  helpMap: 'Auf der Karte',
  helpTime: 'Auf der Zeitleiste',
  helpToggle: 'Kürzel mit einer einzigen Taste',
  keys: {
    global: [
      ['1 – 9', 'Sensor wählen'],
      ['/', 'Tabelle filtern'],
      ['F', 'Auf der Karte alles zeigen'],
      ['N, P', 'Nächster und voriger Messpunkt'],
      ['S', 'Farbkarte glätten'],
      ['Y', 'Ebenen'],
      ['A', 'Alarme'],
      ['C', 'Verlauf des gewählten Messpunkts'],
      ['L', 'Zurück zu live'],
      ['Leertaste', 'Vergangenheit abspielen oder anhalten'],
      ['U', '°C oder °F'],
      ['T', 'Hell oder dunkel'],
      ['Esc', 'Schließen, dann zurück zu live'],
      ['?', 'Diese Liste'],
    ],
    time: [
      ['← →', 'Einen Schritt zurück oder vor; mit Umschalt zehn'],
      ['Bild ↑ ↓', 'Ein Zehntel der Leiste'],
      ['Pos1', 'Zum Anfang'],
      ['Ende', 'Live'],
    ],
    map: [
      ['← ↑ ↓ →', 'Verschieben; mit Umschalt schneller'],
      ['+  −', 'Vergrößern, verkleinern'],
      ['0', 'Alles zeigen'],
      ['Eingabe', 'Nächstgelegenen Messpunkt öffnen'],
    ],
  },

  paper: (taken, printed) => `Stand ${taken}, gedruckt ${printed}`,
  paperRest: (printed, all) =>
    `Gedruckt sind die ersten ${printed} von ${all} Messpunkten. Die Tabelle als CSV enthält alle.`,
  paperRange: (sensor, range) => `${sensor} ${range}`,
  fileName: (kind, stamp) => `lupin-twin-${kind}-${stamp}`,
  asOf: (moment) => `Stand ${moment}`,
};
