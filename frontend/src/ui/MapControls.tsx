import type { JSX } from 'react';

import { commandMap } from '../map/commands';
import { act, useApp } from '../store/app';
import { LAYERS } from '../store/view';
import { S } from '../strings';
import { Check, Disclosure, Icon, IconButton, type IconName } from '../widgets/controls';
import { HeatControl } from './HeatControl';
import { WithParts } from './WithParts';

export function MapControls(): JSX.Element {
  const button = (label: string, icon: IconName, action: () => void): JSX.Element => (
    <IconButton label={label} icon={icon} onClick={action} />
  );
  return (
    <div className="map-controls" data-over-map>
      <div className="stack">
        {button(S.zoomIn, 'plus', () => {
          commandMap({ type: 'zoom', factor: 1.5 });
        })}
        {button(S.zoomOut, 'minus', () => {
          commandMap({ type: 'zoom', factor: 1 / 1.5 });
        })}
        {button(S.fit, 'fit', () => {
          commandMap({ type: 'fit' });
        })}
      </div>
      <Disclosure label={S.layersButton} button={<Icon name="layers" />} className="layers">
        <LayerList />
      </Disclosure>
    </div>
  );
}

/** Of a robot there may be none. */
const LISTED = LAYERS.filter((layer) => layer !== 'robot');

function LayerList(): JSX.Element {
  const on = useApp((state) => state.view.layers);
  return (
    <>
      <div className="layer-list">
        {LISTED.map((layer) => (
          <Check
            key={layer}
            label={S.layers[layer]}
            isOn={on.has(layer)}
            onChange={(isOn) => {
              act({ type: 'layer', layer, on: isOn });
            }}
          />
        ))}
        <WithParts>{(parts) => <parts.InLayers />}</WithParts>
      </div>
      <label className="layer-choice heat-choice">
        <span>{S.heat}</span>
        <HeatControl place="layers" />
      </label>
      <WithParts>{(parts) => <parts.CompareControl />}</WithParts>
    </>
  );
}
