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
    `${counted(count, 'reading', 'readings')}, the latest ${latest} at ${at}, ` +
    `between ${low} and ${high}, ${gaps === 0 ? 'no gap' : counted(gaps, 'gap', 'gaps')}.`,
  chartEmpty: 'No reading in this period.',
  chartNothing: '–',
  chartLoading: 'The past is on its way',
  chartFailed: (reason: string): string => `The past could not be fetched: ${reason}`,
  chartMissing: 'This twin keeps no past.',
  chartMissingHint: 'Charts need its recording. Until then the card shows the last scans alone.',
  chartMissingMore:
    'Start the twin without “journal:=off”, or name a file in the parameter “journal”.',
  chartMissingShort: 'No chart: this twin records nothing.',
  chartNoTime: 'The twin has no time yet, and so no past.',
  chartNoSensors: 'This tag has no sensor.',
  chartTable: 'Show as table',
  chartPlots: 'Show as charts',
  chartZoomIn: 'Zoom in',
  chartZoomOut: 'Zoom out',
  chartWhole: 'Whole period',
  chartCsvShown: 'CSV of what is shown',
  chartCsvAll: 'CSV of all readings',
  chartAddTag: 'Add a tag',
  chartRemoveTag: (tag: string): string => `Remove tag ${tag} from the chart`,
  chartWhich: 'Table of',
  chartHint: 'Drag: zoom. Click: the greenhouse as of then.',
  chartTableCaption: (label: string, sensor: string, span: string): string =>
    `${label}, ${sensor}, ${span}`,
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
  chartGap: (length: string): string => `nothing came for ${length}`,
  missing: { not_kept: 'no longer kept', not_recorded: 'not recorded' },
  chartFailures: (count: number): string => counted(count, 'failed try', 'failed tries'),
  chartLooks: (count: number): string =>
    counted(count, 'look at the flowers', 'looks at the flowers'),
} as const;
