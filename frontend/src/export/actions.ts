/** The exports, as buttons and menu call them. */
import { epochOf } from '../clock';
import { differenceText, divergingColours, signedText } from '../domain/difference';
import { readingText, valueText } from '../domain/format';
import { IDEAL_ALPHA, idealParts } from '../domain/ideal';
import { sensorColour } from '../domain/ramp';
import { dateText, rosText, secondsOf } from '../domain/rostime';
import { tableCsv } from '../domain/table';
import { shown } from '../domain/text';
import { drawFooter, FOOTER_PX, type Footer } from '../draw/footer';
import { contextOf, newCanvas } from '../draw/surface';
import { commandMap } from '../map/commands';
import { store } from '../store/app';
import {
  selectCatalogue,
  selectColouring,
  selectColumns,
  selectHeat,
  selectRange,
  selectRows,
  selectSensor,
} from '../store/derived';
import { selectShown } from '../store/moment';
import { selectHasOwnTime, selectOrigin } from '../store/origin';
import { S } from '../strings';
import { fileName, pastFileName, save } from './save';

/**
 * The table as the operator sees it, filtered and sorted; ages are those of the state's time. Asked
 * for in the page's first moments, it comes once the sensors' own names and units are there.
 */
export function saveTable(): void {
  const isKnown = (): boolean => store.get().twin.sensors.state !== 'waiting';
  if (isKnown()) {
    writeTable();
    return;
  }
  const stop = store.subscribe(() => {
    if (!isKnown()) return;
    stop();
    writeTable();
  });
}

function writeTable(): void {
  const state = store.get();
  const { snapshot, moment } = selectShown(state);
  if (!snapshot) return;
  const { unit } = state.settings;
  const text = tableCsv(
    selectRows(state),
    selectCatalogue(state),
    selectColumns(state),
    unit,
    snapshot.takenAt,
  );
  save(
    new Blob([text], { type: 'text/csv;charset=utf-8' }),
    moment === null
      ? fileName('tags', 'csv', epochOf(snapshot.takenAt))
      : pastFileName('tags', 'csv', moment),
  );
}

/** The map as the operator sees it, with a footer that says what, when and how large. */
export async function saveMap(): Promise<void> {
  const layers = [...document.querySelectorAll<HTMLCanvasElement>('canvas[data-layer]')];
  const [first] = layers;
  const state = store.get();
  const { snapshot, moment } = selectShown(state);
  if (!first || first.width === 0 || !snapshot) return;
  // Not as it is laid out: behind the table of a phone it has no size.
  const ratio = first.width / (parseFloat(first.style.width) || first.width);
  const style = getComputedStyle(document.documentElement);
  const canvas = newCanvas(first.width, first.height + FOOTER_PX * ratio);
  const context = contextOf(canvas);
  commandMap({
    type: 'picture',
    take: () => {
      for (const layer of layers) context.drawImage(layer, 0, 0);
    },
  });

  const sensor = selectSensor(state);
  const range = selectRange(state);
  const isIdeal = selectColouring(state) === 'ideal';
  const takenAt = epochOf(snapshot.takenAt);
  const { unit } = state.settings;
  const label = shown(sensor.label, 32);
  const { difference, range: change } = selectHeat(state) ?? {};
  const origin = selectOrigin(state);
  // Of a run with a time of its own: that, and not when it came here.
  const then = moment ?? (selectHasOwnTime(state) ? secondsOf(snapshot.at) : null);
  const time = then === null ? dateText(takenAt) : S.asOf(rosText(then));
  const footer: Footer = {
    colour: sensorColour(sensor),
    maxAlpha: sensor.maxAlpha,
    scale: state.viewport.view.scale,
    ...(difference && change
      ? {
          title: S.difference(label),
          time: S.differenceTimes(rosText(difference.at), rosText(difference.against)),
          ends: [signedText(sensor, change.low, unit), differenceText(sensor, change.high, unit)],
          diverging: divergingColours(),
        }
      : {
          title: isIdeal ? S.legendAgainst(label) : label,
          time: origin === null ? time : `${S.origin[origin]}, ${time}`,
          ...(isIdeal
            ? {
                ends: [S.below, S.above] as const,
                diverging: Object.values(idealParts(IDEAL_ALPHA)).flat(),
              }
            : {
                ends: range && [
                  valueText(sensor, range.low, unit),
                  readingText(sensor, range.high, unit),
                ],
              }),
        }),
  };
  context.setTransform(ratio, 0, 0, ratio, 0, first.height);
  drawFooter(context, first.width / ratio, footer, {
    ink: style.getPropertyValue('--ink'),
    surface: style.getPropertyValue('--surface'),
  });

  const blob = await new Promise<Blob | null>((resolve) => {
    canvas.toBlob(resolve, 'image/png');
  });
  if (blob)
    save(
      blob,
      moment === null ? fileName('map', 'png', takenAt) : pastFileName('map', 'png', moment),
    );
}
