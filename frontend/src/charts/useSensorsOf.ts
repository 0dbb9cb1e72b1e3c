import { useMemo } from 'react';

import { isHad, isMeasured, type Catalogue } from '../domain/sensors';
import { useApp } from '../store/app';
import { selectCatalogue, selectSensor } from '../store/derived';
import { selectTag } from '../store/moment';

/**
 * The sensors that a tag has at the moment that is shown, in their usual order; and what is in
 * view, where it is computed of them.
 */
export function useSensorsOf(tagId: string): readonly string[] {
  const names = useApp((state) => {
    const readings = selectTag(state, tagId)?.readings;
    if (!readings) return '';
    const inView = selectSensor(state);
    const isComputed = !isMeasured(inView) && isHad(inView, (name) => readings.has(name));
    return [...new Set([...readings.keys(), ...(isComputed ? [inView.name] : [])])].join('\u0000');
  });
  const catalogue = useApp(selectCatalogue);
  return useMemo(
    () => inOrder(catalogue, names === '' ? [] : names.split('\u0000')),
    [catalogue, names],
  );
}

/** The species of tags, as far as they are sure, at the moment that is shown; else empty. */
export function useSpeciesOf(tagIds: readonly string[]): readonly string[] {
  const species = useApp((state) =>
    tagIds.map((id) => selectTag(state, id)?.sureSpecies ?? '').join('\u0000'),
  );
  return useMemo(() => species.split('\u0000'), [species]);
}

function inOrder({ all }: Catalogue, names: readonly string[]): readonly string[] {
  const place = (name: string): number => {
    const index = all.findIndex((sensor) => sensor.name === name);
    return index < 0 ? all.length : index;
  };
  return [...names].sort((a, b) => place(a) - place(b) || (a < b ? -1 : 1));
}
