/** Texts of the fleet page's views that load on request: alarms, comparison, report. */
import type { Language } from './languages';
import type { In } from './shape';

const ENGLISH = {
  wasLive: 'last known',
  moreAlarms: (count: number): string => `${count} more: see the pages of the greenhouses.`,
  deviation: 'Deviation',
  deviationHint: 'How far a greenhouse is from the median of all, on average.',
  median: 'Median of all; band: the middle half',
  draw: (site: string): string => `Show ${site}`,
  someCompared: (count: number, all: number): string =>
    `${count} of ${all} greenhouses are compared, worst first. Search to choose others.`,
  notFetched: (reason: string): string => `This could not be loaded: ${reason}`,
  hours: (count: number): string => `Last ${count} hours`,
  scans: 'Scans',
  failed: 'Failed attempts',
  inspections: 'Inspections',
  notes: 'Notes',
  activeAlarms: 'Alarms now',
  completeTo: 'Complete up to',
  wholeHours: 'Counted in whole hours. Click a name for the report of that greenhouse.',
  latestNotes: 'Newest notes',
  kinds: { acknowledge: 'alarm acknowledged', shelve: 'alarm shelved' },
  withdrawn: (name: string): string => `withdrawn by ${name}`,
};

const GERMAN: In<typeof ENGLISH> = {
  wasLive: 'zuletzt bekannt',
  moreAlarms: (count) => `${count} weitere: siehe die Seiten der Gewächshäuser.`,
  deviation: 'Abweichung',
  deviationHint: 'Wie weit ein Gewächshaus im Mittel vom Median aller Gewächshäuser abweicht.',
  median: 'Median aller; Band: die mittlere Hälfte',
  draw: (site) => `${site} anzeigen`,
  someCompared: (count, all) =>
    `${count} von ${all} Gewächshäusern werden verglichen, die kritischsten zuerst. Andere über die Suche wählen.`,
  notFetched: (reason) => `Das konnte nicht geladen werden: ${reason}`,
  hours: (count) => `Letzte ${count} Stunden`,
  scans: 'Messungen',
  failed: 'Fehlgeschlagene Versuche',
  inspections: 'Blütenkontrollen',
  notes: 'Notizen',
  activeAlarms: 'Alarme jetzt',
  completeTo: 'Vollständig bis',
  wholeHours: 'Gezählt in vollen Stunden. Der Name führt zum Bericht des Gewächshauses.',
  latestNotes: 'Neueste Notizen',
  kinds: { acknowledge: 'Alarm quittiert', shelve: 'Alarm zurückgestellt' },
  withdrawn: (name) => `zurückgenommen von ${name}`,
};

const DUTCH: In<typeof ENGLISH> = {
  wasLive: 'laatst bekend',
  moreAlarms: (count) => `Nog ${count}: zie de pagina’s van de kassen.`,
  deviation: 'Afwijking',
  deviationHint: 'Hoe ver een kas gemiddeld van de mediaan van alle kassen ligt.',
  median: 'Mediaan van alle; band: de middelste helft',
  draw: (site) => `${site} tonen`,
  someCompared: (count, all) =>
    `${count} van ${all} kassen worden vergeleken, de slechtste eerst. Zoek om andere te kiezen.`,
  notFetched: (reason) => `Dit kon niet worden geladen: ${reason}`,
  hours: (count) => `Afgelopen ${count} uur`,
  scans: 'Metingen',
  failed: 'Mislukte pogingen',
  inspections: 'Bloemcontroles',
  notes: 'Notities',
  activeAlarms: 'Alarmen nu',
  completeTo: 'Volledig tot',
  wholeHours: 'Geteld per heel uur. Klik op een naam voor het rapport van die kas.',
  latestNotes: 'Nieuwste notities',
  kinds: { acknowledge: 'alarm bevestigd', shelve: 'alarm uitgesteld' },
  withdrawn: (name) => `ingetrokken door ${name}`,
};

const SPANISH: In<typeof ENGLISH> = {
  wasLive: 'últimos datos',
  moreAlarms: (count) => `${count} más: vea las páginas de los invernaderos.`,
  deviation: 'Desviación',
  deviationHint: 'Cuánto se aleja un invernadero de la mediana de todos, en promedio.',
  median: 'Mediana de todos; banda: la mitad central',
  draw: (site) => `Mostrar ${site}`,
  someCompared: (count, all) =>
    `Se comparan ${count} de ${all} invernaderos, los peores primero. Busque para elegir otros.`,
  notFetched: (reason) => `No se pudo cargar: ${reason}`,
  hours: (count) => `Últimas ${count} horas`,
  scans: 'Mediciones',
  failed: 'Intentos fallidos',
  inspections: 'Revisiones de flores',
  notes: 'Notas',
  activeAlarms: 'Alarmas ahora',
  completeTo: 'Completo hasta',
  wholeHours: 'Recuento por horas enteras. Pulse un nombre para ver el informe de ese invernadero.',
  latestNotes: 'Notas más recientes',
  kinds: { acknowledge: 'alarma reconocida', shelve: 'alarma aplazada' },
  withdrawn: (name) => `retirada por ${name}`,
};

export const VIEW_WORDS: Readonly<Record<Language, In<typeof ENGLISH>>> = {
  en: ENGLISH,
  de: GERMAN,
  nl: DUTCH,
  es: SPANISH,
};
