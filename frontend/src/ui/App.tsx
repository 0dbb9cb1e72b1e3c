import type { CSSProperties, JSX } from 'react';

import { act, useApp } from '../store/app';
import { withList } from '../store/view';
import { useSelected } from '../store/create';
import { selectAspect, selectHealth } from '../store/derived';
import { selectHasSnapshot, selectIsRecorded, selectShown } from '../store/moment';
import { S } from '../strings';
import { AlarmsLabel } from './alarms/ListChoice';
import { Announcer } from './Announcer';
import { FrozenBanner, Troubles } from './Troubles';
import { Header, SimulatedNote } from './Header';
import { HealthMark } from './HealthMark';
import { HealthSummary } from './HealthSummary';
import { Icon } from '../widgets/controls';
import { useMedia } from '../widgets/useMedia';
import { MapPanel } from './MapPanel';
import { TagsPanel } from './TagsPanel';
import { toast } from './toast';
import { WithParts } from './loadDeferred';

export function App({ kiosk }: { kiosk: boolean }): JSX.Element {
  const phase = useApp((state) => state.twin.phase);
  const pane = useApp((state) => state.view.pane);
  const selected = useApp((state) => state.view.selected);
  const message = useSelected(toast);

  const moment = useApp((state) => selectShown(state).moment);
  const isPast = moment !== null;
  const isRecorded = useApp(selectIsRecorded);
  const aspect = useApp(selectAspect);
  const isWide = (aspect ?? 0) >= WIDE;
  const isRoomy = useMedia(roomy);
  const hasCharts = useApp((state) => state.view.chart !== null);
  const isStatusAbove = isWide && isRoomy && (kiosk || !hasCharts);

  return (
    <div
      className={kiosk ? 'app kiosk' : 'app'}
      data-testid="app"
      data-connection-state={phase}
      data-fresh={phase === 'live' && !isPast}
      data-past={isPast}
      data-recorded={isRecorded}
      data-moment={moment ?? 'now'}
      data-pane={pane}
    >
      {!kiosk && (
        <a className="skip" href="#tags" onClick={skipToTable}>
          {S.skipToTable}
        </a>
      )}
      <Header kiosk={kiosk}>
        {kiosk && <WithParts>{(parts) => <parts.KioskNote />}</WithParts>}
      </Header>
      <div className="banners">
        <FrozenBanner />
        <Troubles />
        <SimulatedNote />
      </div>
      <WithParts>{(parts) => <parts.PaperLine />}</WithParts>
      <main
        className="panels"
        data-wide={isWide && !kiosk}
        data-long={(aspect ?? 0) >= LONG && !kiosk}
        style={{ '--aspect': aspect ?? WIDE } as CSSProperties}
      >
        {isStatusAbove && <HealthSummary kiosk={kiosk} />}
        <MapPanel kiosk={kiosk} />
        <TagsPanel kiosk={kiosk} hasStatus={!isStatusAbove} />
        {selected !== null && !kiosk && (
          <WithParts>{(parts) => <parts.TagCard key={selected} tagId={selected} />}</WithParts>
        )}
        {/* Over the list; the map has its own. */}
        <WithParts>{(parts) => <parts.Meanwhile />}</WithParts>
      </main>
      {!kiosk && <PaneTabs />}
      <WithParts>{(parts) => <parts.HelpDialog />}</WithParts>
      <Announcer />
      <div className="toast" role="status">
        {message}
      </div>
    </div>
  );
}

/** A greenhouse is wide if it is at least this many times as wide as deep. */
const WIDE = 2;

/** And long if its map needs the page's full width. */
const LONG = 5;

/** Has room for the status above the map of a wide greenhouse. */
const roomy = window.matchMedia('(min-width: 64em) and (min-height: 43em)');

/** Moves the focus in code, because the URL fragment belongs to the permalink. */
function skipToTable(event: React.MouseEvent): void {
  event.preventDefault();
  act(withList('tags'));
  requestAnimationFrame(() => document.getElementById('tags')?.focus());
}

/** On a narrow screen: map, table or alarms. */
function PaneTabs(): JSX.Element {
  const shown = useApp(({ view }) => (view.pane === 'map' ? 'map' : view.list));
  const verdict = useApp((state) => selectHealth(state).verdict);
  const hasSnapshot = useApp(selectHasSnapshot);
  const tab = (name: 'map' | 'tags' | 'alarms', label: JSX.Element): JSX.Element => (
    <button
      type="button"
      aria-pressed={shown === name}
      onClick={() => act(name === 'map' ? { pane: 'map', chartedFrom: null } : withList(name))}
    >
      <Icon name={name === 'map' ? 'map' : name === 'tags' ? 'list' : 'bell'} />
      <span>{label}</span>
      {name === 'tags' && hasSnapshot && <HealthMark verdict={verdict} word={false} />}
    </button>
  );
  return (
    <nav className="pane-tabs" aria-label={`${S.mapRegion} / ${S.tags} / ${S.alarms}`}>
      {tab('map', <>{S.mapRegion}</>)}
      {tab('tags', <>{S.tags}</>)}
      {tab('alarms', <AlarmsLabel />)}
    </nav>
  );
}
