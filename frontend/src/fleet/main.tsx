import { StrictMode } from 'react';
import { createRoot } from 'react-dom/client';

import '../styles/tokens.css';
import '../styles/base.css';
import '../styles/health.css';
import '../styles/fleet.css';
import '../styles/fleet-tables.css';
import { LANGUAGE } from '../strings';
import { ErrorBoundary } from '../ui/ErrorBoundary';
import { follow, type Seen } from './follow';
import { Overview } from './Overview';
import { words } from './sites';

const isKiosk = new URLSearchParams(window.location.search).has('kiosk');
const system = window.matchMedia('(prefers-color-scheme: dark)');
const theme = (): void => {
  document.documentElement.dataset['theme'] = system.matches ? 'dark' : 'light';
};

document.documentElement.lang = LANGUAGE;
document.title = words.sites;
system.addEventListener('change', theme);
theme();

const element = document.getElementById('root');
if (element) {
  const root = createRoot(element);
  const address = new URL('ws/sites', window.location.href);
  address.protocol = address.protocol.replace('http', 'ws');
  address.search = address.hash = '';
  const show = (seen: Seen): void => {
    root.render(
      <StrictMode>
        <ErrorBoundary>
          <Overview seen={seen} isKiosk={isKiosk} />
        </ErrorBoundary>
      </StrictMode>,
    );
  };
  follow(address.href, show, new AbortController().signal);
}
