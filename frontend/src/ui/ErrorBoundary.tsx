import { Component, useEffect, type JSX, type ReactNode } from 'react';

import { shown } from '../domain/text';
import { S } from '../strings';
import { reloadByItself, reloadNow } from './reload';

/** Pause before a failed part is shown again, ms: by then, another answer may have arrived. */
const AGAIN_MS = 10_000;

/** Replaces what has failed with the error: the page, which is then loaded anew, or a part of it. */
export class ErrorBoundary extends Component<{
  readonly children: ReactNode;
  readonly isPart?: boolean;
}> {
  override state: Readonly<{ why: string | null }> = { why: null };
  #timer: ReturnType<typeof setTimeout> | undefined;

  static getDerivedStateFromError(error: unknown): { readonly why: string } {
    return { why: error instanceof Error ? `${error.name}: ${error.message}` : String(error) };
  }

  override componentDidCatch(): void {
    if (!this.props.isPart) return;
    this.#timer = setTimeout(() => this.setState({ why: null }), AGAIN_MS);
  }

  override componentWillUnmount(): void {
    clearTimeout(this.#timer);
  }

  override render(): ReactNode {
    const { why } = this.state;
    if (why === null) return this.props.children;
    return this.props.isPart ? <PartMissing why={why} /> : <Failed why={why} />;
  }
}

function Failed({ why }: { why: string }): JSX.Element {
  // Nobody may be there to press the button. An updated server's new page reads what the old one could not.
  useEffect(() => {
    return reloadByItself();
  }, []);
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

/** In place of a part that could not be loaded or shown. */
export const PartMissing = ({ why = '' }: { why?: string }): JSX.Element => (
  <span className="part-missing" role="status">
    {S.partMissing} {why !== '' && <code>{shown(why, 160)}</code>}
  </span>
);
