import type { JSX } from 'react';

import { copyLink, reportLink, saveMap, saveTable, viewAddress } from '../export/actions';
import { failureText, type TemperatureUnit } from '../domain/format';
import { prefer, useApp } from '../store/app';
import type { Settings } from '../store/settings';
import { S } from '../strings';
import { Segmented, useClose } from '../widgets/controls';
import { openHelp } from './HelpDialog';
import { LanguageChoice } from './LanguageChoice';
import { SignOut } from './SignOut';
import { say } from './toast';

/** What the menu of the header holds. */
export function Menu(): JSX.Element {
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
      <LanguageChoice />
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
          <a href={reportLink()} target="_blank" rel="noopener" onClick={close}>
            {S.report}
          </a>
        </li>
        <li>
          <a href={kioskLink()}>{S.kiosk}</a>
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

/** The same view in the same language, on a wall. */
function kioskLink(): string {
  const url = viewAddress();
  url.searchParams.set('kiosk', '1');
  return url.href;
}

async function copyAndSay(): Promise<void> {
  say((await copyLink()) ? S.linkCopied : S.linkInBar);
}

async function saveMapOrSay(): Promise<void> {
  try {
    await saveMap();
  } catch (error) {
    say(S.exportFailed(failureText(error)));
  }
}
