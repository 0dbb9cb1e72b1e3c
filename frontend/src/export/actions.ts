/** The exports, as buttons and menu call them. */
import { epochOf } from '../clock';
import { momentText, readingText, valueText } from '../domain/format';
import { sensorColour } from '../domain/ramp';
import { sensorNamed } from '../domain/sensors';
import { tableCsv } from '../domain/table';
import { shown } from '../domain/text';
import { drawFooter, FOOTER_PX, type Footer } from '../draw/footer';
import { contextOf, newCanvas } from '../draw/surface';
import { commandMap } from '../map/commands';
import { store } from '../store/app';
import { selectRange, selectRows, selectSensors } from '../store/derived';
import { selectSnapshot } from '../store/moment';
import { fileName, save } from './save';

/** The table as the operator sees it, filtered and sorted; ages are those of the state's time. */
export function saveTable(): void {
  const state = store.get();
  const snapshot = selectSnapshot(state);
  if (!snapshot) return;
  const { unit } = state.settings;
  const text = tableCsv(selectRows(state), selectSensors(state), unit, snapshot.takenAt);
  save(
    new Blob([text], { type: 'text/csv;charset=utf-8' }),
    fileName('tags', 'csv', epochOf(snapshot.takenAt)),
  );
}

/** The map as the operator sees it, with a footer that says what, when and how large. */
export async function saveMap(): Promise<void> {
  const layers = [...document.querySelectorAll<HTMLCanvasElement>('canvas[data-layer]')];
  const [first] = layers;
  const state = store.get();
  const snapshot = selectSnapshot(state);
  if (!first || first.width === 0 || !snapshot) return;
  const ratio = first.width / Math.max(1, first.getBoundingClientRect().width);
  const style = getComputedStyle(document.documentElement);
  const canvas = newCanvas(first.width, first.height + FOOTER_PX * ratio);
  const context = contextOf(canvas);
  commandMap({
    type: 'picture',
    take: () => {
      for (const layer of layers) context.drawImage(layer, 0, 0);
    },
  });

  const sensor = sensorNamed(state.view.sensor);
  const range = selectRange(state);
  const takenAt = epochOf(snapshot.takenAt);
  const { unit } = state.settings;
  const footer: Footer = {
    title: shown(sensor.label, 32),
    time: momentText(takenAt),
    ends: range && [valueText(sensor, range.low, unit), readingText(sensor, range.high, unit)],
    colour: sensorColour(sensor),
    scale: state.viewport.view.scale,
  };
  context.setTransform(ratio, 0, 0, ratio, 0, first.height);
  drawFooter(context, first.width / ratio, footer, {
    ink: style.getPropertyValue('--ink'),
    surface: style.getPropertyValue('--surface'),
  });

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
