/** The charts and their tables. */
import { counted } from './counted';

export const CHARTS = {
  charts: 'Charts',
  chartOf: (sensor: string): string => `Chart of ${sensor}`,
  chartsBy: { tag: 'One tag', sensor: 'Several tags' },
  chartsByLegend: 'What is charted',
  chartSpan: (from: string, to: string): string => `${from} to ${to}`,
  chartSummary: (
    count: number,
    latest: string,
    at: string,
    low: string,
    high: string,
    gaps: number,
  ): string =>
    `${counted(count, 'reading', 'readings')}, the latest ${latest} (${at}), ` +
    `between ${low} and ${high}, ${gaps === 0 ? 'no gap' : counted(gaps, 'gap', 'gaps')}.`,
  chartEmpty: 'No reading in this period.',
  /** Of a quantity of a day. `known`: how far back anything is known; null: a day, with a gap. */
  chartNeedsDay: (known: string | null): string =>
    known === null
      ? 'Needs 24 h of readings without a gap of over 3 h'
      : `Needs 24 h of readings; ${known} so far`,
  chartLoading: 'Loading history',
  chartFailed: (reason: string): string =>
    `History could not be loaded; the page keeps trying. ${reason}`,
  chartMissing: 'This twin records nothing.',
  chartMissingHint: 'Without a recording, the card shows only the last scans.',
  chartMissingMore:
    'Start the twin without “journal:=off”, or name a file in the parameter “journal”.',
  chartMissingShort: 'No chart: this twin records nothing.',
  chartNoTime: 'The twin has no time yet, so there is no history.',
  chartIdealsDiffer: 'Ideal ranges differ by species',
  chartNoSensors: 'This tag has no sensor.',
  chartTable: 'Show as table',
  chartPlots: 'Show as charts',
  chartDayBefore: 'Day before',
  chartBeforeWas: (value: string): string => `day before ${value}`,
  chartWhole: 'Whole period',
  chartCsvShown: 'CSV of this view',
  chartCsvAll: 'CSV of all readings',
  chartAddTag: 'Add a tag',
  chartRemoveTag: (tag: string): string => `Remove tag ${tag} from the chart`,
  chartWhich: 'Table of',
  chartHint: 'Drag to zoom; click to go to that time.',
  chartColumns: {
    time: 'Time',
    until: 'Until',
    value: 'Value',
    count: 'Readings',
    mean: 'Mean',
    min: 'Lowest',
    max: 'Highest',
    event: 'Event',
  },
  chartGap: (length: string): string => `no data for ${length}`,
  missing: { not_kept: 'no longer stored', not_recorded: 'not recorded' },
  chartFailures: (count: number): string => counted(count, 'failed attempt', 'failed attempts'),
  chartLooks: (count: number): string => counted(count, 'flower inspection', 'flower inspections'),
} as const;
