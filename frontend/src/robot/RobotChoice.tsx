import type { JSX } from 'react';

import { act, useApp } from '../store/app';
import { S } from '../strings';
import { Check } from '../widgets/Check';

/** The layer's entry in the list of layers. */
export function RobotChoice(): JSX.Element {
  const isOn = useApp((state) => state.view.layers.has('robot'));
  return (
    <Check
      label={S.robotLayer}
      isOn={isOn}
      onChange={(on) => {
        act({ type: 'layer', layer: 'robot', on });
      }}
    />
  );
}
