import type { JSX } from 'react';

import type { Mark } from '../domain/series';
import { S } from '../strings';

/** What the marks below the lines are, and how many of each; nothing where there are none. */
export function MarksKey({ marks }: { marks: readonly Mark[] }): JSX.Element | null {
  const count = (kind: Mark['kind']): number =>
    marks.reduce((sum, mark) => sum + (mark.kind === kind ? mark.count : 0), 0);
  const [looks, failures] = [count('look'), count('failure')];
  if (looks + failures === 0) return null;
  return (
    <p className="marks-key" data-testid="marks-key">
      {looks > 0 && (
        <span data-mark="look">
          <span aria-hidden="true">○</span> {S.chartLooks(looks)}
        </span>
      )}
      {failures > 0 && (
        <span data-mark="failure">
          <span aria-hidden="true">✕</span> {S.chartFailures(failures)}
        </span>
      )}
    </p>
  );
}
