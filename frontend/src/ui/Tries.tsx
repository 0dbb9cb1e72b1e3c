import type { JSX } from 'react';

import type { PastAttempt } from '../contract/types';
import { shown } from '../domain/text';
import { tryKind } from '../domain/health';
import { whenOf } from '../domain/twin';
import { useApp } from '../store/app';
import { selectSnapshot } from '../store/moment';
import { S } from '../strings';
import { Age } from './Age';

const LONGEST = 5;

/** The last scans and looks of a tag, newest first, those that came to nothing too. */
export function Tries({ tries }: { tries: readonly PastAttempt[] }): JSX.Element | null {
  const snapshot = useApp(selectSnapshot);
  if (!snapshot || tries.length === 0) return null;
  return (
    <section className="card-tries" aria-label={S.cardTries}>
      <h3>{S.cardTries}</h3>
      <ol>
        {tries
          .slice(-LONGEST)
          .reverse()
          .map((each, index) => (
            <li key={index} data-status={each.status}>
              <Age when={whenOf(each.stamp, snapshot)} />
              <span>{kindOf(each.kind)}</span>
              <span>
                {S.tried[tryKind(each.status)]}
                {each.status_detail && (
                  <span className="faint"> {shown(each.status_detail, 160)}</span>
                )}
              </span>
            </li>
          ))}
      </ol>
    </section>
  );
}

const kindOf = (kind: number | null): string =>
  kind === 0 ? S.cardTryKinds.scan : kind === 1 ? S.cardTryKinds.look : S.cardTryKinds.any;
