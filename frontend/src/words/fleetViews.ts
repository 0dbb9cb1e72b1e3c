/** The words of what the page over all greenhouses loads when asked for: alarms, comparison, report. */
import type { Language } from './languages';
import type { In } from './shape';

const ENGLISH = {
  wasLive: 'last known',
  acknowledged: (name: string, at: string): string => `acknowledged by ${name} at ${at}`,
  shelved: (name: string, until: string): string => `shelved by ${name} until ${until}`,
  moreAlarms: (count: number): string =>
    `${count} more: the pages of the greenhouses have all of them.`,
  deviation: 'Deviation',
  deviationHint: 'How far a greenhouse is from the median of all, on average.',
  median: 'Median of all; band: the middle half',
  draw: (site: string): string => `Draw ${site}`,
  someCompared: (count: number, all: number): string =>
    `${count} of ${all} greenhouses are compared, the worst first. Search, or choose a group.`,
  notFetched: (reason: string): string => `This could not be fetched: ${reason}`,
  hours: (count: number): string => `Last ${count} hours`,
  scans: 'Scans',
  failed: 'Failed attempts',
  inspections: 'Inspections',
  notes: 'Notes',
  activeAlarms: 'Alarms now',
  completeTo: 'Complete up to',
  wholeHours: 'Counted in whole hours. Follow a name for the report of that greenhouse.',
  newestNotes: 'Newest notes',
  kinds: { acknowledge: 'alarm acknowledged', shelve: 'alarm shelved' },
  withdrawn: (name: string): string => `withdrawn by ${name}`,
};

const GERMAN: In<typeof ENGLISH> = {
  wasLive: 'zuletzt bekannt',
  acknowledged: (name, at) => `quittiert von ${name} um ${at}`,
  shelved: (name, until) => `zurückgestellt von ${name} bis ${until}`,
  moreAlarms: (count) => `${count} weitere: Alle stehen auf den Seiten der Gewächshäuser.`,
  deviation: 'Abweichung',
  deviationHint: 'Wie weit ein Gewächshaus im Mittel vom Median aller entfernt ist.',
  median: 'Median aller; Band: die mittlere Hälfte',
  draw: (site) => `${site} zeichnen`,
  someCompared: (count, all) =>
    `${count} von ${all} Gewächshäusern werden verglichen, die schlimmsten zuerst. Suchen Sie, oder wählen Sie eine Gruppe.`,
  notFetched: (reason) => `Das ließ sich nicht abrufen: ${reason}`,
  hours: (count) => `Letzte ${count} Stunden`,
  scans: 'Messungen',
  failed: 'Fehlgeschlagene Versuche',
  inspections: 'Blütenkontrollen',
  notes: 'Notizen',
  activeAlarms: 'Alarme jetzt',
  completeTo: 'Vollständig bis',
  wholeHours: 'In vollen Stunden gezählt. Der Name führt zum Bericht des Gewächshauses.',
  newestNotes: 'Neueste Notizen',
  kinds: { acknowledge: 'Alarm quittiert', shelve: 'Alarm zurückgestellt' },
  withdrawn: (name) => `zurückgenommen von ${name}`,
};

const DUTCH: In<typeof ENGLISH> = {
  wasLive: 'laatst bekend',
  acknowledged: (name, at) => `bevestigd door ${name} om ${at}`,
  shelved: (name, until) => `uitgesteld door ${name} tot ${until}`,
  moreAlarms: (count) => `Nog ${count}: de pagina's van de kassen hebben ze allemaal.`,
  deviation: 'Afwijking',
  deviationHint: 'Hoe ver een kas gemiddeld van de mediaan van alle kassen ligt.',
  median: 'Mediaan van alle; band: de middelste helft',
  draw: (site) => `${site} tekenen`,
  someCompared: (count, all) =>
    `${count} van ${all} kassen worden vergeleken, de slechtste eerst. Zoek, of kies een groep.`,
  notFetched: (reason) => `Dit kon niet worden opgehaald: ${reason}`,
  hours: (count) => `Afgelopen ${count} uur`,
  scans: 'Metingen',
  failed: 'Mislukte pogingen',
  inspections: 'Bloemcontroles',
  notes: 'Notities',
  activeAlarms: 'Alarmen nu',
  completeTo: 'Volledig tot',
  wholeHours: 'In hele uren geteld. De naam leidt naar het rapport van de kas.',
  newestNotes: 'Nieuwste notities',
  kinds: { acknowledge: 'alarm bevestigd', shelve: 'alarm uitgesteld' },
  withdrawn: (name) => `ingetrokken door ${name}`,
};

const SPANISH: In<typeof ENGLISH> = {
  wasLive: 'último dato',
  acknowledged: (name, at) => `reconocida por ${name} a las ${at}`,
  shelved: (name, until) => `aplazada por ${name} hasta ${until}`,
  moreAlarms: (count) => `${count} más: las páginas de los invernaderos las tienen todas.`,
  deviation: 'Desviación',
  deviationHint: 'Cuánto se aleja un invernadero de la mediana de todos, en promedio.',
  median: 'Mediana de todos; banda: la mitad central',
  draw: (site) => `Dibujar ${site}`,
  someCompared: (count, all) =>
    `Se comparan ${count} de ${all} invernaderos, los peores primero. Busque o elija un grupo.`,
  notFetched: (reason) => `No se pudo obtener: ${reason}`,
  hours: (count) => `Últimas ${count} horas`,
  scans: 'Mediciones',
  failed: 'Intentos fallidos',
  inspections: 'Revisiones de flores',
  notes: 'Notas',
  activeAlarms: 'Alarmas ahora',
  completeTo: 'Completo hasta',
  wholeHours: 'Se cuenta por horas enteras. El nombre lleva al informe de ese invernadero.',
  newestNotes: 'Notas más recientes',
  kinds: { acknowledge: 'alarma reconocida', shelve: 'alarma aplazada' },
  withdrawn: (name) => `retirada por ${name}`,
};

export const VIEW_WORDS: Readonly<Record<Language, In<typeof ENGLISH>>> = {
  en: ENGLISH,
  de: GERMAN,
  nl: DUTCH,
  es: SPANISH,
};
