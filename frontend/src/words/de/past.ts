/** Ein anderer Zeitpunkt als jetzt, und die Zeitleiste. */
import type { PAST as ENGLISH } from '../en/past';
import type { In } from '../shape';
import { counted } from './counted';

export const PAST: In<typeof ENGLISH> = {
  past: 'Vergangenheit',
  pastTitle: (moment) => `${moment} (vergangen) · Lupin twin`,
  pastFetching: (moment) => `${moment} wird geladen`,
  pastFetchingHint: 'Bis dahin wird nichts gezeigt.',
  pastFailed: (moment) => `${moment} kann nicht gezeigt werden`,
  pastNothing: (moment) => `Von ${moment} ist nichts bekannt`,
  pastReach: (from) => `Die Aufzeichnung beginnt ${from}.`,
  pastReachNothing: 'Noch ist nichts aufgezeichnet.',
  pastFault: (wanted) => `${wanted} konnte nicht geladen werden.`,
  pastFaultShown: (shown, why) => `Gezeigt wird ${shown}; es wird weiter versucht. ${why}`,
  phasePast: {
    connecting: 'Vergangen · verbindet',
    live: 'Vergangen',
    stale: 'Vergangen · kein Signal',
    offline: 'Vergangen · Zwilling offline',
    reconnecting: 'Vergangen · verbindet neu',
  },
  backToLive: 'Zurück zu live',
  backToRecording: 'Zurück zur Aufzeichnung',
  frozenBehindPast: (clock) => `Live kommt nichts mehr an. Letzte Daten um ${clock}`,
  frozenPastStays: 'Was gezeigt wird, ist vergangen und bleibt.',
  meanwhileShow: (tag) => `Zurück zu live, zu Messpunkt ${tag}`,

  timebar: 'Zeitleiste',
  timebarSlider: 'Gezeigte Zeit',
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
  timebarOwnHint: 'Der Anfang liegt vor dem Ende',
  timebarOwnSimHint: 'hh:mm:ss seit Beginn der Simulation',
  timebarPlay: 'Abspielen',
  timebarPause: 'Anhalten',
  timebarSpeed: 'Geschwindigkeit',
  timebarSpeeds: (speed) => `${speed}×`,
  timebarMarks: 'Was die Zeichen bedeuten',
  timebarMark: {
    scans: 'Balken nach oben: Messungen',
    failures: 'Balken nach unten: gescheiterte Versuche',
    pest: 'volles Dreieck: Schädling gesehen',
    cleared: 'leerer Ring: Schädling weg',
    silence: 'schräge Linien: es wurde nichts versucht',
    before: 'andersherum schräg: nicht aufgezeichnet oder nicht mehr aufbewahrt',
    run: 'gestrichelte Linie: die Uhr begann von vorn',
  },
  timebarCounts: (scans, failures, seen, cleared) =>
    [
      counted(scans, 'Messung', 'Messungen'),
      ...(failures > 0 ? [`${failures} gescheitert`] : []),
      ...(seen > 0 ? [counted(seen, 'Schädling gesehen', 'Schädlinge gesehen')] : []),
      ...(cleared > 0 ? [counted(cleared, 'Schädling weg', 'Schädlinge weg')] : []),
    ].join(', '),
  timebarOff: 'Kein Rückblick: Dieser Zwilling merkt sich nichts.',
  timebarOffHint:
    'Hier wird nichts aufgezeichnet, also gibt es nichts zum Zurückblicken. Wer den Zwilling betreibt, kann die Aufzeichnung einschalten.',
  timebarFailed: (reason) => `Die Aufzeichnung konnte nicht gelesen werden: ${reason}`,
};
