import { StrictMode } from 'react';
import { createRoot } from 'react-dom/client';

import './styles/tokens.css';
import './styles/base.css';
import './styles/layout.css';
import './styles/devices.css';
import './styles/map.css';
import './styles/legend.css';
import './styles/health.css';
import './styles/strip.css';
import './styles/long.css';
import './styles/table.css';
import './styles/table-sizes.css';
import './styles/ages.css';
import './styles/kiosk.css';
import './styles/frozen.css';
import './styles/troubles.css';
import './styles/past.css';
import './styles/forced.css';
import { startAlarmsAndAnnouncements } from './alarms/watch';
import { startAddress } from './store/address';
import { onChange, prefer, store } from './store/app';
import { cycleSeconds, startCycle } from './store/cycle';
import { startHourAgo } from './store/hourAgo';
import { startLive } from './store/live';
import { startLoaders, startSensors } from './store/loaders';
import { startPast } from './store/past';
import { keepStored, openStorage, readSettings, SETTINGS_KEY } from './store/settings';
import { startTheme } from './store/theme';
import { LANGUAGE, S } from './strings';
import { App } from './ui/App';
import { ErrorBoundary } from './ui/ErrorBoundary';
import { startKeys } from './ui/keys';
import { loadParts } from './ui/loadDeferred';

const storage = openStorage();
prefer(readSettings(storage));
onChange(
  ({ settings }) => [settings],
  () => keepStored(storage, SETTINGS_KEY, store.get().settings),
);
// Tabs share them: a sound that is turned off in one stops in all.
window.addEventListener('storage', () => prefer(readSettings(storage)));

const kiosk = new URLSearchParams(window.location.search).has('kiosk');
const cycle = cycleSeconds(window.location.search);

document.documentElement.lang = LANGUAGE;
document.title = S.product;
startTheme();
startAddress(kiosk, cycle !== null);
startSensors();
startLoaders();
startAlarmsAndAnnouncements(storage);
startLive();
if (kiosk) {
  startCycle(cycle);
} else {
  startPast();
  startHourAgo();
  startKeys();
}

void loadParts().then((parts) => {
  parts.startDifference();
  parts.startBadge();
  parts.startSound();
  parts.startNotify();
  parts.startPeople();
  parts.startShell();
  if (kiosk) {
    parts.startKioskClose();
  } else {
    parts.startNotes();
    parts.startRemembered();
    parts.startOpening();
  }
});

const root = document.getElementById('root');
if (!root) throw new Error('index.html has no #root');
createRoot(root).render(
  <StrictMode>
    <ErrorBoundary>
      <App kiosk={kiosk} />
    </ErrorBoundary>
  </StrictMode>,
);
