import { Component, useEffect, type JSX, type ReactNode } from 'react';

import { shown } from '../domain/text';
import { S } from '../strings';
import { reloadByItself, reloadNow } from './reload';

interface Props {
  readonly kiosk: boolean;
  readonly children: ReactNode;
}

/** Replaces a page that has failed with the error and a reload button: never a blank screen. */
export class ErrorBoundary extends Component<Props, Readonly<{ why: string | null }>> {
  override state: Readonly<{ why: string | null }> = { why: null };

  static getDerivedStateFromError(error: unknown): { readonly why: string } {
    return { why: error instanceof Error ? `${error.name}: ${error.message}` : String(error) };
  }

  override render(): ReactNode {
    const { why } = this.state;
    return why === null ? this.props.children : <Failed why={why} kiosk={this.props.kiosk} />;
  }
}

function Failed({ why, kiosk }: { why: string; kiosk: boolean }): JSX.Element {
  // On a wall screen, nobody can press the button.
  useEffect(() => (kiosk ? reloadByItself() : undefined), [kiosk]);
  return (
    <main className="failed-page" role="alert" data-testid="failed-page">
      <h1>{S.failedTitle}</h1>
      <p>
        {S.failedHint} {kiosk && S.failedAgain}
      </p>
      <p>
        <code>{shown(why, 300)}</code>
      </p>
      <button type="button" onClick={reloadNow}>
        {S.reload}
      </button>
    </main>
  );
}
