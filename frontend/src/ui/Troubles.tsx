import type { JSX } from 'react';

import { shown } from '../domain/text';
import { useApp } from '../store/app';
import type { TwinState } from '../store/twin';
import { S } from '../strings';

/** Something that an operator should know of while the page goes on. */
export interface Trouble {
  readonly id: string;
  readonly title: string;
  readonly detail?: string;
}

export function troublesOf({ unread, phase, connection }: TwinState): readonly Trouble[] {
  const troubles: Trouble[] = [];
  if (unread) {
    troubles.push({
      id: 'unread',
      title: S.unread(unread.count),
      detail: S.unreadLast(shown(unread.why, 160)),
    });
  }
  const { status } = connection;
  if (phase === 'live' && status?.reason === 'paused') {
    troubles.push({ id: 'paused', title: S.paused, detail: S.pausedHint });
  }
  for (const { reason, message, count } of status?.drops ?? []) {
    troubles.push({
      id: `drop ${reason}`,
      title: S.drops(count),
      detail: S.dropsLast(shown(message, 160)),
    });
  }
  return troubles;
}

/** A line each, below the header. */
export function Troubles(): JSX.Element {
  const twin = useApp((state) => state.twin);
  return (
    // There before there is something to tell, or a screen reader would not hear it.
    <div role="status" className="troubles" data-testid="troubles">
      {troublesOf(twin).map(({ id, title, detail }) => (
        <p key={id} data-trouble={id}>
          <strong>{title}</strong> {detail && <span>{detail}</span>}
        </p>
      ))}
    </div>
  );
}
