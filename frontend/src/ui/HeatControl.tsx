import type { JSX } from 'react';

import { act, useApp } from '../store/app';
import { HEATS } from '../store/view';
import { S } from '../strings';
import { Select } from '../widgets/controls';

/**
 * What the heat map is made of; in the link. On a narrow screen it is among the layers, elsewhere in
 * the legend.
 */
export function HeatControl({ place }: { place: 'legend' | 'layers' }): JSX.Element {
  const heat = useApp((state) => state.view.heat);
  return (
    <Select
      className="heat-choice"
      aria-label={S.heat}
      data-testid={`heat-${place}`}
      value={heat}
      options={HEATS}
      text={(kind) => S.heats[kind]}
      onChange={(chosen) => {
        act({ type: 'heat', heat: chosen });
      }}
    />
  );
}
