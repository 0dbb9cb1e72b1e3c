/** Een ander moment dan nu, en de tijdbalk. */
import type { PAST as ENGLISH } from '../en/past';
import type { In } from '../shape';
import { counted } from './counted';

export const PAST: In<typeof ENGLISH> = {
  past: 'Verleden',
  pastTitle: (moment) => `${moment} (verleden) · Lupin twin`,
  pastFetching: (moment) => `${moment} wordt geladen`,
  pastFetchingHint: 'Tot het geladen is, wordt niets getoond.',
  pastFailed: (moment) => `${moment} kan niet worden getoond`,
  pastNothing: (moment) => `Geen gegevens van ${moment}`,
  pastReach: (from) => `Er zijn vastgelegde gegevens vanaf ${from}.`,
  pastReachNothing: 'Er is nog niets vastgelegd.',
  pastFault: (wanted) => `${wanted} kon niet worden geladen.`,
  pastFaultShown: (shown, why) => `Getoond wordt ${shown}; de pagina blijft het proberen. ${why}`,
  phasePast: {
    connecting: 'Verleden · verbinden',
    live: 'Verleden',
    stale: 'Verleden · geen signaal',
    offline: 'Verleden · twin offline',
    reconnecting: 'Verleden · opnieuw verbinden',
  },
  backToLive: 'Terug naar live',
  backToRecording: 'Terug naar de opname',
  frozenBehindPast: (clock) => `Geen live gegevens meer. Laatste gegevens om ${clock}`,
  frozenPastStays: 'Het getoonde verleden heeft er geen last van.',
  meanwhileShow: (tag) => `Terug naar live, naar meetpunt ${tag}`,

  timebar: 'Tijdbalk',
  timebarSlider: 'Getoonde tijd',
  timebarLive: 'Live',
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
  timebarMarks: 'Wat de tekens betekenen',
  timebarMark: {
    scans: 'balk omhoog: metingen',
    failures: 'balk omlaag: mislukte pogingen',
    pest: 'gevulde driehoek: plaag gezien',
    cleared: 'lege ring: plaag weg',
    silence: 'gearceerd: geen meetpoging',
    before: 'tegengesteld gearceerd: niet vastgelegd of niet meer bewaard',
    run: 'streepjeslijn: klok teruggezet',
  },
  timebarCounts: (scans, failures, seen, cleared) =>
    [
      counted(scans, 'meting', 'metingen'),
      ...(failures > 0 ? [`${failures} mislukt`] : []),
      ...(seen > 0 ? [counted(seen, 'plaag gezien', 'plagen gezien')] : []),
      ...(cleared > 0 ? [counted(cleared, 'plaag weg', 'plagen weg')] : []),
    ].join(', '),
  timebarOff: 'Geen historie: deze digital twin legt niets vast.',
  timebarOffHint: 'Vastleggen zet u aan bij het starten van de digital twin.',
};
