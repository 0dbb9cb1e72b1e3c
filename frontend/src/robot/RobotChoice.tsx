import type { JSX } from 'react';

import { act, useApp } from '../store/app';
import { R } from './words';

/** The layer's entry in the list of layers. */
export function RobotChoice(): JSX.Element {
  const isOn = useApp((state) => state.view.layers.has('robot'));
  return (
    <label className="check">
      <input
        type="checkbox"
        checked={isOn}
        onChange={(event) => {
          act({ type: 'layer', layer: 'robot', on: event.target.checked });
        }}
      />
      <span>{R.robotLayer}</span>
    </label>
  );
}
