import type { JSX, ReactNode } from 'react';

import { route } from '../contract/api';
import { signOut } from '../contract/people';
import { failureText } from '../domain/format';
import { reportLink, saveMap, saveTable, viewAddress } from '../export/actions';
import { prefer, useApp } from '../store/app';
import { person, useSelected } from '../store/create';
import { LANGUAGE, S } from '../strings';
import { Segmented, useClose } from '../widgets/controls';
import { LANGUAGE_NAMES, LANGUAGES } from '../words/languages';
import { openHelp } from './HelpDialog';
import { say } from './toast';

/** The header menu's content. */
export function Menu(): JSX.Element {
  const close = useClose();
  const { theme, unit } = useApp((state) => state.settings);
  const entry = (label: ReactNode, action: () => void): JSX.Element => (
    <li>
      <button
        type="button"
        onClick={() => {
          close();
          action();
        }}
      >
        {label}
      </button>
    </li>
  );
  return (
    <>
      <Segmented
        legend={S.theme}
        value={theme}
        options={['system', 'light', 'dark'] as const}
        text={(each) => S.themes[each]}
        onChange={(value) => prefer({ theme: value })}
      />
      <Segmented
        legend={S.unit}
        value={unit}
        options={['C', 'F'] as const}
        text={(each) => `°${each}`}
        onChange={(value) => prefer({ unit: value })}
      />
      <LanguageChoice />
      <ul className="menu-list">
        {entry(S.savePng, () => void saveMapOrSay())}
        {entry(S.saveCsv, saveTable)}
        {entry(S.print, () => window.print())}
        <li>
          <a href={reportLink()} target="_blank" rel="noopener" onClick={close}>
            {S.report}
          </a>
        </li>
        <li>
          <a href={viewAddress({ kiosk: '1' })}>{S.kiosk}</a>
        </li>
        {entry(
          <>
            {S.help} <kbd>?</kbd>
          </>,
          openHelp,
        )}
        <SignOut close={close} />
      </ul>
    </>
  );
}

async function saveMapOrSay(): Promise<void> {
  try {
    await saveMap();
  } catch (error) {
    say(S.exportFailed(failureText(error)));
  }
}

/** Chooses the language by loading the same view with another language. */
function LanguageChoice(): JSX.Element {
  return (
    <label className="language">
      {S.language}
      <select
        value={LANGUAGE}
        data-testid="language"
        onChange={(event) => window.location.assign(viewAddress({ lang: event.target.value }))}
      >
        {LANGUAGES.map((each) => (
          <option key={each} value={each} lang={each}>
            {LANGUAGE_NAMES[each]}
          </option>
        ))}
      </select>
    </label>
  );
}

/** The menu's last entry, if there is a session to end. */
export function SignOut({
  close,
  leave = goTo,
}: {
  close: () => void;
  leave?: (url: URL) => void;
}): JSX.Element | null {
  const session = useSelected(person);
  if (!session?.can_sign_out) return null;
  const end = async (): Promise<void> => {
    close();
    try {
      await signOut();
    } catch (error) {
      say(S.signOutFailed(failureText(error)));
      return;
    }
    leave(route('signin'));
  };
  return (
    <li>
      <button type="button" onClick={() => void end()}>
        {S.signOut}
        {session.name && (
          <>
            {' '}
            <bdi>({session.name})</bdi>
          </>
        )}
      </button>
    </li>
  );
}

function goTo(url: URL): void {
  window.location.assign(url);
}
