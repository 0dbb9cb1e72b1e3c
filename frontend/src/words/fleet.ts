/** The words of the page over all greenhouses; few enough that every language comes along. */
import type { Language } from './languages';
import type { In } from './shape';

const ENGLISH = {
  title: 'Greenhouses',
  search: 'Search',
  filter: 'Filter by status',
  all: 'All',
  silent: 'Silent',
  list: 'Greenhouses, the worst first',
  alarms: (count: number): string => (count === 1 ? '1 alarm' : `${count} alarms`),
  alarmsBeingRead: 'Alarms are being read',
  noAlarms: 'No alarms',
  judging: 'Being judged',
  received: (time: string): string => `Last received ${time}`,
  nothingReceived: 'Nothing received yet',
  live: 'Live',
  silentSince: (time: string): string => `Silent since ${time}`,
  neverForwarded: 'Never forwarded',
  lastKnown: (status: string, alarms: string): string => `Last known: ${status}, ${alarms}`,
  archiveDown: (time: string): string =>
    `The archive has not answered since ${time}. What you see is what was last known.`,
  disconnected: (time: string): string =>
    `No connection to the server since ${time}. What you see is what was last known.`,
  sites: 'Greenhouses',
  alarmList: 'Alarms of all greenhouses, the worst first',
  wasLive: 'last known',
  moreAlarms: (count: number): string =>
    `${count} more: the pages of the greenhouses have all of them.`,
  group: 'Group',
  allGroups: 'All groups',
  others: 'Other greenhouses',
  compare: 'Compare',
  deviation: 'Deviation',
  deviationHint: 'How far a greenhouse is from the median of all, on average.',
  median: 'Median of all; band: the middle half',
  draw: (site: string): string => `Draw ${site}`,
  someCompared: (count: number, all: number): string =>
    `${count} of ${all} greenhouses are compared, the worst first. Search, or choose a group.`,
  notFetched: (reason: string): string => `This could not be fetched: ${reason}`,
  connecting: 'Connecting…',
  empty: 'No greenhouse is forwarded to this archive yet.',
  noMatch: 'No greenhouse matches.',
  shown: (count: number, all: number): string => `${count} of ${all} greenhouses shown`,
};

export type FleetWords = In<typeof ENGLISH>;

const GERMAN: FleetWords = {
  title: 'Gewächshäuser',
  search: 'Suchen',
  filter: 'Nach Zustand filtern',
  all: 'Alle',
  silent: 'Still',
  list: 'Gewächshäuser, die schlimmsten zuerst',
  alarms: (count) => (count === 1 ? '1 Alarm' : `${count} Alarme`),
  alarmsBeingRead: 'Alarme werden gelesen',
  noAlarms: 'Keine Alarme',
  judging: 'Wird beurteilt',
  received: (time) => `Zuletzt empfangen ${time}`,
  nothingReceived: 'Noch nichts empfangen',
  live: 'Live',
  silentSince: (time) => `Still seit ${time}`,
  neverForwarded: 'Nie weitergeleitet',
  lastKnown: (status, alarms) => `Zuletzt bekannt: ${status}, ${alarms}`,
  archiveDown: (time) =>
    `Das Archiv antwortet seit ${time} nicht. Sie sehen, was zuletzt bekannt war.`,
  disconnected: (time) =>
    `Seit ${time} keine Verbindung zum Server. Sie sehen, was zuletzt bekannt war.`,
  sites: 'Gewächshäuser',
  alarmList: 'Alarme aller Gewächshäuser, die schlimmsten zuerst',
  wasLive: 'zuletzt bekannt',
  moreAlarms: (count) => `${count} weitere: Alle stehen auf den Seiten der Gewächshäuser.`,
  group: 'Gruppe',
  allGroups: 'Alle Gruppen',
  others: 'Andere Gewächshäuser',
  compare: 'Vergleichen',
  deviation: 'Abweichung',
  deviationHint: 'Wie weit ein Gewächshaus im Mittel vom Median aller entfernt ist.',
  median: 'Median aller; Band: die mittlere Hälfte',
  draw: (site) => `${site} zeichnen`,
  someCompared: (count, all) =>
    `${count} von ${all} Gewächshäusern werden verglichen, die schlimmsten zuerst. Suchen Sie, oder wählen Sie eine Gruppe.`,
  notFetched: (reason) => `Das ließ sich nicht abrufen: ${reason}`,
  connecting: 'Verbindung wird aufgebaut …',
  empty: 'In dieses Archiv wird noch kein Gewächshaus weitergeleitet.',
  noMatch: 'Kein Gewächshaus passt dazu.',
  shown: (count, all) => `${count} von ${all} Gewächshäusern`,
};

const DUTCH: FleetWords = {
  title: 'Kassen',
  search: 'Zoeken',
  filter: 'Filteren op toestand',
  all: 'Alle',
  silent: 'Stil',
  list: 'Kassen, de slechtste eerst',
  alarms: (count) => (count === 1 ? '1 alarm' : `${count} alarmen`),
  alarmsBeingRead: 'Alarmen worden gelezen',
  noAlarms: 'Geen alarmen',
  judging: 'Wordt beoordeeld',
  received: (time) => `Laatst ontvangen ${time}`,
  nothingReceived: 'Nog niets ontvangen',
  live: 'Live',
  silentSince: (time) => `Stil sinds ${time}`,
  neverForwarded: 'Nooit doorgestuurd',
  lastKnown: (status, alarms) => `Laatst bekend: ${status}, ${alarms}`,
  archiveDown: (time) =>
    `Het archief antwoordt sinds ${time} niet. U ziet wat het laatst bekend was.`,
  disconnected: (time) =>
    `Sinds ${time} geen verbinding met de server. U ziet wat het laatst bekend was.`,
  sites: 'Kassen',
  alarmList: 'Alarmen van alle kassen, de ergste eerst',
  wasLive: 'laatst bekend',
  moreAlarms: (count) => `Nog ${count}: de pagina's van de kassen hebben ze allemaal.`,
  group: 'Groep',
  allGroups: 'Alle groepen',
  others: 'Andere kassen',
  compare: 'Vergelijken',
  deviation: 'Afwijking',
  deviationHint: 'Hoe ver een kas gemiddeld van de mediaan van alle kassen ligt.',
  median: 'Mediaan van alle; band: de middelste helft',
  draw: (site) => `${site} tekenen`,
  someCompared: (count, all) =>
    `${count} van ${all} kassen worden vergeleken, de slechtste eerst. Zoek, of kies een groep.`,
  notFetched: (reason) => `Dit kon niet worden opgehaald: ${reason}`,
  connecting: 'Verbinden…',
  empty: 'Er wordt nog geen kas naar dit archief doorgestuurd.',
  noMatch: 'Geen kas voldoet hieraan.',
  shown: (count, all) => `${count} van ${all} kassen`,
};

const SPANISH: FleetWords = {
  title: 'Invernaderos',
  search: 'Buscar',
  filter: 'Filtrar por estado',
  all: 'Todos',
  silent: 'Sin señal',
  list: 'Invernaderos, los peores primero',
  alarms: (count) => (count === 1 ? '1 alarma' : `${count} alarmas`),
  alarmsBeingRead: 'Se leen las alarmas',
  noAlarms: 'Sin alarmas',
  judging: 'Se está evaluando',
  received: (time) => `Última recepción ${time}`,
  nothingReceived: 'Aún no se ha recibido nada',
  live: 'En directo',
  silentSince: (time) => `Sin señal desde ${time}`,
  neverForwarded: 'Nunca reenviado',
  lastKnown: (status, alarms) => `Último estado conocido: ${status}, ${alarms}`,
  archiveDown: (time) => `El archivo no responde desde ${time}. Se muestra lo último que se supo.`,
  disconnected: (time) =>
    `Sin conexión con el servidor desde ${time}. Se muestra lo último que se supo.`,
  sites: 'Invernaderos',
  alarmList: 'Alarmas de todos los invernaderos, las peores primero',
  wasLive: 'último dato',
  moreAlarms: (count) => `${count} más: las páginas de los invernaderos las tienen todas.`,
  group: 'Grupo',
  allGroups: 'Todos los grupos',
  others: 'Otros invernaderos',
  compare: 'Comparar',
  deviation: 'Desviación',
  deviationHint: 'Cuánto se aleja un invernadero de la mediana de todos, en promedio.',
  median: 'Mediana de todos; banda: la mitad central',
  draw: (site) => `Dibujar ${site}`,
  someCompared: (count, all) =>
    `Se comparan ${count} de ${all} invernaderos, los peores primero. Busque o elija un grupo.`,
  notFetched: (reason) => `No se pudo obtener: ${reason}`,
  connecting: 'Conectando…',
  empty: 'Todavía no se reenvía ningún invernadero a este archivo.',
  noMatch: 'Ningún invernadero coincide.',
  shown: (count, all) => `${count} de ${all} invernaderos`,
};

const WORDS: Readonly<Record<Language, FleetWords>> = {
  en: ENGLISH,
  de: GERMAN,
  nl: DUTCH,
  es: SPANISH,
};

export function fleetWordsOf(language: Language): FleetWords {
  return WORDS[language];
}
