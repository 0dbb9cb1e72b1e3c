import type { JSX } from 'react';

import { epochOf } from '../clock';
import type { Journal, Outward, StatusFrame } from '../contract/types';
import { ageText, clockText } from '../domain/format';
import { shown } from '../domain/text';
import { rosText } from '../domain/time';
import { useApp } from '../store/app';
import { useSelected } from '../store/create';
import { retryConnection } from '../store/live';
import { selectClockFault, selectLatest, selectShown } from '../store/moment';
import type { TwinState } from '../store/twin';
import { LANGUAGE_TROUBLE, S } from '../strings';
import { More } from '../widgets/controls';
import { useNow } from '../widgets/useNow';
import { deferred } from './loadDeferred';

/** A problem that the operator should know about while the page keeps working. */
export interface Trouble {
  readonly id: string;
  readonly title: string;
  readonly detail?: string;
  /** For whoever maintains the system: the cause, in the English of the twin or the server... */
  readonly cause?: string;
  /** ...and what to know about it. */
  readonly more?: string;
}

function troublesOf(
  { unread, phase, connection, pastFault }: TwinState,
  moment: number | null = null,
  isLate = false,
): readonly Trouble[] {
  const troubles: Trouble[] = [];
  if (LANGUAGE_TROUBLE !== null) troubles.push({ id: 'language', title: LANGUAGE_TROUBLE });
  if (isLate) troubles.push({ id: 'parts', title: S.partsLate, detail: S.partsLateHint });
  if (unread) {
    troubles.push({ id: 'unread', title: S.unread(unread.count), cause: sentence(unread.why) });
  }
  const { status } = connection;
  if (phase === 'live' && status && status.twin_count > 1) {
    troubles.push({ id: 'mixture', title: S.mixture });
  }
  if (phase === 'live' && status?.reason === 'paused') {
    troubles.push(
      status.origin === 'recorded'
        ? { id: 'paused', title: S.recordedPaused, detail: S.recordedPausedHint }
        : { id: 'paused', title: S.paused, detail: S.pausedHint },
    );
  }
  troubles.push(...journalTroubles(status?.journal));
  troubles.push(...notificationTroubles(status?.outward ?? []));
  // If nothing is shown at all, the notice on the map says why.
  if (pastFault && moment !== null && pastFault.at !== moment) {
    troubles.push({
      id: 'past',
      title: S.pastFault(rosText(pastFault.at), shown(pastFault.message, 160)),
      detail: S.pastFaultShown(rosText(moment)),
    });
  }
  const problems = status?.input_problems ?? [];
  if (problems.length > 0) {
    const cause = problems.map((problem) => sentence(problem, MAX_PROBLEM)).join(' ');
    troubles.push({ id: 'input', title: S.inputProblem, cause });
  }
  for (const { reason, message, count } of status?.drops ?? []) {
    troubles.push({ id: `drop ${reason}`, title: S.drops(count), cause: sentence(message) });
  }
  return troubles;
}

/** Longest input problem that the twin reports, in characters: its end says what to do. */
const MAX_PROBLEM = 500;

/** A text by a name from the server, which may be of a later version; undefined: none. */
const textFor = <Text,>(texts: Readonly<Record<string, Text>>, name = ''): Text | undefined =>
  Object.hasOwn(texts, name) ? texts[name] : undefined;

/** A journal that does not record, or a damaged one that was quarantined. */
function journalTroubles(journal: Journal | undefined): readonly Trouble[] {
  if (!journal) return [];
  const troubles: Trouble[] = [];
  const trouble = textFor(S.journal, journal.state);
  if (trouble) {
    troubles.push({
      id: `journal ${journal.state}`,
      title: trouble.title,
      detail: trouble.hint,
      cause: sentence(journal.detail),
      more: S.journalMore,
    });
  }
  if (journal.set_aside) {
    const detail = S.quarantinedHint(shown(journal.set_aside, 160));
    troubles.push({ id: 'journal set aside', title: S.quarantined, detail });
  }
  return troubles;
}

/** Failing notification channels. A channel unknown to this page is called by its name. */
function notificationTroubles(channels: readonly Outward[]): readonly Trouble[] {
  return channels
    .filter((it) => it.is_failing)
    .map(({ channel, detail }) => ({
      id: `outward ${channel}`,
      title: textFor(S.notificationChannels, channel) ?? S.notificationOther(shown(channel, 40)),
      detail: S.notificationHint,
      cause: sentence(detail),
    }));
}

const UTC = /[\d-]{10}T[\d:]{8}Z/g;

/** A text of the twin's as a sentence, its times in the page's own form. */
function sentence(text: string, most = 240): string {
  const said = shown(text, most).replace(UTC, (time) => rosText(Date.parse(time) / 1000));
  return said && `${said.charAt(0).toUpperCase()}${said.slice(1).replace(/\.$/, '')}.`;
}

/** Problems below the header, one per line. */
export function Troubles(): JSX.Element {
  const twin = useApp((state) => state.twin);
  const moment = useApp((state) => selectShown(state).moment);
  const isLate = useSelected(deferred, (it) => it.isLate);
  return (
    // Rendered even when empty: screen readers announce only changes in an existing region.
    <div role="status" className="troubles" data-testid="troubles">
      {troublesOf(twin, moment, isLate).map(({ id, title, detail, cause, more }) => (
        <div key={id}>
          <strong>{title}</strong> {detail && <span>{detail}</span>}
          <More label={S.more} english={cause} text={more} />
        </div>
      ))}
    </div>
  );
}

/** Why the bridge calls the twin offline, in words for an operator; empty: a trouble above says it. */
export function offlineReason(status: StatusFrame | null): string {
  if (isUnreceived(status)) return '';
  // A fleet doubts a clock that is ahead of the archive's; its journal goes on.
  const isAhead = status?.reason === 'clock_doubted' && status.journal.state !== 'doubting';
  const reason = isAhead ? 'clock_ahead' : status?.reason;
  return textFor(S.offlineWhy, reason) ?? S.frozenWhy.offline;
}

/** The same for whoever maintains the system; undefined: nothing to add. */
export const offlineMore = (status: StatusFrame | null): string | undefined =>
  isUnreceived(status) ? undefined : textFor(S.offlineMore, status?.reason);

/** Whether nothing was ever received and the server knows why, such as an archive that is down. */
const isUnreceived = (status: StatusFrame | null): boolean =>
  status?.reason === 'never_seen' && status.input_problems.length > 0;

/** Banner across the page while it is not live. */
export function FrozenBanner(): JSX.Element | null {
  const phase = useApp((state) => state.twin.phase);
  const takenAt = useApp((state) => selectLatest(state).snapshot?.takenAt);
  const isTimeLost = useApp((state) => state.twin.isTimeLost);
  const status = useApp((state) => state.twin.connection.status);
  const isPast = useApp((state) => selectShown(state).moment !== null);
  const fault = useApp(selectClockFault);
  const isDated = fault === null;
  const now = useNow();
  if (phase === 'live' || takenAt === undefined) return null;
  return (
    <div className="frozen" role="alert" data-testid="frozen">
      <div>
        {isDated && (
          <strong>
            {(isPast ? S.frozenBehindPast : S.frozenSince)(clockText(epochOf(takenAt)))}
          </strong>
        )}
        {/* A running count must not be read out every second. */}
        {isDated && !isTimeLost && (
          <span aria-hidden="true" className="frozen-age">
            {S.agoSuffix(ageText(Math.max(0, now - takenAt) / 1000))}
          </span>
        )}
        <span>
          {fault && <strong>{S.clockTodo[fault]} </strong>}
          {phase === 'offline' ? offlineReason(status) : S.frozenWhy[phase]}
        </span>
        {phase === 'offline' && (
          <More
            label={S.more}
            english={
              fault === 'clock_doubted' ? sentence(status?.journal.detail ?? '', MAX_PROBLEM) : ''
            }
            text={offlineMore(status)}
          />
        )}
        {isPast && <span>{S.frozenPastStays}</span>}
      </div>
      {phase === 'reconnecting' && (
        <button type="button" onClick={retryConnection}>
          {S.retryNow}
        </button>
      )}
    </div>
  );
}
