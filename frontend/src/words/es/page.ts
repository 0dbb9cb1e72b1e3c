/** La página misma: conexión, averías, menú, ayuda, lo que uno se lleva. */
import type * as EN from '../en/page';
import type { In } from '../shape';
import { counted } from './counted';

export const PAGE: In<typeof EN.PAGE> = {
  product: 'Lupin twin',
  subtitle: 'Invernadero',
  skipToTable: 'Ir a la tabla de puntos de medida',
  more: 'Más detalles',

  language: 'Idioma',
  languageMissing: (name) => `No se pudo cargar ${name}: la página se muestra en inglés.`,
  partsLate: 'Una parte de la página no se ha cargado.',
  partsLateHint:
    'Las fichas, las listas y la barra de tiempo aparecerán cuando el servidor responda. La página lo sigue intentando.',

  phase: {
    connecting: 'Conectando',
    live: 'En directo',
    stale: 'Sin señal',
    offline: 'Gemelo inactivo',
    noTime: 'Hora desconocida',
    reconnecting: 'Reconectando',
  },
  phaseLabel: 'Conexión',
  retryNow: 'Reintentar',
  frozenSince: (clock) => `Últimos datos a las ${clock}`,
  agoSuffix: (age) => `hace ${age}`,
  hours: 'h',
  frozenWhy: {
    stale: 'La conexión está abierta, pero no llegan datos.',
    reconnecting: 'Sin conexión con el servidor.',
    connecting: 'Esperando la respuesta del servidor.',
    offline: 'El servidor responde, pero el gemelo digital no.',
  },
  clockTodo: {
    no_clock: 'Inicie la simulación o la grabación.',
    clock_stopped: 'Revise la simulación o la grabación.',
    clock_doubted: 'Ponga en hora el reloj del gemelo digital.',
  },
  offlineWhy: {
    no_clock:
      'El gemelo digital toma de ella la hora y aún no la tiene. Se desconoce la antigüedad de las lecturas.',
    clock_stopped:
      'El gemelo digital toma de ella la hora, que se ha parado. Se desconoce la antigüedad de las lecturas.',
    clock_doubted:
      'Va atrasado respecto a los datos registrados. Hasta que se ponga en hora, como mucho diez minutos, se desconoce la antigüedad de las lecturas y no se registra nada.',
    clock_ahead:
      'Va adelantado respecto al archivo central; se desconoce la antigüedad de las lecturas.',
    never_seen: 'El servidor aún no ha recibido nada de un gemelo digital. ¿Está encendido?',
    stale: 'El gemelo digital ha dejado de enviar. Compruebe que está en marcha.',
    thread_dead: 'El servidor ha perdido el contacto con el gemelo digital y hay que reiniciarlo.',
    shutting_down: 'El servidor se está apagando.',
  },
  offlineMore: {
    no_clock: 'El gemelo digital funciona con tiempo simulado y no llega nada por /clock.',
    clock_stopped: 'El gemelo digital funciona con tiempo simulado y ya no llega nada por /clock.',
    never_seen:
      'El gemelo y el puente («bridge») deben estar en el mismo dominio de ROS (ROS_DOMAIN_ID).',
    stale: 'El puente («bridge») funciona, pero ya no se publica nada en /twin/state.',
    thread_dead: 'El hilo de ROS del puente («bridge») ha terminado; su registro dice por qué.',
  },

  serverBusy: 'Servidor sobrecargado o inaccesible',
  unread: (count) =>
    count === 1
      ? 'Un mensaje del servidor no se pudo leer y se descartó.'
      : `${count} mensajes del servidor no se pudieron leer y se descartaron.`,
  paused: 'El tiempo está en pausa.',
  pausedHint: 'La simulación o la grabación está en pausa; la antigüedad no aumenta.',
  mixture:
    'Más de un gemelo digital envía datos. La página muestra una mezcla: detenga todos menos uno.',
  inputProblem: 'Parte de los datos no llega.',
  drops: (count) =>
    `El gemelo digital ha descartado ${counted(count, 'mensaje', 'mensajes')} en los últimos minutos.`,
  journal: {
    off: {
      title: 'El registro está desactivado.',
      hint: 'Tras un reinicio, se pierden todos los datos anteriores.',
    },
    slow: {
      title: 'El registro va con retraso.',
      hint: 'Los datos esperan en memoria hasta que el disco dé abasto. Con un corte de luz se perderían.',
    },
    failing: {
      title: 'El registro está fallando.',
      hint: 'El gemelo digital sigue en marcha. Si el disco está lleno, libere espacio; si es de solo lectura, permita la escritura. El registro se reanudará solo.',
    },
    upgrading: {
      title: 'El registro de una versión anterior se está actualizando.',
      hint: 'Los datos nuevos se muestran, pero aún no se registran. Los anteriores vuelven al terminar; puede tardar unos minutos.',
    },
    in_use: {
      title: 'Este gemelo digital no registra: otro usa su archivo.',
      hint: 'Detenga uno de los dos o dé a este un archivo propio.',
    },
    foreign: {
      title: 'Este gemelo digital no registra: no puede leer su archivo.',
      hint: 'Su contenido no se ha tocado. Dé al gemelo digital otro archivo o mueva este.',
    },
  },
  notificationChannels: {
    mqtt: 'La domótica (MQTT) no recibe datos.',
    webhook: 'El webhook no recibe alarmas.',
    push: 'Los teléfonos no reciben alarmas.',
  },
  notificationOther: (channel) => `${channel} no recibe datos.`,
  notificationHint: 'El servidor lo sigue intentando. Esta página no se ve afectada.',
  journalMore:
    'El archivo lo indica el parámetro «journal» del gemelo digital; con «off» no se registra nada.',
  origin: { simulated: 'Simulado', recorded: 'Grabado', sim_time: 'Tiempo simulado' },
  originDay: (length: string): string => `1 día de invernadero = ${length}`,
  originHint: {
    simulated: 'No hay robot real: el invernadero, las plantas y las lecturas son simulados.',
    recorded: 'Se reproduce una grabación: nada de esto es en directo.',
    sim_time: 'No es la hora real: los datos vienen de una simulación o de una grabación.',
  },
  recordedIs: { playing: 'Reproduciendo', paused: 'En pausa' },
  recordedPaused: 'La grabación está en pausa.',
  recordedPausedHint: 'Está en pausa o ha terminado; la antigüedad no aumenta.',
  simulated: 'Simulado.',
  simulatedHint: (until) => `Los datos hasta ${until} son de demostración, no medidos.`,
  quarantined: 'Se ha puesto en cuarentena un registro dañado.',
  quarantinedHint: (name) =>
    `Se han conservado los datos legibles y el registro continúa. El archivo dañado es ${name}.`,
  failedTitle: 'La página ha fallado',
  failedHint:
    'No se fíe de lo que muestra. El gemelo digital y el servidor no se ven afectados. La página se recarga sola.',
  reload: 'Recargar',

  menu: 'Menú',
  unit: 'Temperatura',
  theme: 'Aspecto',
  themes: { system: 'Sistema', light: 'Claro', dark: 'Oscuro' },
  savePng: 'Guardar el mapa como PNG',
  saveCsv: 'Guardar la tabla como CSV',
  saveCsvShort: 'CSV',
  report: 'Informe de turno',
  print: 'Imprimir',
  kiosk: 'Pantalla mural',
  kioskLeave: 'Salir',
  help: 'Atajos de teclado',
  signOut: 'Cerrar sesión',
  signOutFailed: (reason) => `La sesión sigue abierta: ${reason}`,
  exportFailed: (reason) => `No se ha guardado nada: ${reason}`,

  emptyConnecting: 'Conectando con el servidor',
  emptyConnectingHint: 'El invernadero aparecerá en cuanto responda.',
  emptyUnreachable: 'El servidor no responde',
  emptyUnreachableHint: 'Compruebe que está encendido. La página lo sigue intentando.',
  emptyUnreachableMore:
    'El servidor es el puente («bridge»): «lupin-twin serve» en el robot, o «make run» para la demostración.',
  emptyNoTwin: 'Aún no hay datos',
  emptyNoTags: 'Aún no hay puntos de medida',
  emptyNoTagsHint: 'Los puntos aparecen cuando el robot los encuentra o los mide: inicie su ronda.',
  emptyNoTagsMore: '«lupin-twin demo» muestra una ronda simulada.',
  emptyNoPins: 'Ningún punto tiene posición todavía',
  emptyNoPinsHint:
    'Todos los puntos están en la tabla; con la primera medición correcta aparecen en el mapa.',
  emptyNoReading: (sensor) => `Aún no hay lecturas en el mapa: ${sensor}`,
  emptyNoReadingHint: 'Elija otro sensor o espere a que el robot mida más puntos.',
  emptyNoMap: 'Aún no hay plano',
  emptyNoMapMore: 'El robot aún no ha enviado su mapa SLAM, que llega por /map.',

  helpGlobal: 'En cualquier parte',
  helpMap: 'En el mapa',
  helpTime: 'En la barra de tiempo',
  helpToggle: 'Atajos de una sola tecla',
  keys: {
    global: [
      ['1 a 9', 'Elegir un sensor'],
      ['/', 'Filtrar la tabla'],
      ['F', 'Mostrar todo en el mapa'],
      ['N, P', 'Punto siguiente y anterior'],
      ['Y', 'Capas'],
      ['A', 'Alarmas'],
      ['C', 'Gráficas del punto elegido'],
      ['L', 'Volver al directo'],
      ['Espacio', 'Reproducir o pausar el histórico'],
      ['Esc', 'Cerrar; después, volver al directo'],
      ['?', 'Esta lista'],
    ],
    time: [
      ['← →', 'Un paso atrás o adelante; con Mayús, diez'],
      ['Pág ↑ ↓', 'Una décima parte de la barra'],
      ['Inicio', 'Al principio'],
      ['Fin', 'En directo'],
    ],
    map: [
      ['← ↑ ↓ →', 'Mover; más deprisa con Mayús'],
      ['+  −', 'Acercar y alejar'],
      ['0', 'Mostrar todo'],
      ['Intro', 'Abrir el punto más cercano'],
    ],
  },

  paper: (taken, printed) => `Datos: ${taken}. Impreso: ${printed}`,
  paperRest: (printed, all) =>
    `Se imprimen los primeros ${printed} de ${all} puntos. El CSV los contiene todos.`,
  asOf: (moment) => `datos: ${moment}`,
};

/** Otro momento que no es ahora, y la barra de tiempo. */
export const PAST: In<typeof EN.PAST> = {
  past: 'Histórico',
  pastTitle: (moment) => `${moment} (histórico) · Lupin twin`,
  pastFetching: (moment) => `Cargando ${moment}`,
  pastFetchingHint: 'No se muestra nada hasta que se cargue.',
  pastFailed: (moment) => `No se puede mostrar ${moment}`,
  pastFuture: 'Ese momento está en el futuro.',
  pastNothing: (moment) => `Sin datos de ${moment}`,
  pastReach: (from) => `Hay datos registrados desde ${from}.`,
  pastReachNothing: 'Aún no hay nada registrado.',
  pastFault: (wanted, why) => `No se pudo cargar ${wanted} (${why}).`,
  pastFaultShown: (shown) => `Se muestra ${shown} mientras la página lo reintenta.`,
  backToLive: 'Volver al directo',
  backToRecording: 'Volver a la grabación',
  frozenBehindPast: (clock) => `Ya no llegan datos en directo. Los últimos, a las ${clock}`,
  frozenPastStays: 'El histórico que se muestra no se ve afectado.',
  meanwhileShow: (tag) => `Volver al directo, al punto ${tag}`,

  timebar: 'Barra de tiempo',
  timebarSlider: 'Momento mostrado',
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
    cleared: 'anillo vacío: de nuevo sin plaga',
    silence: 'rayado: no se intentó medir',
    before: 'rayado inverso: sin registro, o ya no se conserva',
    run: 'línea discontinua: el reloj volvió atrás',
  },
  timebarCounts: (scans, failures, seen, cleared) =>
    [
      counted(scans, 'medición', 'mediciones'),
      ...(failures > 0 ? [counted(failures, 'fallida', 'fallidas')] : []),
      ...(seen > 0 ? [counted(seen, 'plaga detectada', 'plagas detectadas')] : []),
      ...(cleared > 0 ? [`${cleared} de nuevo sin plaga`] : []),
    ].join(', '),
};
