import { useMemo, useRef, useState, type JSX, type KeyboardEvent, type PointerEvent } from 'react';

import { endsNow, rosText, type Span } from '../domain/time';
import type { Timeline } from '../domain/timeline';
import { act, store, useApp } from '../store/app';
import { pointedTime, useSelected } from '../store/create';
import { latestWord, selectAwaited, selectShown } from '../store/moment';
import { S } from '../strings';
import { useSize } from '../widgets/useSize';
import {
  type Axis,
  chosenAt,
  type Column,
  columnAt,
  columnsOf,
  momentAt,
  pixelS,
  stepped,
  xOf,
} from './axis';
import { Bar, BAR_PX } from './Bar';
import { pause } from './playback';

const FAR = 10;
const PAGES = 10;

export function Slider({
  span,
  timeline,
  nowS,
}: {
  span: Span;
  timeline: Timeline | null;
  nowS: number;
}): JSX.Element {
  const [pointed, setPointed] = useState<number | null>(null);
  /** Span held while dragging, so that the bar does not move. */
  const [held, setHeld] = useState<Span | null>(null);
  const element = useRef<HTMLDivElement>(null);
  const { width } = useSize(element);
  const moment = useApp((state) => state.view.moment);
  const shown = useApp((state) => selectShown(state).moment);
  const awaited = useApp(selectAwaited);
  const newest = useApp(latestWord);
  const anyPointed = useSelected(pointedTime);
  // What is pointed at here has its bubble.
  const ofChart = pointed === null ? anyPointed : null;
  const { from, to } = held ?? span;
  const axis = useMemo((): Axis => ({ from, to, width }), [from, to, width]);
  const columns = useMemo(
    () => (timeline && width > 0 ? columnsOf(timeline, axis) : []),
    [timeline, axis, width],
  );

  const at = (event: PointerEvent): number =>
    event.clientX - (element.current?.getBoundingClientRect().left ?? 0);
  const go = (next: number | null): void => act({ moment: next });
  const onPointerDown = (event: PointerEvent): void => {
    if (event.button !== 0) return;
    pause();
    setHeld({ from, to });
    event.currentTarget.setPointerCapture(event.pointerId);
    go(chosenAt(axis, at(event), nowS));
  };
  const onPointerMove = (event: PointerEvent): void => {
    const x = event.pointerType === 'touch' && !held ? null : at(event);
    setPointed(x);
    pointedTime.set(x === null ? null : momentAt(axis, x));
    if (held) go(chosenAt(axis, at(event), nowS));
  };
  const letGo = (): void => {
    setHeld(null);
    setPointed(null);
    pointedTime.set(null);
  };
  const onKeyDown = (event: KeyboardEvent): void => {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const step = stepOf(event, axis);
    if (event.key === 'Home') go(from);
    else if (event.key === 'End') {
      // A live period ends in now, even if the fetched span ends slightly before it.
      go(endsNow(store.get().view.period) || to >= nowS ? null : to);
    } else if (step !== null) go(stepped(axis, moment, step, nowS));
    else return;
    event.preventDefault();
    pause();
  };

  const cursor = moment ?? Math.min(nowS, to);
  // The bar ends in a whole bucket: within it, nothing may stand right of "now".
  const lastIn = timeline && to - nowS < timeline.bucket_s ? to : cursor;
  const place = (seconds: number): number => Math.min(width, Math.max(0, xOf(axis, seconds)));
  const isOutside = cursor < from || cursor > to;
  return (
    <div
      ref={element}
      className="timebar-slider"
      role="slider"
      tabIndex={0}
      aria-label={S.timebarSlider}
      aria-orientation="horizontal"
      aria-valuemin={Math.floor(from)}
      aria-valuemax={Math.ceil(Math.max(to, cursor))}
      aria-valuenow={Math.max(Math.floor(from), Math.round(cursor))}
      aria-valuetext={valueText(moment, columnAt(columns, xOf(axis, cursor)), newest)}
      data-span={`${from},${to}`}
      style={{ height: `${BAR_PX}px` }}
      onPointerDown={onPointerDown}
      onPointerMove={onPointerMove}
      onPointerUp={letGo}
      onPointerCancel={letGo}
      onLostPointerCapture={letGo}
      onPointerLeave={() => {
        setPointed(null);
        pointedTime.set(null);
      }}
      onKeyDown={onKeyDown}
    >
      <Bar axis={axis} timeline={timeline} columns={columns} />
      {awaited !== null && shown !== null && (
        <span className="timebar-arrived" style={{ left: `${place(shown)}px` }} />
      )}
      <span
        className="timebar-cursor"
        data-live={moment === null}
        data-awaited={awaited !== null}
        data-outside={isOutside}
        style={{ left: `${place(moment ?? lastIn)}px` }}
      />
      {ofChart !== null && ofChart >= from && ofChart <= to && (
        <span
          className="timebar-pointed"
          data-testid="timebar-pointed"
          style={{ left: `${place(ofChart)}px` }}
        />
      )}
      {pointed !== null && (
        <Bubble axis={axis} x={pointed} nowS={nowS} column={columnAt(columns, pointed)} />
      )}
    </div>
  );
}

/** A key's step, seconds; null: the bar does not handle it. */
function stepOf({ key, shiftKey }: KeyboardEvent, axis: Axis): number | null {
  const step = pixelS(axis) * (shiftKey ? FAR : 1);
  const page = (axis.to - axis.from) / PAGES;
  const steps: Readonly<Record<string, number>> = {
    ...{ ArrowLeft: -step, ArrowDown: -step, ArrowRight: step, ArrowUp: step },
    ...{ PageDown: -page, PageUp: page },
  };
  return steps[key] ?? null;
}

const countsText = ({ scans, failures, pests_seen, pests_cleared }: Column): string =>
  S.timebarCounts(scans, failures, pests_seen, pests_cleared);

const valueText = (moment: number | null, column: Column | undefined, newest: string): string => {
  const time = moment === null ? newest : rosText(moment);
  return column ? `${time}, ${countsText(column)}` : time;
};

function Bubble({
  axis,
  x,
  nowS,
  column,
}: {
  axis: Axis;
  x: number;
  nowS: number;
  column: Column | undefined;
}): JSX.Element {
  const chosen = chosenAt(axis, x, nowS);
  const left = Math.min(axis.width, Math.max(0, x));
  const side = left > axis.width / 2 ? 'before' : 'after';
  return (
    <span
      className="timebar-bubble"
      data-side={side}
      style={{ left: `${left}px` }}
      aria-hidden="true"
    >
      <strong>{chosen === null ? latestWord() : rosText(momentAt(axis, x))}</strong>
      {column && <span>{countsText(column)}</span>}
    </span>
  );
}
