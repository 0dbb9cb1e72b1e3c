/** Texts of the fleet page; few, so all languages are bundled. */
import type { Language } from './languages';
import type { In } from './shape';

const ENGLISH = {
  search: 'Search',
  filter: 'Filter by status',
  all: 'All',
  silent: 'Silent',
  list: 'Greenhouses, worst first',
  alarmsBeingRead: 'Loading alarms',
  noAlarms: 'No alarms',
  judging: 'Being assessed',
  received: (time: string): string => `Last received ${time}`,
  nothingReceived: 'Nothing received yet',
  silentSince: (time: string): string => `Silent since ${time}`,
  asOf: (time: string): string => `As of ${time}`,
  lastKnown: (status: string): string => `Last known: ${status}`,
  archiveDown: (time: string): string =>
    `The archive has not answered since ${time}. The last known state is shown.`,
  disconnected: (time: string): string =>
    `No connection to the server since ${time}. The last known state is shown.`,
  sites: 'Greenhouses',
  alarmList: 'Alarms of all greenhouses, worst first',
  others: 'Other greenhouses',
  compare: 'Compare',
  empty: 'No greenhouse sends data to this archive yet.',
  noMatch: 'No greenhouse matches the filter.',
  shown: (count: number, all: number): string => `${count} of ${all} greenhouses shown`,
};

type FleetWords = In<typeof ENGLISH>;

const GERMAN: FleetWords = {
  search: 'Suchen',
  filter: 'Nach Zustand filtern',
  all: 'Alle',
  silent: 'Kein Signal',
  list: 'Gewächshäuser, die kritischsten zuerst',
  alarmsBeingRead: 'Alarme werden geladen',
  noAlarms: 'Keine Alarme',
  judging: 'Wird beurteilt',
  received: (time) => `Zuletzt empfangen ${time}`,
  nothingReceived: 'Noch nichts empfangen',
  silentSince: (time) => `Kein Signal seit ${time}`,
  asOf: (time) => `Stand ${time}`,
  lastKnown: (status) => `Zuletzt bekannt: ${status}`,
  archiveDown: (time) =>
    `Das Archiv antwortet seit ${time} nicht. Angezeigt wird der letzte bekannte Stand.`,
  disconnected: (time) =>
    `Seit ${time} keine Verbindung zum Server. Angezeigt wird der letzte bekannte Stand.`,
  sites: 'Gewächshäuser',
  alarmList: 'Alarme aller Gewächshäuser, die kritischsten zuerst',
  others: 'Andere Gewächshäuser',
  compare: 'Vergleichen',
  empty: 'Noch kein Gewächshaus sendet Daten an dieses Archiv.',
  noMatch: 'Kein Gewächshaus passt zum Filter.',
  shown: (count, all) => `${count} von ${all} Gewächshäusern angezeigt`,
};

const DUTCH: FleetWords = {
  search: 'Zoeken',
  filter: 'Filteren op toestand',
  all: 'Alle',
  silent: 'Geen signaal',
  list: 'Kassen, de slechtste eerst',
  alarmsBeingRead: 'Alarmen worden geladen',
  noAlarms: 'Geen alarmen',
  judging: 'Wordt beoordeeld',
  received: (time) => `Laatst ontvangen ${time}`,
  nothingReceived: 'Nog niets ontvangen',
  silentSince: (time) => `Geen signaal sinds ${time}`,
  asOf: (time) => `Stand van ${time}`,
  lastKnown: (status) => `Laatst bekend: ${status}`,
  archiveDown: (time) =>
    `Het archief antwoordt niet meer sinds ${time}. U ziet de laatst bekende stand.`,
  disconnected: (time) =>
    `Sinds ${time} geen verbinding met de server. U ziet de laatst bekende stand.`,
  sites: 'Kassen',
  alarmList: 'Alarmen van alle kassen, de ergste eerst',
  others: 'Andere kassen',
  compare: 'Vergelijken',
  empty: 'Er stuurt nog geen kas gegevens naar dit archief.',
  noMatch: 'Geen kas voldoet aan het filter.',
  shown: (count, all) => `${count} van ${all} kassen getoond`,
};

const SPANISH: FleetWords = {
  search: 'Buscar',
  filter: 'Filtrar por estado',
  all: 'Todos',
  silent: 'Sin señal',
  list: 'Invernaderos, los peores primero',
  alarmsBeingRead: 'Cargando las alarmas',
  noAlarms: 'Sin alarmas',
  judging: 'En evaluación',
  received: (time) => `Último dato: ${time}`,
  nothingReceived: 'Aún no se ha recibido nada',
  silentSince: (time) => `Sin señal desde ${time}`,
  asOf: (time) => `Datos: ${time}`,
  lastKnown: (status) => `Último estado conocido: ${status}`,
  archiveDown: (time) =>
    `El archivo central no responde desde ${time}. Se muestra el último estado conocido.`,
  disconnected: (time) =>
    `Sin conexión con el servidor desde ${time}. Se muestra el último estado conocido.`,
  sites: 'Invernaderos',
  alarmList: 'Alarmas de todos los invernaderos, las peores primero',
  others: 'Otros invernaderos',
  compare: 'Comparar',
  empty: 'Ningún invernadero envía aún datos a este archivo central.',
  noMatch: 'Ningún invernadero coincide con el filtro.',
  shown: (count, all) => `${count} de ${all} invernaderos mostrados`,
};

export const FLEET_WORDS: Readonly<Record<Language, FleetWords>> = {
  en: ENGLISH,
  de: GERMAN,
  nl: DUTCH,
  es: SPANISH,
};
