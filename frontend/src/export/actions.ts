/** The exports, as buttons and menu call them. */
import { clockText, readingText } from '../domain/format';
import { sensorColour, rgbText } from '../domain/ramp';
import { sensorNamed } from '../domain/sensors';
import { filterRows, rowsOf, sortRows, tableCsv } from '../domain/table';
import { contextOf, newCanvas } from '../draw/surface';
import { store } from '../store/app';
import { selectHealth, selectRange, selectSensors } from '../store/derived';
import { S } from '../strings';
import { epochOf } from '../ui/useNow';
import { fileName, save } from './save';

/** The table as the operator sees it: filtered and sorted. */
export function saveTable(): void {
  const state = store.get();
  const { snapshot } = state.twin;
  if (!snapshot) return;
  const { sort, filter, health } = state.view;
  const rows = sortRows(
    filterRows(rowsOf(snapshot.tags, selectHealth(state)), filter, health),
    sort,
  );
  const text = tableCsv(rows, selectSensors(state), state.settings.unit, performance.now());
  save(
    new Blob([text], { type: 'text/csv;charset=utf-8' }),
    fileName('tags', 'csv', epochOf(snapshot.takenAt)),
  );
}

const FOOTER_PX = 40;

/** The map as the operator sees it, with a line that says what and when. */
export async function saveMap(): Promise<void> {
  const layers = [...document.querySelectorAll<HTMLCanvasElement>('canvas[data-layer]')];
  const [first] = layers;
  const state = store.get();
  if (!first || first.width === 0 || !state.twin.snapshot) return;
  const ratio = first.width / Math.max(1, first.clientWidth);
  const style = getComputedStyle(document.documentElement);
  const canvas = newCanvas(first.width, first.height + FOOTER_PX * ratio);
  const context = contextOf(canvas);
  context.fillStyle = style.getPropertyValue('--surface');
  context.fillRect(0, 0, canvas.width, canvas.height);
  for (const layer of layers) context.drawImage(layer, 0, 0);

  const sensor = sensorNamed(state.view.sensor);
  const range = selectRange(state);
  const takenAt = epochOf(state.twin.snapshot.takenAt);
  const { unit } = state.settings;
  const limits = range
    ? `${readingText(sensor, range.low, unit)} – ${readingText(sensor, range.high, unit)}`
    : S.legendNoTags;
  const date = new Date(takenAt).toLocaleDateString('en-CA');
  context.setTransform(ratio, 0, 0, ratio, 0, first.height);
  context.fillStyle = rgbText(sensorColour(sensor));
  context.fillRect(14, 14, 12, 12);
  context.fillStyle = style.getPropertyValue('--ink');
  context.font = '500 13px "Inter Variable", system-ui, sans-serif';
  context.textBaseline = 'middle';
  const text = S.pngFooter(sensor.label, limits, `${date} ${clockText(takenAt)}`);
  context.fillText(text, 34, FOOTER_PX / 2 + 0.5);

  const blob = await new Promise<Blob | null>((resolve) => {
    canvas.toBlob(resolve, 'image/png');
  });
  if (blob) save(blob, fileName('map', 'png', takenAt));
}

/** Copies the address of this view; true when the clipboard took it. */
export async function copyLink(): Promise<boolean> {
  // Only secure contexts have a clipboard, and a greenhouse's plain http is none: hence the
  // look at a property whose type claims that it is always there.
  const clipboard = navigator.clipboard as Clipboard | undefined;
  if (!clipboard) return false;
  return clipboard.writeText(window.location.href).then(
    () => true,
    () => false,
  );
}
