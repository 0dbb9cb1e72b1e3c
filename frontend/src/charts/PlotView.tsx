import 'uplot/dist/uPlot.min.css';
import '../styles/charts.css';

import { useEffect, useLayoutEffect, useRef, useState, type CSSProperties, type JSX } from 'react';

import { rgbText, sensorColour } from '../domain/ramp';
import { rosText } from '../domain/rostime';
import { shown } from '../domain/text';
import { unitOf } from '../domain/units';
import { CommentMarks } from '../notes/CommentMarks';
import { act } from '../store/app';
import { useSelected } from '../store/create';
import { pointedBy, pointedTime } from '../store/signals';
import { onThemeChange } from '../store/theme';
import { S } from '../strings';
import { LineValue, useTold } from './LineValue';
import type { PlotModel } from './model';
import { createPlot, type Plot } from './plot';
import { plotText } from './told';
import { zoomTo } from './zoom';

/** One chart. `isAlone`: its one line has the sensor's colour, and no list beside it that says its value. */
export function PlotView({
  model,
  height,
  isAlone = true,
  hasTimes = true,
}: {
  model: PlotModel;
  height: number;
  isAlone?: boolean;
  hasTimes?: boolean;
}): JSX.Element {
  const place = useRef<HTMLDivElement>(null);
  const plot = useRef<Plot | null>(null);
  const [width, setWidth] = useState(0);
  const ofBar = useSelected(pointedTime, pointedBy('bar'));
  const { at } = useTold();
  const only = isAlone ? model.lines[0] : undefined;

  useLayoutEffect(() => {
    const element = place.current;
    if (!element) return undefined;
    const mine = createPlot(element, {
      onPoint: (time) => {
        pointedTime.dispatch(time === null ? null : { at: time, by: 'chart' });
      },
      onPick: (time) => {
        act({ type: 'moment', moment: time });
      },
      onZoom: zoomTo,
    });
    plot.current = mine;
    const resize = new ResizeObserver(([entry]) => {
      if (entry) setWidth(Math.floor(entry.contentRect.width));
    });
    resize.observe(element);
    const stop = onThemeChange(mine.recolour);
    return () => {
      plot.current = null;
      stop();
      resize.disconnect();
      mine.destroy();
      pointedTime.dispatch(null);
    };
  }, []);

  useEffect(() => {
    plot.current?.point(ofBar);
  }, [ofBar]);

  useEffect(() => {
    if (width > 0) plot.current?.show(model, { width, height, hasTimes });
  }, [model, width, height, hasTimes]);

  return (
    <section
      className="plot-view"
      aria-label={S.chartOf(shown(model.sensor.label, 32))}
      data-alone={isAlone}
      data-told={at !== null}
      style={{ '--sensor': rgbText(sensorColour(model.sensor)) } as CSSProperties}
    >
      <header>
        <h3>
          {shown(model.sensor.label, 32)}{' '}
          <span className="faint">{unitOf(model.sensor, model.unit)}</span>
        </h3>
        {only && <LineValue line={only} model={model} />}
        {model.isMixed && <span className="faint">{S.chartIdealsDiffer}</span>}
        {at !== null && <span className="plot-time faint">{rosText(at)}</span>}
      </header>
      <div className="plot-comments">
        <CommentMarks span={model.span} tagIds={model.lines.map(({ series }) => series.tagId)} />
      </div>
      <div
        ref={place}
        className="plot-place"
        role="img"
        aria-label={plotText(model)}
        style={{ height }}
        data-testid="plot"
      />
    </section>
  );
}
