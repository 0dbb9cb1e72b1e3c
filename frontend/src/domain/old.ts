/** Where a field stands for a reading that the judge calls too old to say. Pure; judges nothing. */
import type { Field, Judgement } from '../contract/types';
import type { MapPoint } from '../geometry/coordinates';
import type { Shade } from './ramp';
import type { Sensor } from './sensors';
import type { Tag } from './twin';
import { nearestSites, type CellGrid } from './zones';

/** A tag that a field has a reading from. */
export interface ReadSite {
  readonly at: MapPoint;
  readonly isOld: boolean;
}

/** The tags that a field of the sensor is made of. */
export function readSites(
  tags: readonly Tag[],
  said: Judgement['tags'],
  { name, madeOf }: Pick<Sensor, 'name' | 'madeOf'>,
): ReadSite[] {
  return tags.flatMap(({ id, at, readings }) => {
    const parts = madeOf.length > 0 && !readings.has(name) ? madeOf : [name];
    if (!at || parts.some((part) => (readings.get(part) ?? null) === null)) return [];
    const old = said[id]?.reasons.filter(({ kind }) => kind === 'old') ?? [];
    // Without a sensor's name it is said of all that the tag has. Of what is derived no age is
    // told, but where one part alone is old it is of another scan, and nothing is derived of it.
    const isOld = parts.every((part) => old.some(({ sensor }) => sensor === '' || sensor === part));
    return [{ at, isOld }];
  });
}

/** 1 where the nearest reading is too old, cell by cell, row 0 at the bottom; null: nowhere. */
export function oldCells(grid: CellGrid, sites: readonly ReadSite[]): Uint8Array | null {
  if (!sites.some(({ isOld }) => isOld)) return null;
  const nearest = nearestSites(grid, sites);
  return Uint8Array.from(nearest, (site) => Number(sites[site]?.isOld ?? false));
}

/** The cells of a field for which `isIn` holds; all others are not known. */
export const cellsWhere = (field: Field, isIn: (cell: number) => boolean): Field => ({
  ...field,
  values: field.values.map((value, cell) => (isIn(cell) ? value : NaN)),
});

/** What is left of a colour whose reading is too old. */
const FAINT = 0.22;

/** Colours what is too old faintly: it is hatched besides, and `isHatched` false leaves it bare. */
export const withOld =
  (shade: Shade, old: Uint8Array, isHatched: boolean): Shade =>
  (data, at, value, cell) => {
    if (old[cell] === 0) {
      shade(data, at, value, cell);
    } else if (isHatched) {
      shade(data, at, value, cell);
      data[at + 3] = (data[at + 3] ?? 0) * FAINT;
    }
  };
