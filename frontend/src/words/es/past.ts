/** Otro momento que no es ahora, y la barra de tiempo. */
import type { PAST as ENGLISH } from '../en/past';
import type { In } from '../shape';
import { counted } from './counted';

export const PAST: In<typeof ENGLISH> = {
  past: 'Pasado',
  pastTitle: (moment) => `${moment} (pasado) · Lupin twin`,
  pastFetching: (moment) => `Cargando ${moment}`,
  pastFetchingHint: 'No se muestra nada hasta que se cargue.',
  pastFailed: (moment) => `No se puede mostrar ${moment}`,
  pastNothing: (moment) => `Sin datos de ${moment}`,
  pastReach: (from) => `Hay datos registrados desde ${from}.`,
  pastReachNothing: 'Aún no hay nada registrado.',
  pastFault: (wanted) => `No se pudo cargar ${wanted}.`,
  pastFaultShown: (shown, why) => `Se muestra ${shown} mientras la página lo reintenta. ${why}`,
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
  frozenPastStays: 'El pasado que se muestra no se ve afectado.',
  meanwhileShow: (tag) => `Volver al directo, al punto ${tag}`,

  timebar: 'Barra de tiempo',
  timebarSlider: 'Momento mostrado',
  timebarLive: 'En directo',
  timebarPeriod: 'Periodo',
  timebarPeriods: {
    hour: 'Última hora',
    day: 'Último día',
    week: 'Última semana',
    month: 'Último mes',
    all: 'Todo',
    own: 'Personalizado',
  },
  timebarFrom: 'Desde',
  timebarTo: 'Hasta',
  timebarOwnHint: 'El principio debe ser anterior al final',
  timebarOwnSimHint: 'hh:mm:ss desde el inicio de la simulación',
  timebarPlay: 'Reproducir',
  timebarPause: 'Pausar',
  timebarSpeed: 'Velocidad',
  timebarMarks: 'Qué significan las marcas',
  timebarMark: {
    scans: 'barra hacia arriba: mediciones',
    failures: 'barra hacia abajo: intentos fallidos',
    pest: 'triángulo lleno: plaga detectada',
    cleared: 'anillo vacío: plaga desaparecida',
    silence: 'rayado: no se intentó medir',
    before: 'rayado inverso: sin registro, o ya no se conserva',
    run: 'línea discontinua: el reloj volvió atrás',
  },
  timebarCounts: (scans, failures, seen, cleared) =>
    [
      counted(scans, 'medición', 'mediciones'),
      ...(failures > 0 ? [counted(failures, 'fallida', 'fallidas')] : []),
      ...(seen > 0 ? [counted(seen, 'plaga detectada', 'plagas detectadas')] : []),
      ...(cleared > 0 ? [counted(cleared, 'plaga desaparecida', 'plagas desaparecidas')] : []),
    ].join(', '),
  timebarOff: 'Sin histórico: este gemelo no registra nada.',
  timebarOffHint: 'El registro se activa al iniciar el gemelo.',
};
