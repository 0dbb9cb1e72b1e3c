import { useMemo } from 'react';

import { isHad, isMeasured, type Catalogue } from '../domain/sensors';
import { useApp } from '../store/app';
import { createStore, useSelected } from '../store/create';
import { selectCatalogue } from '../store/derived';
import { selectTag } from '../store/moment';

interface Chosen {
  readonly name: string;
  /** What the map showed then: with another one there, the card follows the map again. */
  readonly inView: string;
}

/** What was chosen for the card's chart; the map keeps its own. */
export const chosenSensor = createStore<Chosen | null, Chosen | null>(null, (_, next) => next);

/** What the card's chart is to show: the sensor in view, unless another was chosen. */
export function useChosenSensor(): string {
  const inView = useApp((state) => state.view.sensor);
  const chosen = useSelected(chosenSensor, (it) => it);
  return chosen?.inView === inView ? chosen.name : inView;
}

/**
 * The sensors that a tag has at the moment that is shown, in their usual order; and what is in view
 * or chosen, where it is computed of them.
 */
export function useSensorsOf(tagId: string): readonly string[] {
  const chosen = useChosenSensor();
  const names = useApp((state) => {
    const readings = selectTag(state, tagId)?.readings;
    if (!readings) return '';
    const computed = [state.view.sensor, chosen].filter((name) => {
      const sensor = selectCatalogue(state).named(name);
      return !isMeasured(sensor) && isHad(sensor, (each) => readings.has(each));
    });
    return [...new Set([...readings.keys(), ...computed])].join('\u0000');
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
