/** De grafieken en hun tabellen. */
import type { CHARTS as ENGLISH } from '../en/charts';
import type { In } from '../shape';
import { counted } from './counted';

export const CHARTS: In<typeof ENGLISH> = {
  charts: 'Grafieken',
  chartOf: (sensor) => `Grafiek: ${sensor}`,
  chartsBy: { tag: 'Eén meetpunt', sensor: 'Meerdere' },
  chartsByLegend: 'Wat er getoond wordt',
  chartSpan: (from, to) => `${from} tot ${to}`,
  chartSummary: (count, latest, at, low, high, gaps) =>
    `${counted(count, 'meetwaarde', 'meetwaarden')}, de laatste ${latest} (${at}), ` +
    `tussen ${low} en ${high}, ${gaps === 0 ? 'geen gat' : counted(gaps, 'gat', 'gaten')}.`,
  chartEmpty: 'Geen meetwaarde in deze periode.',
  chartNeedsDay: (known) =>
    known === null
      ? 'Heeft 24 u aan meetwaarden nodig, zonder gat van meer dan 3 u'
      : `Heeft 24 u aan meetwaarden nodig; tot nu toe ${known}`,
  chartLoading: 'De historie wordt geladen',
  chartFailed: (reason) =>
    `De historie kon niet worden geladen; de pagina blijft het proberen. ${reason}`,
  chartMissing: 'Deze digital twin legt niets vast.',
  chartMissingHint:
    'Zonder vastgelegde gegevens zijn er geen grafieken, alleen de laatste metingen.',
  chartMissingMore:
    'Start de digital twin zonder “journal:=off”, of geef een bestand op in de parameter “journal”.',
  chartMissingShort: 'Geen grafiek: deze digital twin legt niets vast.',
  chartNoTime: 'De digital twin heeft nog geen tijd; er is nog geen historie.',
  chartIdealsDiffer: 'Ideaal bereik verschilt per soort',
  chartNoSensors: 'Dit meetpunt heeft geen sensor.',
  chartTable: 'Als tabel tonen',
  chartPlots: 'Als grafiek tonen',
  chartDayBefore: 'Dag ervoor',
  chartBeforeWas: (value) => `dag ervoor ${value}`,
  chartWhole: 'Hele periode',
  chartCsvShown: 'CSV van de weergave',
  chartCsvAll: 'CSV van alle meetwaarden',
  chartAddTag: 'Meetpunt toevoegen',
  chartRemoveTag: (tag) => `Meetpunt ${tag} uit de grafiek halen`,
  chartWhich: 'Tabel van',
  chartHint: 'Sleep om in te zoomen; klik om naar dat moment te gaan.',
  chartColumns: {
    time: 'Tijd',
    until: 'Tot',
    value: 'Waarde',
    count: 'Meetwaarden',
    mean: 'Gemiddelde',
    min: 'Laagste',
    max: 'Hoogste',
    event: 'Gebeurtenis',
  },
  chartGap: (length) => `${length} geen gegevens`,
  missing: { not_kept: 'niet meer bewaard', not_recorded: 'niet vastgelegd' },
  chartFailures: (count) => counted(count, 'mislukte poging', 'mislukte pogingen'),
  chartLooks: (count) => counted(count, 'bloemcontrole', 'bloemcontroles'),
};
