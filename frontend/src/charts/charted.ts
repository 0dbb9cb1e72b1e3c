/** From what is chosen to the charts that it makes. Pure. */
import type { Span } from '../domain/period';
import type { Catalogue } from '../domain/sensors';
import { shown } from '../domain/text';
import type { TemperatureUnit } from '../domain/units';
import type { Charted } from '../store/view';
import { S } from '../strings';
import { marksOver, seriesOver, type Fed, type Pair } from './fed';
import type { PlotModel } from './model';

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

/** What of a plan is here. A tag keeps its look while others come later, or have nothing. */
export function modelOf(
  catalogue: Catalogue,
  { sensor, tagIds }: Plan,
  fed: Fed,
  span: Span,
  unit: TemperatureUnit,
  moment: number | null,
): PlotModel {
  return {
    sensor: catalogue.named(sensor),
    unit,
    span,
    moment,
    lines: tagIds.flatMap((tagId, look) => {
      const series = seriesOver(fed, { tagId, sensor }, span);
      const marks = marksOver(fed, tagId, span);
      return series ? [{ series, look, label: tagLabel(tagId), marks }] : [];
    }),
  };
}
