import { useLayoutEffect, useRef, type JSX } from 'react';

import { readingText, shortAgeText } from '../domain/format';
import { idealText } from '../domain/ideal';
import { rangesFor } from '../domain/sensors';
import { speciesText } from '../domain/marks';
import { shown } from '../domain/text';
import type { Tag } from '../domain/twin';
import { beside } from '../geometry/beside';
import { pinUnderMouse, type PinUnderMouse } from '../map/commands';
import { useApp } from '../store/app';
import { useSelected } from '../store/create';
import { selectCatalogue, selectHealth } from '../store/derived';
import { selectTag } from '../store/moment';
import { S } from '../strings';
import { Age, AgeFact } from './Age';
import { HealthMark } from './HealthMark';
import { Reasons } from './Reasons';

/** A tag may carry any number of sensors; the card that opens with a click has them all. */
const MOST_READINGS = 8;
const MOST_REASONS = 3;

/**
 * A tag in short, beside the pin that the mouse is on. For eyes alone: card and table tell the
 * same to everybody, and a mouse on its way to somewhere else is not to be held up.
 */
export function HoverCard(): JSX.Element | null {
  const pin = useSelected(pinUnderMouse, (under) => under);
  const selected = useApp((state) => state.view.selected);
  const tag = useApp((state) => (pin ? selectTag(state, pin.tagId) : undefined));
  // The chosen tag's own card is open already.
  if (!pin || !tag || pin.tagId === selected) return null;
  return <Brief key={tag.id} pin={pin} tag={tag} />;
}

function Brief({ pin, tag }: { pin: PinUnderMouse; tag: Tag }): JSX.Element {
  const root = useRef<HTMLDivElement>(null);
  const health = useApp((state) => selectHealth(state).byTag.get(tag.id));
  const unit = useApp((state) => state.settings.unit);
  const catalogue = useApp(selectCatalogue);
  const chosen = useApp((state) => state.view.sensor);
  // Where it fits depends on its size, which is known once it is there and before it is seen.
  useLayoutEffect(() => {
    const card = root.current;
    if (!card) return;
    const size = { width: card.offsetWidth, height: card.offsetHeight };
    const { x, y } = beside(pin.at, pin.reach, size, pin.within);
    card.style.transform = `translate(${Math.round(x)}px, ${Math.round(y)}px)`;
  });
  const names = [...tag.readings.keys()].sort(
    (a, b) => Number(b === chosen) - Number(a === chosen),
  );
  const hidden = names.length - MOST_READINGS;
  return (
    <div
      ref={root}
      className="hover-card"
      aria-hidden="true"
      data-testid="hover-card"
      data-tag-id={tag.id}
    >
      <header>
        <strong>
          <bdi>{S.card(shown(tag.id, 20))}</bdi>
        </strong>
        {health && <HealthMark verdict={health.verdict} />}
      </header>
      {health && <Reasons health={health} most={MOST_REASONS} />}
      <dl>
        {names.slice(0, MOST_READINGS).map((name) => {
          const sensor = catalogue.named(name);
          const value = tag.readings.get(name);
          const how =
            value == null
              ? null
              : idealText(sensor, rangesFor(sensor, tag.sureSpecies), value, unit);
          return (
            <div key={name} data-sensor={name} data-chosen={name === chosen}>
              <dt>{shown(sensor.label, 24)}</dt>
              <dd>
                {value == null ? S.sensorFailed : readingText(sensor, value, unit)}{' '}
                {how !== null && <span>{how}</span>}{' '}
                <span className="faint">
                  <Age when={tag.readAt.get(name) ?? 'never'} format={shortAgeText} />
                </span>
              </dd>
            </div>
          );
        })}
        {names.length === 0 && <AgeFact label={S.cardScanned} when={tag.scannedAt} />}
      </dl>
      {hidden > 0 && <p className="faint">{S.cardMore(hidden)}</p>}
      {names.length === 0 && <p className="faint">{S.cardNoReadings}</p>}
      <p className="faint">
        {tag.species ? <bdi>{speciesText(tag.species, 28)}</bdi> : S.unclassified}
        {tag.species && !tag.sureSpecies && ` (${S.notSure})`}
      </p>
    </div>
  );
}
