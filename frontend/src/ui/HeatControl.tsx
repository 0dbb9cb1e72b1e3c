import type { JSX } from 'react';

import { act, useApp } from '../store/app';
import { HEATS } from '../store/view';
import { S } from '../strings';

/**
 * What the heat map is made of; in the link. On a narrow screen it is among the layers, elsewhere in
 * the legend.
 */
export function HeatControl({ place }: { place: 'legend' | 'layers' }): JSX.Element {
  const heat = useApp((state) => state.view.heat);
  return (
    <select
      className="heat-choice"
      aria-label={S.heat}
      data-testid={`heat-${place}`}
      value={heat}
      onChange={(event) => {
        const chosen = HEATS.find((kind) => kind === event.target.value);
        if (chosen) act({ type: 'heat', heat: chosen });
      }}
    >
      {HEATS.map((kind) => (
        <option key={kind} value={kind}>
          {S.heats[kind]}
        </option>
      ))}
    </select>
  );
}
