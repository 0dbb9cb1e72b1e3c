/** Parts loaded after the first view: on the map, in its legend and layers; the robot's only if there is one. */
import { useLayoutEffect, useMemo, useRef, type JSX, type ReactNode } from 'react';

import { readingText, shortAgeText } from '../domain/format';
import { VERDICTS } from '../domain/health';
import { idealText } from '../domain/ideal';
import { speciesLooks, speciesText, UNKNOWN_SPECIES, type BloomLook } from '../domain/marks';
import { rgbText } from '../domain/ramp';
import { rangesFor } from '../domain/sensors';
import { shown } from '../domain/text';
import type { Tag } from '../domain/twin';
import { speciesOf } from '../draw/scene';
import { beside } from '../geometry/clear';
import { pinUnderMouse, type PinUnderMouse } from '../map/commands';
import { RobotChoice, RobotFact, RobotLayer } from '../parts/robot';
import { useApp } from '../store/app';
import { robotFrame, useSelected } from '../store/create';
import { selectCatalogue, selectHealth } from '../store/derived';
import { selectShown, selectTag, selectTags } from '../store/moment';
import { S } from '../strings';
import { Age, AgeFact } from './Age';
import { Meanwhile } from './alarms/AlarmNotes';
import { HealthMark, HealthShape } from './HealthMark';
import { Reasons } from './Reasons';

const useHasRobot = (): boolean => useSelected(robotFrame, (frame) => frame !== null);

/** Whether to show the robot: it is known live only, so the past shows none. */
function useRobot(): boolean {
  const isShown = useApp(
    (state) => state.view.layers.has('robot') && selectShown(state).moment === null,
  );
  return useHasRobot() && isShown;
}

export const OnMap = (): JSX.Element => (
  <>
    {useRobot() && <RobotLayer />}
    <HoverCard />
    <Meanwhile />
  </>
);

export const InLegend = (): JSX.Element => (
  <>
    {useRobot() && <RobotFact />}
    <Keys />
  </>
);

export const InLayers = (): JSX.Element | null => (useHasRobot() ? <RobotChoice /> : null);

/** A tag may have any number of sensors; the card that a click opens shows them all. */
const MOST_READINGS = 8;
const MOST_REASONS = 3;

/**
 * A tag in short, beside the pin under the mouse. Hidden from screen readers, because card and table
 * have the same; it takes no pointer events, so that it never blocks the mouse.
 */
export function HoverCard(): JSX.Element | null {
  const pin = useSelected(pinUnderMouse);
  const selected = useApp((state) => state.view.selected);
  const tag = useApp((state) => (pin ? selectTag(state, pin.tagId) : undefined));
  // The selected tag's card is open already.
  if (!pin || !tag || pin.tagId === selected) return null;
  return <Brief key={tag.id} pin={pin} tag={tag} />;
}

function Brief({ pin, tag }: { pin: PinUnderMouse; tag: Tag }): JSX.Element {
  const root = useRef<HTMLDivElement>(null);
  const health = useApp((state) => selectHealth(state).byTag.get(tag.id));
  const catalogue = useApp(selectCatalogue);
  const chosen = useApp((state) => state.view.sensor);
  // Placed by its size, which is known after layout and before paint.
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
      {health && <Reasons health={health} tagId={tag.id} most={MOST_REASONS} />}
      <dl>
        {names.slice(0, MOST_READINGS).map((name) => {
          const sensor = catalogue.named(name);
          const value = tag.readings.get(name);
          const how =
            value == null ? null : idealText(sensor, rangesFor(sensor, tag.sureSpecies), value);
          return (
            <div key={name} data-sensor={name} data-chosen={name === chosen}>
              <dt>{shown(sensor.label, 24)}</dt>
              <dd>
                {value == null ? S.sensorFailed : readingText(sensor, value)}{' '}
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
      <p className="faint">
        {tag.species ? <bdi>{speciesText(tag.species, 28)}</bdi> : S.unclassified}
        {tag.species && tag.species !== tag.sureSpecies && ` (${S.notSure})`}
      </p>
    </div>
  );
}

/** Key to pins and dots; a pin is the mark of its tag's verdict. */
export function Keys(): JSX.Element {
  const tags = useApp(selectTags);
  const species = useMemo(() => [...speciesLooks(speciesOf(tags))], [tags]);
  const unknown = tags.some((tag) => tag.blooms.some((bloom) => bloom.species === ''));
  return (
    // Scrolls on a phone, so the keyboard must be able to reach it.
    // eslint-disable-next-line jsx-a11y/no-noninteractive-tabindex
    <ul className="legend-keys" aria-label={S.legend} tabIndex={0}>
      {VERDICTS.map((verdict) => (
        <li key={verdict}>
          <HealthShape verdict={verdict} />
          {S.health[verdict]}
        </li>
      ))}
      <li>
        <KeySign>
          <circle cx="8" cy="8" r="6.5" className="key-pin dashed" />
        </KeySign>
        {S.pinLacking}
      </li>
      <li>
        <KeySign>
          <circle cx="8" cy="8" r="6.5" className="key-pin" />
          <path d="M5 11 11 5" className="key-pin" />
        </KeySign>
        {S.pinFailed}
      </li>
      <li>
        <KeySign>
          <circle cx="8" cy="8" r="6.2" className="key-pest" />
          <ellipse cx="8" cy="8.6" rx="1.7" ry="2.6" className="key-bug" />
          <path d="M5 7.2h6M5 9.8h6M8 4.8v1.5" className="key-bug" />
        </KeySign>
        {S.pinPest}
      </li>
      {species.map(([name, look]) => (
        <li key={name}>
          <BloomKey look={look} />
          <bdi>{speciesText(name, 24)}</bdi>
        </li>
      ))}
      {unknown && (
        <li>
          <BloomKey look={UNKNOWN_SPECIES} />
          {S.unclassified}
        </li>
      )}
    </ul>
  );
}

function BloomKey({ look: { colour, shape } }: { look: BloomLook }): JSX.Element {
  return (
    <KeySign size={14}>
      <g className="key-bloom" fill={rgbText(colour)}>
        {shape === 'circle' && <circle cx="8" cy="8" r="5.5" />}
        {shape === 'square' && <path d="M3 3h10v10H3Z" />}
        {shape === 'triangle' && <path d="M8 1.500 14.500 13H1.500Z" />}
      </g>
    </KeySign>
  );
}

function KeySign({ size = 16, children }: { size?: number; children: ReactNode }): JSX.Element {
  return (
    <svg viewBox="0 0 16 16" width={size} height={size} aria-hidden="true">
      {children}
    </svg>
  );
}
