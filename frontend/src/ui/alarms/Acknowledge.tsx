import type { JSX } from 'react';

import { mayAct, person, useSelected } from '../../store/create';
import { once } from './once';

/** The button that acknowledges, and in its place what has been done already: nothing moves for it. */
export function Acknowledge({
  label,
  text,
  status,
  onAcknowledge,
}: {
  label: string;
  text: string;
  /** What has been done; null: there is something to acknowledge. */
  status: string | null;
  onAcknowledge: () => void;
}): JSX.Element | null {
  const isAble = useSelected(person, mayAct);
  if (!isAble) {
    return status === null ? null : (
      <span className="alarm-status" title={status}>
        <span>{status}</span>
      </span>
    );
  }
  // It stays the same button, and keeps the focus: a keyboard goes on from here.
  return (
    <button
      type="button"
      className={status === null ? 'text-button' : 'alarm-status'}
      title={status ?? undefined}
      aria-label={status === null ? label : undefined}
      aria-disabled={status !== null}
      onClick={once(() => {
        if (status === null) onAcknowledge();
      })}
    >
      <span>{status ?? text}</span>
    </button>
  );
}
