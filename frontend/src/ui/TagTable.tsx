import {
  memo,
  useMemo,
  useRef,
  useState,
  type CSSProperties,
  type JSX,
  type ReactNode,
  type SyntheticEvent,
} from 'react';

import { rgbText, sensorColour } from '../domain/ramp';
import type { Sensor } from '../domain/sensors';
import type { AreaHead } from '../domain/table';
import { speciesText } from '../domain/marks';
import { shown } from '../domain/text';
import { act, store, useApp } from '../store/app';
import { withSort, withTag } from '../store/view';
import { selectCatalogue, selectShownColumns } from '../store/derived';
import { useSelected } from '../store/create';
import { hourAgo, selectHourAgo } from '../store/hourAgo';
import { selectClockFault, selectHasTime, selectTags } from '../store/moment';
import { isColumnShown } from '../store/settings';
import { S } from '../strings';
import { Icon } from '../widgets/controls';
import { useMedia } from '../widgets/useMedia';
import { HealthMark } from './HealthMark';
import { SensorLabel } from './SensorPicker';
import { TagRow } from './TagRow';
import { partsOf, SHORT_TABLE, useChosenInSight, useHeldRows, useVisibleRows } from './visibleRows';

/** Too narrow for other columns than that of the chosen sensor (table-sizes.css). */
const narrow = window.matchMedia('(max-width: 37.4375em)');

/** All tags, including those without a pin and those whose scan failed. */
export function TagTable(): JSX.Element {
  const catalogue = useApp(selectCatalogue);
  const sensors = useApp(selectShownColumns);
  const chosen = useApp((state) => state.view.sensor);
  const selected = useApp((state) => state.view.selected);
  const hovered = useApp((state) => state.view.hovered);
  const { lines, ...hold } = useHeldRows();
  const hasTags = useApp((state) => selectTags(state).length > 0);
  const longestId = useApp((state) =>
    selectTags(state).reduce((most, { id }) => Math.max(most, id.length), 0),
  );
  const longestSpecies = useApp((state) =>
    selectTags(state).reduce((most, { species }) => Math.max(most, speciesLength(species)), 0),
  );
  const isByArea = useApp((state) => state.settings.byArea);
  const hidden = useApp((state) => state.settings.hidden);
  const last = useSelected(hourAgo);
  const then = useApp((state) => selectHourAgo(state, last));
  // One object for all rows, or each state would render them anew.
  const isTimed = useApp((state) => selectClockFault(state) === null);
  const isNarrow = useMedia(narrow);
  const look = useMemo(() => {
    const names = sensors.map(({ name }) => name);
    const beside = isNarrow ? names.filter((name) => name === chosen) : names;
    return { catalogue, sensors, beside, chosen, hidden, then, isTimed };
  }, [catalogue, sensors, isNarrow, chosen, hidden, then, isTimed]);
  const hasTime = useApp(selectHasTime);
  const has = (id: string): boolean => isColumnShown({ hidden }, id);
  const body = useRef<HTMLTableSectionElement>(null);
  const sight = useVisibleRows(body, lines.length);
  // The focused row stays rendered, or the focus would be lost. So do two rows either side, so
  // that Tab can move on, even past an area's heading.
  const [focused, setFocused] = useState<string | null>(null);
  const places = useMemo(
    () =>
      new Map(
        lines.flatMap((line, index) => ('tag' in line ? [[line.tag.id, index] as const] : [])),
      ),
    [lines],
  );
  const placeOf = (id: string | null): number => (id === null ? NaN : (places.get(id) ?? NaN));
  useChosenInSight(body, hasTags ? selected : null, placeOf(selected), sight.rowHeight);
  const held = placeOf(focused);
  const single = [placeOf(selected), held - 2, held - 1, held, held + 1, held + 2];
  return (
    // Keyboards and screen readers use each row's button; for the pointer, the whole row is the
    // target. One listener here, because an overlay per row makes a long table slow.
    // eslint-disable-next-line jsx-a11y/click-events-have-key-events, jsx-a11y/no-noninteractive-element-interactions
    <table
      className={lines.length > SHORT_TABLE ? 'tags long' : 'tags'}
      data-testid="tag-table"
      style={{ '--sensors': sensors.reduce((sum, it) => sum + share(it), 0) } as CSSProperties}
      aria-rowcount={lines.length + 1}
      onFocus={(event) => setFocused(rowTag(event))}
      onBlur={({ currentTarget, relatedTarget }) => {
        // Focus moving to another row must find that row still rendered.
        if (!currentTarget.contains(relatedTarget)) setFocused(null);
      }}
      onClick={onClick}
      onPointerOver={onPointerOver}
      onPointerLeave={onPointerLeave}
    >
      <caption className="unseen">{S.tableCaption}</caption>
      <colgroup>
        <col
          className="col-tag"
          style={
            {
              ...letters(longestId),
              '--species': has('species') ? longestSpecies : 0,
            } as CSSProperties
          }
        />
        {has('health') && <col className="col-health" />}
        {has('age') && (
          <col className="col-age" style={letters(hasTime ? 0 : S.ageUnknown.length)} />
        )}
        {sensors.map((sensor) => (
          <col
            key={sensor.name}
            className={sensor.name === chosen ? 'col-sensor' : 'col-sensor other'}
            style={letters(longestWord(sensor))}
          />
        ))}
        {has('species') && <col className="col-species" />}
        {has('flowers') && <col className="col-flowers optional" />}
      </colgroup>
      <thead>
        <tr aria-rowindex={1}>
          <ColumnHead id="tag">{S.columns.tag}</ColumnHead>
          {has('health') && <ColumnHead id="health">{S.columns.health}</ColumnHead>}
          {has('age') && (
            <ColumnHead id="age" className="number">
              {S.columns.age}
            </ColumnHead>
          )}
          {sensors.map((sensor) => (
            <SensorHead key={sensor.name} sensor={sensor} chosen={sensor.name === chosen} />
          ))}
          {has('species') && <ColumnHead id="species">{S.columns.species}</ColumnHead>}
          {has('flowers') && (
            <ColumnHead id="flowers" className="number optional">
              {S.columns.flowers}
            </ColumnHead>
          )}
        </tr>
      </thead>
      <tbody ref={body} {...hold}>
        {partsOf(lines.length, sight, single).map((part, place) => {
          if (part.kind === 'gap') {
            const height = part.rows * sight.rowHeight;
            return (
              <tr key={`gap ${place}`} className="gap" aria-hidden="true" style={{ height }}>
                <td />
              </tr>
            );
          }
          const row = lines[part.index];
          if (row && 'area' in row) {
            return <AreaRow key={`area ${row.area}`} head={row} index={part.index} />;
          }
          return (
            row && (
              <TagRow
                key={`tag ${row.tag.id}`}
                index={part.index}
                {...row}
                look={look}
                area={isByArea ? '' : catalogue.areaOf(row.tag.id)}
                selected={row.tag.id === selected}
                hovered={row.tag.id === hovered}
              />
            )
          );
        })}
        {lines.length === 0 && hasTags && (
          <tr className="no-match">
            <td>
              <p>
                {S.nothingMatches}{' '}
                <button
                  type="button"
                  className="text-button"
                  onClick={() => {
                    act({ filter: '' });
                    act({ health: null, list: 'tags' });
                  }}
                >
                  {S.filterClear}
                </button>
              </p>
            </td>
          </tr>
        )}
      </tbody>
    </table>
  );
}

/** Heading above an area's rows, with the worst verdict among them. */
function AreaRow({
  head: { area, count, worst },
  index,
}: {
  head: AreaHead;
  index: number;
}): JSX.Element {
  return (
    <tr className="area" aria-rowindex={index + 2}>
      <td>
        <h3>
          <HealthMark verdict={worst} word={false} />{' '}
          <bdi>{area === '' ? S.areaNone : shown(area, 32)}</bdi>{' '}
          <span className="faint">{S.shownOf(count, count)}</span>
        </h3>
      </td>
    </tr>
  );
}

/** The tag whose row received an event; null in a heading. */
function rowTag(event: SyntheticEvent): string | null {
  const row = event.target instanceof Element ? event.target.closest('tr') : null;
  return row?.dataset['tagId'] ?? null;
}

function onClick(event: SyntheticEvent): void {
  const tagId = rowTag(event);
  if (tagId === null) return;
  act(withTag(store.get().view.selected === tagId ? null : tagId));
}

function onPointerOver(event: SyntheticEvent): void {
  act({ hovered: rowTag(event) });
}

function onPointerLeave(): void {
  act({ hovered: null });
}

const letters = (count: number): CSSProperties => ({ '--letters': count }) as CSSProperties;

const speciesLength = (species: string): number => speciesText(species, 28).length;

/** Length of the longest word of a sensor's heading, in characters. */
const longestWord = ({ label }: Sensor): number =>
  Math.max(
    ...shown(S.sensorShort(label), 24)
      .split(/[\s-]/)
      .map((word) => word.length),
  );

/** Width of a sensor's column, as a multiple of the usual one, which holds a word of 9 letters. */
const share = (sensor: Sensor): number => Math.max(1, longestWord(sensor) / 9);

const SensorHead = memo(function SensorHead({
  sensor,
  chosen,
}: {
  sensor: Sensor;
  chosen: boolean;
}): JSX.Element {
  return (
    <ColumnHead
      id={sensor.name}
      className={chosen ? 'number sensor chosen' : 'number sensor other'}
      style={{ '--sensor': rgbText(sensorColour(sensor)) } as CSSProperties}
    >
      <SensorLabel sensor={sensor} /> <span className="head-unit">{sensor.unit}</span>
    </ColumnHead>
  );
});

function ColumnHead({
  id,
  className,
  style,
  children,
}: {
  id: string;
  className?: string;
  style?: CSSProperties;
  children: ReactNode;
}): JSX.Element {
  const sort = useApp((state) => state.view.sort);
  const own = sort.column === id;
  return (
    <th
      scope="col"
      className={className}
      style={style}
      data-column={id}
      aria-sort={own ? (sort.descending ? 'descending' : 'ascending') : 'none'}
    >
      <button type="button" onClick={() => act(withSort(id))}>
        <span>{children}</span>
        <span className="sort-mark" data-on={own}>
          <Icon name={own && sort.descending ? 'down' : 'up'} size={14} />
        </span>
      </button>
    </th>
  );
}
