import type { JSX } from 'react';

import { act, useApp } from '../store/app';
import { S } from '../strings';
import { Segmented } from '../widgets/controls';

/** How the heat map is coloured; in the link, and by one click. */
export function ColouringControl(): JSX.Element {
  const colouring = useApp((state) => state.view.colouring);
  return (
    <Segmented
      legend={S.colouring}
      className="colouring"
      value={colouring}
      options={(['ideal', 'value'] as const).map((value) => ({
        value,
        label: S.colourings[value],
      }))}
      onChange={(chosen) => {
        act({ type: 'colouring', colouring: chosen });
      }}
    />
  );
}
