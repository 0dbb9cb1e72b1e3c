/** Otro momento que no es ahora, y la barra de tiempo. */
import type { PAST as ENGLISH } from '../en/past';
import type { In } from '../shape';
import { counted } from './counted';

export const PAST: In<typeof ENGLISH> = {
  past: 'Pasado',
  pastTitle: (moment) => `${moment} (pasado) · Lupin twin`,
  pastFetching: (moment) => `Obteniendo ${moment}`,
  pastFetchingHint: 'No se muestra nada hasta que llegue.',
  pastFailed: (moment) => `No se puede mostrar ${moment}`,
  pastNothing: (moment) => `No se sabe nada de ${moment}`,
  pastReach: (from) => `El registro empieza el ${from}.`,
  pastReachNothing: 'Aún no hay nada registrado.',
  pastFault: (wanted) => `No se pudo obtener ${wanted}.`,
  pastFaultShown: (shown, why) => `Se muestra ${shown}; se vuelve a intentar. ${why}`,
  phasePast: {
    connecting: 'Pasado · conectando',
    live: 'Pasado',
    stale: 'Pasado · sin señal',
    offline: 'Pasado · sin gemelo',
    reconnecting: 'Pasado · reconectando',
  },
  backToLive: 'Volver al directo',
  backToRecording: 'Volver a la grabación',
  frozenBehindPast: (clock) => `Ya no llegan datos en directo. Los últimos, a las ${clock}`,
  frozenPastStays: 'Lo que se muestra es pasado y permanece.',
  meanwhileShow: (tag) => `Volver al directo, al punto ${tag}`,

  timebar: 'Barra de tiempo',
  timebarSlider: 'Momento mostrado',
  timebarLive: 'Directo',
  timebarPeriod: 'Periodo',
  timebarPeriods: {
    hour: 'Última hora',
    day: 'Último día',
    week: 'Última semana',
    month: 'Último mes',
    all: 'Todo',
    own: 'Periodo propio',
  },
  timebarFrom: 'Desde',
  timebarTo: 'Hasta',
  timebarOwnHint: 'El principio va antes que el final',
  timebarOwnSimHint: 'hh:mm:ss desde el inicio de la simulación',
  timebarPlay: 'Reproducir',
  timebarPause: 'Pausar',
  timebarSpeed: 'Velocidad',
  timebarSpeeds: (speed) => `${speed}×`,
  timebarMarks: 'Qué significan las marcas',
  timebarMark: {
    scans: 'barra hacia arriba: mediciones',
    failures: 'barra hacia abajo: intentos fallidos',
    pest: 'triángulo lleno: plaga vista',
    cleared: 'anillo vacío: plaga desaparecida',
    silence: 'líneas inclinadas: no se intentó nada',
    before: 'inclinadas al revés: sin registro, o ya no se conserva',
    run: 'línea discontinua: el reloj empezó de nuevo',
  },
  timebarCounts: (scans, failures, seen, cleared) =>
    [
      counted(scans, 'medición', 'mediciones'),
      ...(failures > 0 ? [counted(failures, 'fallida', 'fallidas')] : []),
      ...(seen > 0 ? [counted(seen, 'plaga vista', 'plagas vistas')] : []),
      ...(cleared > 0 ? [counted(cleared, 'plaga desaparecida', 'plagas desaparecidas')] : []),
    ].join(', '),
  timebarOff: 'No se puede mirar atrás: este gemelo no recuerda nada.',
  timebarOffHint:
    'Aquí no se graba nada, así que no hay pasado que mirar. Quien lleva el gemelo puede activar la grabación.',
  timebarFailed: (reason) => `No se pudo obtener el registro: ${reason}`,
};
