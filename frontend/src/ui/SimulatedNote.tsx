import type { JSX } from 'react';

import { rosText, secondsOf } from '../domain/time';
import { useApp, type AppState } from '../store/app';
import { selectOrigin, selectShown } from '../store/moment';
import { S } from '../strings';

/** Where the simulated past ends, if the moment that is shown lies in it, and not all is simulated; ROS seconds. */
export function selectSimulatedUntil(state: AppState): number | null {
  const { moment } = selectShown(state);
  const simulated = state.twin.connection.status?.journal.simulated;
  // Of a simulation what comes after is no more real.
  if (moment === null || !simulated || selectOrigin(state) === 'simulated') return null;
  const end = secondsOf(simulated.end);
  return moment < end ? end : null;
}

/** Says that what is shown was not observed: a demo begins with days that a simulation made. */
export function SimulatedNote(): JSX.Element {
  const until = useApp(selectSimulatedUntil);
  return (
    <div role="status" className="troubles simulated" data-testid="simulated">
      {until !== null && (
        <p>
          <strong>{S.simulated}</strong> <span>{S.simulatedHint(rosText(until))}</span>
        </p>
      )}
    </div>
  );
}
