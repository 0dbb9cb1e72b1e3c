/** One sensor of several greenhouses on one time axis, the outlier first. */
import 'uplot/dist/uPlot.min.css';
import '../styles/charts.css';

import { type JSX, useMemo, useRef, useState } from 'react';

import { lookOf } from '../charts/layers';
import type { Line, PlotModel } from '../charts/model';
import { usePlot } from '../charts/plot';
import { timeOfDay } from '../clock';
import { differenceNumber, readingText, withUnit } from '../domain/format';
import { isMeasured, type Sensor } from '../domain/sensors';
import { spanOf, rosText, type Span } from '../domain/time';
import { LANGUAGE, S } from '../strings';
import { Select } from '../widgets/controls';
import { VIEW_WORDS } from '../words/fleetViews';
import { Choice } from './Choice';
import { type Site, siteLink, words } from './sites';
import { useAnswer, useSensors } from './useAnswer';

const W = VIEW_WORDS[LANGUAGE];

const PERIODS = ['day', 'week', 'month'] as const;
type Period = (typeof PERIODS)[number];

const EVERY_MS = 60_000;
const HEIGHT = 320;
/** Drawn unless others are chosen. */
const DRAWN = 3;

export default function Compare({ shown }: { shown: readonly Site[] }): JSX.Element {
  const sensors = useSensors();
  const [name, setName] = useState('temperature');
  const [period, setPeriod] = useState<Period>('day');
  const [picked, setPicked] = useState<readonly string[] | null>(null);
  const [at, setAt] = useState<number | null>(null);
  const compared = shown.slice(0, MOST_SITES);
  // Sorted by name, so that a new worst site does not change the query.
  const sites = compared.map(({ site }) => site).sort();
  const hour = Math.floor(timeOfDay() / 3_600_000) * 3600;
  const { from } = spanOf({ kind: period }, hour, null);
  const path = `api/compare?sensor_type=${encodeURIComponent(name)}&from=${from}&sites=${sites.join(',')}`;
  const { value: found, message } = useAnswer<Compared>(path, ['sites', 'median'], EVERY_MS);
  const drawn = useMemo(
    () => picked ?? found?.sites.slice(0, DRAWN).map(({ site }) => site) ?? [],
    [picked, found],
  );
  const model = useMemo(
    () =>
      found && {
        ...{ sensor: sensors.named(found.sensor_type), span: found, moment: null },
        isMixed: false,
        bands: [{ ...found, ranges: sensors.named(found.sensor_type) }],
        lines: linesOf(found, drawn, W.median),
      },
    [found, drawn, sensors],
  );
  const isSilent = (name: string): boolean =>
    compared.some(({ site, is_live: isLive }) => site === name && !isLive);
  const toggle = (site: string): void => {
    setPicked(drawn.includes(site) ? drawn.filter((each) => each !== site) : [...drawn, site]);
  };
  return (
    <section className="fleet-compare" aria-label={words.compare}>
      <div className="fleet-head">
        <Select
          className="fleet-search"
          aria-label={S.sensors}
          value={name}
          options={sensors.all.filter(isMeasured).map((each) => each.name)}
          text={(each) => sensors.named(each).label}
          onChange={setName}
        />
        <Choice
          label={S.timebarPeriod}
          options={PERIODS}
          value={period}
          onChange={setPeriod}
          text={(each) => S.timebarPeriods[each]}
        />
        {compared.length < shown.length && (
          <p className="fleet-note">{W.someCompared(compared.length, shown.length)}</p>
        )}
      </div>
      {message && <p className="fleet-note">{W.notFetched(message)}</p>}
      {!found && !message && <p className="fleet-empty">{S.chartLoading}</p>}
      {found && model && (
        <>
          <Chart model={model} onPoint={setAt} />
          <p className="fleet-line">
            <Look place={MEDIAN_LOOK} /> {W.median}
          </p>
          <table className="fleet-table">
            <thead>
              <tr>
                <th scope="col" />
                <th scope="col">{words.sites}</th>
                <th scope="col">{at === null ? S.chartColumns.mean : rosText(at)}</th>
                <th scope="col" title={W.deviationHint}>
                  {W.deviation}
                </th>
              </tr>
            </thead>
            <tbody>
              {found.sites.map((site) => (
                <tr key={site.site}>
                  <td>
                    <label className="fleet-draw">
                      <input
                        type="checkbox"
                        aria-label={W.draw(site.name)}
                        checked={drawn.includes(site.site)}
                        disabled={!drawn.includes(site.site) && drawn.length >= MOST_DRAWN}
                        onChange={() => toggle(site.site)}
                      />
                      <Look place={drawn.indexOf(site.site)} />
                    </label>
                  </td>
                  <th scope="row">
                    <a href={`${siteLink(site)}#sensor=${encodeURIComponent(name)}`}>{site.name}</a>
                    {isSilent(site.site) && ` (${W.wasLive})`}
                  </th>
                  <td>{readingOrNone(model.sensor, valueAt(found, site, at))}</td>
                  <td>{deviationText(model.sensor, site)}</td>
                </tr>
              ))}
            </tbody>
          </table>
        </>
      )}
    </section>
  );
}

function Look({ place }: { place: number }): JSX.Element | null {
  if (place < 0) return null;
  const { colour, dash } = lookOf(place);
  return (
    <svg className="fleet-look" width={30} height={3} aria-hidden="true">
      <path
        d="M0 1.5H30"
        stroke={`var(--chart-${colour + 1})`}
        strokeWidth={2.5}
        strokeDasharray={dash.join(' ')}
      />
    </svg>
  );
}

const readingOrNone = (sensor: Sensor, value: number | null): string =>
  value === null ? S.noValue : readingText(sensor, value);

function deviationText(sensor: Sensor, { deviation }: ComparedSite): string {
  if (deviation === null) return S.noValue;
  return withUnit(sensor, differenceNumber(sensor, deviation));
}

function onSystemTheme(listener: () => void, signal: AbortSignal): void {
  const system = window.matchMedia('(prefers-color-scheme: dark)');
  system.addEventListener('change', listener, { signal });
}

function Chart({
  model,
  onPoint,
}: {
  model: PlotModel;
  onPoint: (at: number | null) => void;
}): JSX.Element {
  const place = useRef<HTMLDivElement>(null);
  const handlers = useMemo(() => ({ onPoint }), [onPoint]);
  usePlot(place, model, HEIGHT, true, handlers, onSystemTheme);
  return (
    <div
      ref={place}
      className="plot-place"
      role="img"
      aria-label={S.chartOf(model.sensor.label)}
      style={{ height: HEIGHT }}
      data-testid="plot"
    />
  );
}

type Values = readonly (number | null)[];

interface ComparedSite {
  readonly site: string;
  readonly name: string;
  readonly mean: number | null;
  /** Distance from the median of all, in the sensor's unit; null: no reading. */
  readonly deviation: number | null;
  readonly means: Values;
}

/** `/api/compare`: the outlier first. */
interface Compared extends Span {
  readonly sensor_type: string;
  readonly bucket_s: number;
  readonly low: Values;
  readonly median: Values;
  readonly high: Values;
  readonly sites: readonly ComparedSite[];
}

/** Most sites that the server compares. */
const MOST_SITES = 50;
/** Distinguishable lines beside the median's. */
const MOST_DRAWN = 6;
/** The median's own style: grey, dashed. */
const MEDIAN_LOOK = 6;

/** The median with its band, and the drawn sites, each with the style of its place in the list. */
function linesOf(found: Compared, drawn: readonly string[], median: string): Line[] {
  const sites = drawn.flatMap((name, look) => {
    const site = found.sites.find((each) => each.site === name);
    return site ? [lineOf(found, site.name, look, site.means, site.means, site.means)] : [];
  });
  return [lineOf(found, median, MEDIAN_LOOK, found.low, found.median, found.high), ...sites];
}

function lineOf(
  { from, to, bucket_s: bucketS, sensor_type: sensor }: Compared,
  label: string,
  look: number,
  ...[low, mean, high]: [low: Values, mean: Values, high: Values]
): Line {
  const points = mean.flatMap((value, index) => {
    const [min, max] = [low[index] ?? value, high[index] ?? value];
    return value === null ? [] : [{ at: from + index * bucketS, value, min, max, n: 1 }];
  });
  const gaps = mean.flatMap((value, index) =>
    value === null ? [{ from: from + index * bucketS, to: from + (index + 1) * bucketS }] : [],
  );
  const series = {
    ...{ from, to, tagId: label, sensor, bucketS },
    ...{ points, gaps, nights: null, missing: [] },
  };
  return { series, before: null, look, label, marks: [] };
}

/** A site's value in the bucket at a moment; without a moment, its mean. */
function valueAt(found: Compared, { mean, means }: ComparedSite, at: number | null) {
  if (at === null) return mean;
  return means[Math.floor((at - found.from) / found.bucket_s)] ?? null;
}
