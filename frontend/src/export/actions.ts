/** Export actions, for buttons and the menu. */
import { epochOf, now as pageNow, timeZone } from '../clock';
import { differenceText, signedText } from '../domain/difference';
import { errorNumber, readingText, valueText, withUnit } from '../domain/format';
import { tableCsv } from '../domain/table';
import { shown } from '../domain/text';
import { dateText, rosText, type Span, spanOf } from '../domain/time';
import { contextOf, newCanvas } from '../draw/surface';
import { toFragment } from '../store/address';
import { type AppState, store } from '../store/app';
import {
  selectCatalogue,
  selectColouring,
  selectColumns,
  selectHeat,
  selectRange,
  selectRows,
  selectSensor,
} from '../store/derived';
import { rosNow, selectHasOwnTime, selectOrigin, selectShown } from '../store/moment';
import { isChosen } from '../store/view';
import { LANGUAGE, S } from '../strings';
import { fileName, save, saveCsv } from './save';

/** Saves the table as shown, filtered and sorted; ages are as of the state's time. */
export function saveTable(): void {
  const state = store.get();
  const { snapshot, moment } = selectShown(state);
  if (!snapshot) return;
  const text = tableCsv(
    selectRows(state),
    selectCatalogue(state),
    selectColumns(state),
    snapshot.at,
  );
  saveCsv('tags', text, epochOf(snapshot.takenAt), moment);
}

/** Saves the map as shown, with a footer: what its colours show, and the time. */
export async function saveMap(): Promise<void> {
  const layers = [...document.querySelectorAll<HTMLCanvasElement>('canvas[data-layer]')];
  const [first] = layers;
  const state = store.get();
  const { snapshot, moment } = selectShown(state);
  if (!first || first.width === 0 || !snapshot) return;
  // Not from the layout: on a phone, the map has no size behind the table.
  const ratio = first.width / (parseFloat(first.style.width) || first.width);
  const style = getComputedStyle(document.documentElement);
  const canvas = newCanvas(first.width, first.height + FOOTER_PX * ratio);
  const context = contextOf(canvas);
  for (const layer of layers) context.drawImage(layer, 0, 0);

  const takenAt = epochOf(snapshot.takenAt);
  // A recording or simulation has its own time: use that, not when the data arrived.
  const then = moment ?? (selectHasOwnTime(state) ? snapshot.at : null);
  const { difference } = selectHeat(state) ?? {};
  const time = difference
    ? S.differenceTimes(rosText(difference.at), rosText(difference.against))
    : then === null
      ? dateText(takenAt)
      : S.asOf(rosText(then));
  const origin = selectOrigin(state);
  context.setTransform(ratio, 0, 0, ratio, 0, first.height);
  context.fillStyle = style.getPropertyValue('--surface');
  context.fillRect(0, 0, first.width / ratio, FOOTER_PX);
  context.fillStyle = style.getPropertyValue('--ink');
  context.textBaseline = 'middle';
  context.font = `600 ${FONT}`;
  context.fillText(coloursText(state), EDGE_PX, 18);
  context.font = `500 ${FONT}`;
  context.fillText(origin === null ? time : `${S.origin[origin]}, ${time}`, EDGE_PX, 40);

  const blob = await new Promise<Blob | null>((resolve) => canvas.toBlob(resolve, 'image/png'));
  if (blob) save(blob, fileName('map', 'png', takenAt, moment));
}

/** What the map's colours show, as in the page's legend. */
function coloursText(state: AppState): string {
  const sensor = selectSensor(state);
  const label = shown(sensor.label, 32);
  const heat = selectHeat(state);
  if (heat?.difference) {
    const { low, high } = heat.range;
    const span = S.valueRange(signedText(sensor, low), differenceText(sensor, high));
    return `${S.difference(label)}: ${span}`;
  }
  if (heat?.isError) {
    const most = withUnit(sensor, errorNumber(sensor, heat.range.high));
    return `${label}: ${S.heats.error} ±\u00a0${S.valueRange('0', most)}`;
  }
  if (selectColouring(state) === 'ideal') return S.legendAgainst(label);
  const range = selectRange(state);
  if (!range) return label;
  return `${label}: ${S.valueRange(valueText(sensor, range.low), readingText(sensor, range.high))}`;
}

/** Height of the footer below a saved map. */
export const FOOTER_PX = 56;
const EDGE_PX = 14;
const FONT = '13px "Inter Variable", system-ui, sans-serif';

/** The current view's URL; the address bar lags behind it, and waits during playback. */
export function viewAddress(parameters: Readonly<Record<string, string>> = {}): string {
  const url = new URL(window.location.href);
  for (const [name, value] of Object.entries(parameters)) url.searchParams.set(name, value);
  url.hash = toFragment(store.get().view);
  return url.href;
}

const SHIFT_S = 8 * 3_600;
/** Longest period that the bridge reports on. */
const LONGEST_S = 31 * 86_400;

/** URL of the shift report, for the period chosen on the time bar, else the last eight hours. */
export function reportLink(): string {
  const state = store.get();
  const now = rosNow(state, pageNow());
  const query = new URLSearchParams({ lang: LANGUAGE, time_zone: timeZone() });
  if (now !== null) {
    const { period } = state.view;
    const oldest = state.twin.remembered.value?.reach?.from ?? null;
    const { from, to } = reported(isChosen(period) ? spanOf(period, now, oldest) : null, now);
    query.set('from', String(from));
    query.set('to', String(to));
  }
  return `api/report.html?${query.toString()}`;
}

/** The report's span in whole seconds, clipped to now and `LONGEST_S`. */
export function reported(span: Span | null, now: number): Span {
  const to = Math.max(1, Math.floor(Math.min(span?.to ?? now, now)));
  const from = Math.floor(span?.from ?? to - SHIFT_S);
  return { from: Math.max(0, to - LONGEST_S, Math.min(from, to - 1)), to };
}
