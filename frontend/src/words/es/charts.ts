/** Las gráficas y sus tablas. */
import type { CHARTS as ENGLISH } from '../en/charts';
import type { In } from '../shape';
import { counted } from './counted';

export const CHARTS: In<typeof ENGLISH> = {
  charts: 'Gráficas',
  chartOf: (sensor) => `Gráfica: ${sensor}`,
  chartsBy: { tag: 'Un punto', sensor: 'Varios puntos' },
  chartsByLegend: 'Qué se muestra',
  chartSpan: (from, to) => `${from} a ${to}`,
  chartSummary: (count, latest, at, low, high, gaps) =>
    `${counted(count, 'lectura', 'lecturas')}, la última ${latest} (${at}), ` +
    `entre ${low} y ${high}, ${gaps === 0 ? 'sin huecos' : counted(gaps, 'hueco', 'huecos')}.`,
  chartEmpty: 'No hay lecturas en este periodo.',
  chartNeedsDay: (known) =>
    known === null
      ? 'Requiere 24 h de lecturas sin huecos de más de 3 h'
      : `Requiere 24 h de lecturas; hasta ahora ${known}`,
  chartLoading: 'Cargando el histórico',
  chartFailed: (reason) =>
    `No se pudo cargar el histórico; la página lo sigue intentando. ${reason}`,
  chartMissing: 'Este gemelo no registra nada.',
  chartMissingHint: 'Sin registro no hay gráficas: la ficha solo muestra las últimas mediciones.',
  chartMissingMore:
    'Inicie el gemelo sin «journal:=off» o indique un archivo en el parámetro «journal».',
  chartMissingShort: 'Sin gráfica: este gemelo no registra nada.',
  chartNoTime: 'El gemelo aún no tiene hora: todavía no hay histórico.',
  chartIdealsDiffer: 'El rango ideal depende de la especie',
  chartNoSensors: 'Este punto no tiene sensores.',
  chartTable: 'Mostrar como tabla',
  chartPlots: 'Mostrar como gráfica',
  chartDayBefore: 'Día anterior',
  chartBeforeWas: (value) => `día anterior ${value}`,
  chartWhole: 'Todo el periodo',
  chartCsvShown: 'CSV de la vista',
  chartCsvAll: 'CSV de todas las lecturas',
  chartAddTag: 'Añadir un punto',
  chartRemoveTag: (tag) => `Quitar el punto ${tag} de la gráfica`,
  chartWhich: 'Tabla de',
  chartHint: 'Arrastre para ampliar; haga clic para ir a ese momento.',
  chartColumns: {
    time: 'Hora',
    until: 'Hasta',
    value: 'Valor',
    count: 'Lecturas',
    mean: 'Media',
    min: 'Mínimo',
    max: 'Máximo',
    event: 'Evento',
  },
  chartGap: (length) => `sin datos durante ${length}`,
  missing: { not_kept: 'ya no se conserva', not_recorded: 'sin registro' },
  chartFailures: (count) => counted(count, 'intento fallido', 'intentos fallidos'),
  chartLooks: (count) => counted(count, 'revisión de flores', 'revisiones de flores'),
};
