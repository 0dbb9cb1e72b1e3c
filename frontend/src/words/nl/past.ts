/** Een ander moment dan nu, en de tijdbalk. */
import type { PAST as ENGLISH } from '../en/past';
import type { In } from '../shape';
import { counted } from './counted';

export const PAST: In<typeof ENGLISH> = {
  past: 'Verleden',
  pastTitle: (moment) => `${moment} (verleden) · Lupin twin`,
  pastFetching: (moment) => `${moment} wordt opgehaald`,
  pastFetchingHint: 'Tot het er is, wordt niets getoond.',
  pastFailed: (moment) => `${moment} kan niet worden getoond`,
  pastNothing: (moment) => `Van ${moment} is niets bekend`,
  pastReach: (from) => `Het vastgelegde begint op ${from}.`,
  pastReachNothing: 'Er is nog niets vastgelegd.',
  pastFault: (wanted) => `${wanted} kon niet worden opgehaald.`,
  pastFaultShown: (shown, why) => `Getoond wordt ${shown}; er wordt opnieuw geprobeerd. ${why}`,
  phasePast: {
    connecting: 'Verleden · verbinden',
    live: 'Verleden',
    stale: 'Verleden · geen signaal',
    offline: 'Verleden · tweeling offline',
    reconnecting: 'Verleden · opnieuw verbinden',
  },
  backToLive: 'Terug naar live',
  backToRecording: 'Terug naar de opname',
  frozenBehindPast: (clock) => `Live komt er niets meer binnen. Laatste gegevens om ${clock}`,
  frozenPastStays: 'Wat getoond wordt, is verleden en blijft staan.',
  meanwhileShow: (tag) => `Terug naar live, naar meetpunt ${tag}`,

  timebar: 'Tijdbalk',
  timebarSlider: 'Getoonde tijd',
  timebarLive: 'Live',
  timebarPeriod: 'Periode',
  timebarPeriods: {
    hour: 'Laatste uur',
    day: 'Laatste dag',
    week: 'Laatste week',
    month: 'Laatste maand',
    all: 'Alles',
    own: 'Eigen periode',
  },
  timebarFrom: 'Van',
  timebarTo: 'Tot',
  timebarOwnHint: 'Het begin ligt vóór het einde',
  timebarOwnSimHint: 'uu:mm:ss sinds het begin van de simulatie',
  timebarPlay: 'Afspelen',
  timebarPause: 'Pauzeren',
  timebarSpeed: 'Afspeelsnelheid',
  timebarSpeeds: (speed) => `${speed}×`,
  timebarMarks: 'Wat de tekens betekenen',
  timebarMark: {
    scans: 'balk omhoog: metingen',
    failures: 'balk omlaag: mislukte pogingen',
    pest: 'volle driehoek: plaag gezien',
    cleared: 'lege ring: plaag weg',
    silence: 'schuine lijnen: er is niets geprobeerd',
    before: 'andersom schuin: niet vastgelegd of niet meer bewaard',
    run: 'streepjeslijn: de klok begon opnieuw',
  },
  timebarCounts: (scans, failures, seen, cleared) =>
    [
      counted(scans, 'meting', 'metingen'),
      ...(failures > 0 ? [`${failures} mislukt`] : []),
      ...(seen > 0 ? [counted(seen, 'plaag gezien', 'plagen gezien')] : []),
      ...(cleared > 0 ? [counted(cleared, 'plaag weg', 'plagen weg')] : []),
    ].join(', '),
  timebarOff: 'Niet terug te kijken: deze tweeling onthoudt niets.',
  timebarOffHint:
    'Hier wordt niets vastgelegd, dus valt er niet terug te kijken. Wie de tweeling beheert, kan het vastleggen aanzetten.',
  timebarFailed: (reason) => `Het vastgelegde kon niet worden opgehaald: ${reason}`,
};
