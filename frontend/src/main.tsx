import { StrictMode } from 'react';
import { createRoot } from 'react-dom/client';

import './styles/tokens.css';
import './styles/base.css';
import './styles/layout.css';
import './styles/map.css';
import './styles/legend.css';
import './styles/health.css';
import './styles/table.css';
import './styles/table-sizes.css';
import './styles/card.css';
import './styles/hover.css';
import './styles/ages.css';
import './styles/bound.css';
import './styles/paper.css';
import './styles/kiosk.css';
import './styles/frozen.css';
import './styles/troubles.css';
import './styles/forced.css';
import './styles/print.css';
import { startAddress } from './store/address';
import { prefer, store } from './store/app';
import { startLive } from './store/live';
import { startLoaders } from './store/loaders';
import { keepSettings, openStorage, readSettings } from './store/settings';
import { startTheme } from './store/theme';
import { App } from './ui/App';
import { ErrorBoundary } from './ui/ErrorBoundary';
import { startShortcuts } from './ui/shortcuts';

const storage = openStorage();
prefer(readSettings(storage));
let { settings } = store.get();
store.subscribe(() => {
  if (store.get().settings === settings) return;
  ({ settings } = store.get());
  keepSettings(storage, settings);
});

const kiosk = new URLSearchParams(window.location.search).get('kiosk') === '1';

startTheme();
startAddress(kiosk);
startLoaders();
startLive();
if (!kiosk) startShortcuts();

const root = document.getElementById('root');
if (!root) throw new Error('index.html has no #root');
createRoot(root).render(
  <StrictMode>
    <ErrorBoundary kiosk={kiosk}>
      <App kiosk={kiosk} />
    </ErrorBoundary>
  </StrictMode>,
);
