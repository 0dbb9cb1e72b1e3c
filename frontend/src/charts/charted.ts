/** From what is chosen to the charts that it makes. Pure. */
import type { Span } from '../domain/period';
import { rangesFor, type Catalogue, type Catalogues, type Ranges } from '../domain/sensors';
import { shown } from '../domain/text';
import type { TemperatureUnit } from '../domain/units';
import type { Charted } from '../store/view';
import { S } from '../strings';
import { pairKey, type Lines, type Pair } from './lines';
import { bandsOf, type PlotModel } from './model';

/** One chart: a sensor, and the tags whose readings of it are its lines. */
export interface Plan {
  readonly sensor: string;
  readonly tagIds: readonly string[];
}

/** `sensors`: those of the first tag; `sensor`: the one in view. */
export function plansOf(
  { by, tagIds }: Charted,
  sensors: readonly string[],
  sensor: string,
): Plan[] {
  if (by === 'sensor') return [{ sensor, tagIds }];
  const [tagId] = tagIds;
  if (tagId === undefined) return [];
  return sensors.map((each) => ({ sensor: each, tagIds: [tagId] }));
}

export const pairsOf = (plans: readonly Plan[]): Pair[] =>
  plans.flatMap(({ sensor, tagIds }) => tagIds.map((tagId) => ({ tagId, sensor })));

export const tagLabel = (tagId: string): string => S.card(shown(tagId, 24));

/**
 * What of a plan is here. A tag keeps its look while others come later, or have nothing. `species` are
 * those of the plan's tags: what is ideal is drawn where it is the same for all.
 */
export function modelOf(
  catalogue: Catalogue,
  { day, night }: Catalogues,
  { sensor, tagIds }: Plan,
  species: readonly string[],
  { series, before, marks }: Lines,
  span: Span,
  unit: TemperatureUnit,
  moment: number | null,
  nowS: number | null,
): PlotModel {
  const lines = tagIds.flatMap((tagId, look) => {
    const key = pairKey({ tagId, sensor });
    const own = series.get(key);
    if (!own) return [];
    const ofDayBefore = before.get(key) ?? null;
    const label = tagLabel(tagId);
    return [{ series: own, before: ofDayBefore, look, label, marks: marks.get(tagId) ?? [] }];
  });
  const now = catalogue.named(sensor);
  const isMixed = new Set(tagIds.map((_, index) => rangesFor(now, species[index] ?? ''))).size > 1;
  const own = (of: Catalogue): Ranges => rangesFor(of.named(sensor), species[0] ?? '');
  const ranges = { now: own(catalogue), day: own(day), night: own(night) };
  // The nights are the greenhouse's: each line has the same.
  const bands = isMixed
    ? []
    : bandsOf(span, lines[0]?.series.nights ?? null, ranges, moment ?? nowS);
  return { sensor: now, unit, span, moment, lines, bands, isMixed };
}
