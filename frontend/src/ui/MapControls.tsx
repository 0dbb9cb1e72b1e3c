import type { JSX } from 'react';

import { commandMap } from '../map/commands';
import { act, useApp } from '../store/app';
import { LAYERS } from '../store/view';
import { S } from '../strings';
import { Disclosure } from '../widgets/Disclosure';
import { Icon, type IconName } from '../widgets/Icon';
import { HeatControl } from './HeatControl';
import { WithParts } from './WithParts';

export function MapControls(): JSX.Element {
  const button = (label: string, icon: IconName, action: () => void): JSX.Element => (
    <button type="button" className="icon-button" aria-label={label} title={label} onClick={action}>
      <Icon name={icon} />
    </button>
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
      {LISTED.map((layer) => (
        <label key={layer} className="check">
          <input
            type="checkbox"
            checked={on.has(layer)}
            onChange={(event) => {
              act({ type: 'layer', layer, on: event.target.checked });
            }}
          />
          <span>{S.layers[layer]}</span>
        </label>
      ))}
      <HeatControl place="layers" />
      <WithParts>{(parts) => <parts.InLayers />}</WithParts>
    </>
  );
}
