import { useMemo, type JSX, type ReactNode } from 'react';

import { VERDICTS } from '../domain/health';
import { rgbText } from '../domain/ramp';
import { speciesLooks, UNKNOWN_SPECIES, type BloomLook, speciesText } from '../domain/marks';
import { speciesOf } from '../draw/scene';
import { useApp } from '../store/app';
import { selectTags } from '../store/moment';
import { S } from '../strings';
import { HealthShape } from './HealthMark';

/** What pins and dots mean; a pin is the mark of its tag's verdict. */
export function Keys(): JSX.Element {
  const tags = useApp(selectTags);
  const species = useMemo(() => [...speciesLooks(speciesOf(tags))], [tags]);
  const unknown = tags.some((tag) => tag.blooms.some((bloom) => bloom.species === ''));
  return (
    // May scroll on a phone, so the keyboard must be able to reach it.
    // eslint-disable-next-line jsx-a11y/no-noninteractive-tabindex
    <ul className="legend-keys" aria-label={S.legend} tabIndex={0}>
      {VERDICTS.map((verdict) => (
        <li key={verdict} data-verdict={verdict}>
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
          {S.legendUnknownSpecies}
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
