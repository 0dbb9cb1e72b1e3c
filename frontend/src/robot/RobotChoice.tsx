import type { JSX } from 'react';

import { act, useApp } from '../store/app';
import { Check } from '../widgets/Check';
import { R } from './words';

/** The layer's entry in the list of layers. */
export function RobotChoice(): JSX.Element {
  const isOn = useApp((state) => state.view.layers.has('robot'));
  return (
    <Check
      label={R.robotLayer}
      isOn={isOn}
      onChange={(on) => {
        act({ type: 'layer', layer: 'robot', on });
      }}
    />
  );
}
