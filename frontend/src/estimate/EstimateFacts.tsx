import type { JSX } from 'react';

import { fetchGrade } from '../contract/estimate';
import type { Grade, NoEstimate } from '../contract/types';
import { isMeasured } from '../domain/sensors';
import { shown } from '../domain/text';
import { useApp } from '../store/app';
import { selectSensor } from '../store/derived';
import { selectShown } from '../store/moment';
import { S } from '../strings';
import { More } from '../widgets/More';
import { errorText } from './texts';
import { useAsked } from './useAsked';
import { E } from './words';

const NOT_FOUND = 404;

/** How sure the estimate in view is, and how well it has foretold; or why there is none. */
export function EstimateFacts(): JSX.Element {
  const sensor = useApp(selectSensor);
  const unit = useApp((state) => state.settings.unit);
  const field = useApp((state) => selectShown(state).field.value);
  const isNow = useApp((state) => selectShown(state).moment === null);
  const isError = useApp((state) => state.view.heat === 'error');
  const grade = useAsked(fetchGrade);
  if (!isMeasured(sensor)) {
    return (
      <span role="status" className="estimate-missing" data-testid="estimate-missing">
        {E.computed}
      </span>
    );
  }
  const ofSensor = field?.sensor === sensor.name ? field : null;
  if (ofSensor?.noEstimate) return <Missing why={ofSensor.noEstimate} grade={grade.value} />;
  if (!ofSensor?.sureness) return <span role="status">{E.onItsWay}</span>;
  return (
    <>
      {!isError && (
        <span className="estimate-key" data-testid="estimate-key">
          {E.unsure(errorText(sensor, ofSensor.sureness.sdKnown, unit))}
        </span>
      )}
      {grade.value && <Foretold grade={grade.value} isNow={isNow} />}
    </>
  );
}

/** The nearest readings are shown, and why: once, in plain words. */
function Missing({ why, grade }: { why: NoEstimate; grade: Grade | null }): JSX.Element {
  const text =
    why.status === NOT_FOUND ? E.noService : grade?.fitted_at === null ? E.noModel : E.noneNow;
  const reason = grade?.fit_problem ? E.fitProblem(shown(grade.fit_problem, 160)) : why.message;
  return (
    <>
      <span role="status" className="estimate-missing" data-testid="estimate-missing">
        {text}
      </span>
      <More label={S.more} text={shown(reason, 300)} />
    </>
  );
}

/** Of fewer than ten scans each counts. */
function foretoldText({ day, share_day: share }: Grade): string {
  if (share === null) return E.foretoldNone;
  return day.scans < 10
    ? E.foretold(day.inside, day.scans)
    : E.foretold(Math.round(share * 10), 10);
}

function Foretold({ grade, isNow }: { grade: Grade; isNow: boolean }): JSX.Element {
  const { day, week } = grade;
  const least = Math.min(grade.share_day ?? 1, grade.share_week ?? 1);
  const behind = [
    E.aboutText,
    `${E.foretoldDay(day.inside, day.scans)}, ${E.foretoldWeek(week.inside, week.scans)}.`,
    ...(grade.fit_problem ? [`${E.fitProblem(shown(grade.fit_problem, 160))}.`] : []),
  ];
  return (
    <>
      {grade.is_trusted === false && (
        <strong role="status" className="estimate-warning" data-testid="estimate-warning">
          {E.notTrusted(Math.floor(least * 10))}
        </strong>
      )}
      {/* Of now, whatever moment is shown: beside another one it would be taken for that of then. */}
      {isNow && <span data-testid="foretold">{foretoldText(grade)}</span>}
      <More label={E.about} text={behind.join(' ')} />
    </>
  );
}
