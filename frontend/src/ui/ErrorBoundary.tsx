import { Component, useEffect, type JSX, type ReactNode } from 'react';

import { shown } from '../domain/text';
import { S } from '../strings';
import { reloadByItself, reloadNow } from './reload';

/** Replaces a page that has failed with the error, and loads it anew: never a blank screen. */
export class ErrorBoundary extends Component<{ readonly children: ReactNode }> {
  override state: Readonly<{ why: string | null }> = { why: null };

  static getDerivedStateFromError(error: unknown): { readonly why: string } {
    return { why: error instanceof Error ? `${error.name}: ${error.message}` : String(error) };
  }

  override render(): ReactNode {
    const { why } = this.state;
    return why === null ? this.props.children : <Failed why={why} />;
  }
}

function Failed({ why }: { why: string }): JSX.Element {
  // Nobody may be there to press the button. An updated server's new page reads what the old one could not.
  useEffect(() => reloadByItself(), []);
  return (
    <main className="failed-page" role="alert" data-testid="failed-page">
      <h1>{S.failedTitle}</h1>
      <p>{S.failedHint}</p>
      <p>
        <code>{shown(why, 300)}</code>
      </p>
      <button type="button" onClick={reloadNow}>
        {S.reload}
      </button>
    </main>
  );
}
