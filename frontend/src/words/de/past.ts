/** Ein anderer Zeitpunkt als jetzt, und die Zeitleiste. */
import type { PAST as ENGLISH } from '../en/past';
import type { In } from '../shape';
import { counted } from './counted';

export const PAST: In<typeof ENGLISH> = {
  past: 'Vergangenheit',
  pastTitle: (moment) => `${moment} (vergangen) · Lupin twin`,
  pastFetching: (moment) => `${moment} wird geladen`,
  pastFetchingHint: 'Bis dahin wird nichts angezeigt.',
  pastFailed: (moment) => `${moment} kann nicht angezeigt werden`,
  pastNothing: (moment) => `Keine Daten für ${moment}`,
  pastReach: (from) => `Aufzeichnung ab ${from}.`,
  pastReachNothing: 'Noch ist nichts aufgezeichnet.',
  pastFault: (wanted) => `${wanted} konnte nicht geladen werden.`,
  pastFaultShown: (shown, why) => `Angezeigt wird ${shown}; die Seite versucht es weiter. ${why}`,
  phasePast: {
    connecting: 'Vergangen · verbindet',
    live: 'Vergangen',
    stale: 'Vergangen · kein Signal',
    offline: 'Vergangen · Zwilling offline',
    reconnecting: 'Vergangen · verbindet neu',
  },
  backToLive: 'Zurück zu Live',
  backToRecording: 'Zurück zur Aufzeichnung',
  frozenBehindPast: (clock) => `Keine Live-Daten mehr. Letzte Daten um ${clock}`,
  frozenPastStays: 'Die gezeigte Vergangenheit ist nicht betroffen.',
  meanwhileShow: (tag) => `Zurück zu Live, zu Messpunkt ${tag}`,

  timebar: 'Zeitleiste',
  timebarSlider: 'Angezeigte Zeit',
  timebarLive: 'Live',
  timebarPeriod: 'Zeitraum',
  timebarPeriods: {
    hour: 'Letzte Stunde',
    day: 'Letzter Tag',
    week: 'Letzte Woche',
    month: 'Letzter Monat',
    all: 'Alles',
    own: 'Eigener Zeitraum',
  },
  timebarFrom: 'Von',
  timebarTo: 'Bis',
  timebarOwnHint: 'Der Anfang muss vor dem Ende liegen',
  timebarOwnSimHint: 'hh:mm:ss seit Beginn der Simulation',
  timebarPlay: 'Abspielen',
  timebarPause: 'Anhalten',
  timebarSpeed: 'Geschwindigkeit',
  timebarMarks: 'Was die Zeichen bedeuten',
  timebarMark: {
    scans: 'Balken nach oben: Messungen',
    failures: 'Balken nach unten: fehlgeschlagene Versuche',
    pest: 'gefülltes Dreieck: Schädlinge festgestellt',
    cleared: 'leerer Ring: Schädlinge weg',
    silence: 'schraffiert: kein Messversuch',
    before: 'gegenläufig schraffiert: nicht aufgezeichnet oder nicht mehr gespeichert',
    run: 'gestrichelte Linie: Uhr zurückgesetzt',
  },
  timebarCounts: (scans, failures, seen, cleared) =>
    [
      counted(scans, 'Messung', 'Messungen'),
      ...(failures > 0 ? [`${failures} fehlgeschlagen`] : []),
      ...(seen > 0 ? [counted(seen, 'Schädlingsfund', 'Schädlingsfunde')] : []),
      ...(cleared > 0 ? [counted(cleared, 'Schädling weg', 'Schädlinge weg')] : []),
    ].join(', '),
  timebarOff: 'Keine früheren Daten: Dieser Zwilling zeichnet nichts auf.',
  timebarOffHint: 'Die Aufzeichnung wird beim Start des Zwillings eingeschaltet.',
};
