import { useMemo } from 'react';

import type { Catalogue } from '../domain/sensors';
import { useApp } from '../store/app';
import { selectCatalogue } from '../store/derived';
import { selectTag } from '../store/moment';

/** The sensors that a tag has at the moment that is shown, in their usual order. */
export function useSensorsOf(tagId: string): readonly string[] {
  const names = useApp((state) =>
    [...(selectTag(state, tagId)?.readings.keys() ?? [])].join('\u0000'),
  );
  const catalogue = useApp(selectCatalogue);
  return useMemo(
    () => inOrder(catalogue, names === '' ? [] : names.split('\u0000')),
    [catalogue, names],
  );
}

function inOrder({ all }: Catalogue, names: readonly string[]): readonly string[] {
  const place = (name: string): number => {
    const index = all.findIndex((sensor) => sensor.name === name);
    return index < 0 ? all.length : index;
  };
  return [...names].sort((a, b) => place(a) - place(b) || (a < b ? -1 : 1));
}
