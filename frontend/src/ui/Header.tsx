import type { JSX } from 'react';

import { copyLink, saveMap, saveTable } from '../export/actions';
import { prefer, useApp } from '../store/app';
import type { Settings } from '../store/settings';
import type { TemperatureUnit } from '../domain/units';
import { S } from '../strings';
import { ConnectionBadge } from './ConnectionBadge';
import { Disclosure, useClose } from './Disclosure';
import { openHelp } from './HelpDialog';
import { Icon } from './Icon';
import { Segmented } from './Segmented';
import { SignOut } from './SignOut';
import { say } from './toast';

export function Header({ kiosk }: { kiosk: boolean }): JSX.Element {
  return (
    <header className="header">
      <h1 className="brand">
        <img src="./lupin.svg" alt="" width="28" height="28" />
        <span>
          {S.product} <span className="brand-sub">{S.subtitle}</span>
        </span>
      </h1>
      <ConnectionBadge />
      {!kiosk && (
        <Disclosure label={S.menu} button={<Icon name="menu" />} className="menu">
          <Menu />
        </Disclosure>
      )}
    </header>
  );
}

function Menu(): JSX.Element {
  const close = useClose();
  const { theme, unit } = useApp((state) => state.settings);
  const then = (action: () => void) => () => {
    close();
    action();
  };
  return (
    <>
      <Segmented<Settings['theme']>
        legend={S.theme}
        value={theme}
        options={[
          { value: 'system', label: S.themes.system },
          { value: 'light', label: S.themes.light },
          { value: 'dark', label: S.themes.dark },
        ]}
        onChange={(value) => {
          prefer({ theme: value });
        }}
      />
      <Segmented<TemperatureUnit>
        legend={S.unit}
        value={unit}
        options={[
          { value: 'C', label: '°C' },
          { value: 'F', label: '°F' },
        ]}
        onChange={(value) => {
          prefer({ unit: value });
        }}
      />
      <ul className="menu-list">
        <li>
          <button type="button" onClick={then(() => void copyAndSay())}>
            {S.copyLink}
          </button>
        </li>
        <li>
          <button type="button" onClick={then(() => void saveMapOrSay())}>
            {S.savePng}
          </button>
        </li>
        <li>
          <button type="button" onClick={then(saveTable)}>
            {S.saveCsv}
          </button>
        </li>
        <li>
          <button
            type="button"
            onClick={then(() => {
              window.print();
            })}
          >
            {S.print}
          </button>
        </li>
        <li>
          <a href={`?kiosk=1${window.location.hash}`}>{S.kiosk}</a>
        </li>
        <li>
          <button type="button" onClick={then(openHelp)}>
            {S.help} <kbd>?</kbd>
          </button>
        </li>
        <SignOut close={close} />
      </ul>
    </>
  );
}

async function copyAndSay(): Promise<void> {
  say((await copyLink()) ? S.linkCopied : S.linkInBar);
}

async function saveMapOrSay(): Promise<void> {
  try {
    await saveMap();
  } catch (error) {
    say(S.exportFailed(error instanceof Error ? error.message : String(error)));
  }
}
