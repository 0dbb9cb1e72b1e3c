import { useEffect, type JSX } from 'react';

import { act, useApp } from '../store/app';
import { useSelected } from '../store/create';
import { selectHealth } from '../store/derived';
import { selectSnapshot } from '../store/moment';
import { S } from '../strings';
import { Announcer } from './Announcer';
import { FrozenBanner } from './FrozenBanner';
import { Header } from './Header';
import { HelpDialog } from './HelpDialog';
import { HealthMark } from './HealthMark';
import { Icon } from './Icon';
import { PaperLine } from './PaperLine';
import { MapPanel } from './MapPanel';
import { TagCard } from './TagCard';
import { TagsPanel } from './TagsPanel';
import { toast } from './toast';
import { Troubles } from './Troubles';

export function App({ kiosk }: { kiosk: boolean }): JSX.Element {
  const phase = useApp((state) => state.twin.phase);
  const pane = useApp((state) => state.view.pane);
  const selected = useApp((state) => state.view.selected);
  const message = useSelected(toast, (text) => text);

  const hasTags = useApp((state) => selectSnapshot(state) !== null);

  // The row of the chosen tag comes into view, once its card has taken its place.
  useEffect(() => {
    if (selected === null || !hasTags) return undefined;
    const frame = requestAnimationFrame(() => {
      document
        .querySelector(`tr[data-tag-id="${CSS.escape(selected)}"]`)
        ?.scrollIntoView({ block: 'nearest' });
    });
    return () => {
      cancelAnimationFrame(frame);
    };
  }, [selected, hasTags]);

  return (
    <div
      className={kiosk ? 'app kiosk' : 'app'}
      data-testid="app"
      data-connection-state={phase}
      data-fresh={phase === 'live'}
      data-pane={pane}
    >
      {!kiosk && (
        <a className="skip" href="#tags" onClick={skipToTable}>
          {S.skipToTable}
        </a>
      )}
      <Header kiosk={kiosk} />
      <div className="banners">
        <FrozenBanner />
        <Troubles />
      </div>
      <PaperLine />
      <main className="panels">
        <MapPanel kiosk={kiosk} />
        <TagsPanel kiosk={kiosk} />
        {selected !== null && !kiosk && <TagCard key={selected} tagId={selected} />}
      </main>
      {!kiosk && <PaneTabs />}
      <HelpDialog />
      <Announcer />
      <div className="toast" role="status">
        {message}
      </div>
    </div>
  );
}

/** By hand, because the fragment of the address belongs to the permalink. */
function skipToTable(event: React.MouseEvent): void {
  event.preventDefault();
  act({ type: 'pane', pane: 'tags' });
  requestAnimationFrame(() => document.getElementById('tags')?.focus());
}

/** On a narrow screen: map or table. */
function PaneTabs(): JSX.Element {
  const pane = useApp((state) => state.view.pane);
  const status = useApp((state) => selectHealth(state).status);
  const tab = (name: 'map' | 'tags', label: string): JSX.Element => (
    <button
      type="button"
      aria-pressed={pane === name}
      onClick={() => {
        act({ type: 'pane', pane: name });
      }}
    >
      <Icon name={name === 'map' ? 'map' : 'list'} />
      {label}
      {name === 'tags' && <HealthMark status={status} word={false} />}
    </button>
  );
  return (
    <nav className="pane-tabs" aria-label={`${S.mapRegion} / ${S.tags}`}>
      {tab('map', S.mapRegion)}
      {tab('tags', S.tags)}
    </nav>
  );
}
