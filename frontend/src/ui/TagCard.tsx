import { useRef, type JSX } from 'react';

import { fetchHistory } from '../contract/api';
import type { TagHealth, TagHistory } from '../contract/types';
import {
  beyondLimitText,
  farOffText,
  metresText,
  percentText,
  rangeText,
  readingText,
} from '../domain/format';
import { isBack, isBad, rangeReason, sideOf, attemptOutcome } from '../domain/health';
import { speciesText } from '../domain/marks';
import { rangesFor } from '../domain/sensors';
import { shown } from '../domain/text';
import type { When } from '../domain/time';
import type { Tag } from '../domain/twin';
import { theMap } from '../map/commands';
import { Comments } from '../notes/Comments';
import { act, useApp } from '../store/app';
import { withTag } from '../store/view';
import { selectCatalogue, selectHealth } from '../store/derived';
import { selectHasSnapshot, selectShown, selectTag } from '../store/moment';
import { useFetched } from '../store/fetcher';
import { S } from '../strings';
import { IconButton, useFocusBack } from '../widgets/controls';
import { Age, AgeFact, Fact, useAgeStep } from './Age';
import { CardAlarms } from './alarms/CardAlarms';
import { selectIsCurrent } from './DoNow';
import { HealthMark } from './HealthMark';
import { CardEstimate, lazyPart } from './lazyParts';
import { Reasons } from './Reasons';

// Charts and their library load after the first paint.
const CardChart = lazyPart(async () => (await import('../charts/CardChart')).default);

/** Everything about the selected tag. */
export function TagCard({ tagId }: { tagId: string }): JSX.Element {
  const tag = useApp((state) => selectTag(state, tagId));
  const health = useApp((state) => selectHealth(state).byTag.get(tagId));
  const moment = useApp((state) => selectShown(state).moment);
  const hasSnapshot = useApp(selectHasSnapshot);
  const source = useSource(tagId, tag !== undefined);
  const root = useRef<HTMLElement>(null);

  useFocusBack(root);

  return (
    <aside
      ref={root}
      className="card"
      aria-label={S.card(shown(tagId, 24))}
      data-testid="tag-card"
      data-tag-id={tagId}
    >
      <header>
        <h2>
          <bdi>{S.card(shown(tagId, 24))}</bdi>
        </h2>
        {health && <HealthMark verdict={health.verdict} />}
        <IconButton icon="close" label={S.cardClose} onClick={() => act(withTag(null))} />
      </header>
      {tag ? (
        <CardBody tag={tag} health={health} source={source} />
      ) : (
        hasSnapshot && <p>{moment === null ? S.cardGone : S.cardGoneThen}</p>
      )}
    </aside>
  );
}

function CardBody({
  tag,
  health,
  source,
}: {
  tag: Tag;
  health: TagHealth | undefined;
  /** Null or empty: not known. */
  source: string | null;
}): JSX.Element {
  const { at } = tag;
  // Without the estimate on the map, only readings left out of it are worth showing.
  const isEstimated = useApp((state) => state.view.heat !== 'nearest');
  const hasChanged = health?.reasons.some(({ kind }) => kind === 'changed') ?? false;
  const isCharted = useApp((state) => state.view.chart !== null);
  const area = useApp((state) => selectCatalogue(state).areaOf(tag.id));
  const isNow = useApp((state) => selectShown(state).moment === null);
  const isCurrent = useApp(selectIsCurrent);
  return (
    <div className="card-body">
      {health && (
        <Reasons health={health} tagId={tag.id} hasTodo={isBad(health.verdict) && isCurrent} />
      )}
      {isNow && <CardAlarms tagId={tag.id} />}
      <ul className="card-readings">
        {[...tag.readings].map(([name, value]) => (
          <CardReading
            key={name}
            name={name}
            value={value}
            species={tag.sureSpecies}
            health={health}
            when={tag.readAt.get(name) ?? 'never'}
          />
        ))}
      </ul>
      {(isEstimated || hasChanged) && <CardEstimate tag={tag} health={health} />}
      {tag.readings.size > 0 && !isCharted && (
        <div className="card-chart-place">
          <CardChart tagId={tag.id} />
        </div>
      )}
      {/* Above what loads later, so that its buttons do not move under a finger. */}
      <Comments subject={`tag:${tag.id}`} name={S.card(shown(tag.id, 24))} />
      <dl className="card-facts">
        {area !== '' && (
          <Fact label={S.cardArea}>
            <bdi>{shown(area, 40)}</bdi>
          </Fact>
        )}
        <AgeFact label={S.cardScanned} when={tag.scannedAt} />
        {tag.inspectedAt !== 'never' && <AgeFact label={S.cardInspected} when={tag.inspectedAt} />}
        {source && (
          <Fact label={S.cardSource}>
            <bdi>{sourceText(source)}</bdi>
          </Fact>
        )}
        {tag.failedAttempt && (
          <Fact label={S.cardLastAttempt}>
            <Age when={tag.failedAttempt.at} /> ·{' '}
            {S.attemptOutcomes[attemptOutcome(tag.failedAttempt.status)]}
            {tag.failedAttempt.detail && (
              <span className="faint"> {shown(tag.failedAttempt.detail, 160)}</span>
            )}
          </Fact>
        )}
        <Fact label={S.columns.species}>
          {tag.species ? <bdi>{speciesText(tag.species, 40)}</bdi> : S.unclassified}
          {tag.species && tag.speciesConfidence !== null && (
            <span className="faint"> {S.confidence(percentText(tag.speciesConfidence))}</span>
          )}
          {tag.species && tag.species !== tag.sureSpecies && ` (${S.notSure})`}
        </Fact>
        <Fact label={S.columns.flowers}>{tag.flowerCount}</Fact>
        <Fact label={S.cardPosition}>
          {at ? (
            <button
              type="button"
              className="text-button"
              title={S.cardShow}
              onClick={() => {
                act({ pane: 'map', chartedFrom: null });
                theMap.get()?.show(tag.id);
              }}
            >
              {S.position(metresText(at.x), metresText(at.y))}
            </button>
          ) : (
            <span>{tag.farOff ? farOffText(tag.farOff) : S.notOnMapLong}</span>
          )}
        </Fact>
      </dl>
    </div>
  );
}

/** Fixed sensors and a robot's visits in words; any other source by its own name. */
function sourceText(source: string): string {
  if (source === 'adapt/fixed') return S.cardFixed;
  return source === 'adapt' ? S.cardVisited : shown(source, 40);
}

function CardReading({
  name,
  value,
  species,
  health,
  when,
}: {
  name: string;
  value: number | null;
  species: string;
  health: TagHealth | undefined;
  when: When;
}): JSX.Element {
  const sensor = useApp((state) => selectCatalogue(state).named(name));
  const { ideal } = rangesFor(sensor, species);
  const reason = rangeReason(health, name);
  const out = reason && !isBack(reason) ? reason : null;
  const side = out && sideOf(out);
  const step = useAgeStep(when);
  return (
    <li data-sensor={name} data-age={step}>
      <span className="card-label">{shown(sensor.label, 32)}</span>
      <strong className="card-value">
        {value === null
          ? S.sensorFailed
          : out
            ? beyondLimitText(sensor, value, out.limit)
            : readingText(sensor, value)}
      </strong>
      <span className="card-age faint">
        <Age when={when} />
      </span>
      {ideal && (
        <span className="card-ideal" data-side={side || undefined} data-health={out?.verdict}>
          {side && `${S.side[side]}, `}
          {`${S.idealParts[sensor.part ?? 'any']} ${rangeText(sensor, ideal)}`}
        </span>
      )}
    </li>
  );
}

/** Least time between two attempts to fetch it, ms. */
const PACE_MS = 500;

/** Where the readings of a tag come from; null until loaded. A link may name a tag that the twin does not know. */
const useSource = (tagId: string, isKnown: boolean): string | null =>
  useFetched<TagHistory>(
    isKnown ? { key: tagId, run: (signal) => fetchHistory(tagId, signal) } : null,
    PACE_MS,
  ).value?.source ?? null;
