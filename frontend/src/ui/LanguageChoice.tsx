import type { JSX } from 'react';

import { LANGUAGE, S } from '../strings';
import { inLanguage, LANGUAGE_NAMES, LANGUAGES, type Language } from '../words/languages';

/** The page's language: another one is another address, which keeps all else of the link. */
export function LanguageChoice(): JSX.Element {
  return (
    <label className="language">
      {S.language}
      <select
        value={LANGUAGE}
        data-testid="language"
        onChange={(event) => {
          window.location.assign(inLanguage(window.location, event.target.value as Language));
        }}
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
