import type { JSX, ReactNode } from 'react';

import { S } from '../strings';
import { OriginNote, PastHeader } from '../timebar/Past';
import { Disclosure, Icon } from '../widgets/controls';
import { ConnectionBadge } from './ConnectionBadge';
import { WithParts } from './WithParts';

/** Which of a fleet's greenhouses the page shows; a page of one greenhouse is below no `/sites/`. */
function siteName(): string | undefined {
  return /\/sites\/([^/]+)\/$/.exec(location.pathname)?.[1];
}

export function Header({ kiosk, children }: { kiosk: boolean; children?: ReactNode }): JSX.Element {
  return (
    <header className="header">
      <h1 className="brand">
        <img src="./lupin.svg" alt="" width="28" height="28" />
        <span>
          {S.product} <span className="brand-sub">{siteName() ?? S.subtitle}</span>
        </span>
      </h1>
      <PastHeader />
      {children}
      <OriginNote />
      <ConnectionBadge />
      {!kiosk && (
        <Disclosure label={S.menu} button={<Icon name="menu" />} className="menu">
          <WithParts>{(parts) => <parts.Menu />}</WithParts>
        </Disclosure>
      )}
    </header>
  );
}
