import type { JSX } from 'react';

import { rosText } from '../domain/time';
import { shown } from '../domain/text';
import type { Snapshot } from '../domain/twin';
import { useApp, useContent, type AppState } from '../store/app';
import { selectSensor } from '../store/derived';
import { selectClockFault, selectIsDisconnected, selectShown, selectTags } from '../store/moment';
import { S } from '../strings';
import { More } from '../widgets/controls';
import { offlineMore, offlineReason } from './Troubles';

interface Notice {
  readonly id: string;
  readonly title: string;
  readonly hint?: string;
  /** Detail for whoever maintains the system. */
  readonly more?: string | undefined;
  /** In the middle of an otherwise empty map. */
  readonly large?: boolean;
}

/** What is missing, and what to do about it; only the most basic problem. */
export function noticeFor(state: AppState): Notice | null {
  const { phase, connection } = state.twin;
  // Of a clock's fault, the banner says all.
  const isOffline = phase === 'offline' && !selectClockFault(state);
  const { snapshot, field, map, moment } = selectShown(state);
  const offline = {
    id: 'no-twin',
    title: S.emptyNoTwin,
    hint: offlineReason(connection.status),
    more: offlineMore(connection.status),
    large: true,
  };
  const hasReadings = snapshot?.tags.some(({ readings }) => readings.size > 0);
  if (moment !== null && !hasReadings && (!snapshot?.tags.length || !snapshot.isWhole)) {
    return pastNotice(state, moment, snapshot);
  }
  if (!snapshot) {
    if (isOffline) return offline;
    return selectIsDisconnected(state)
      ? {
          id: 'unreachable',
          title: S.emptyUnreachable,
          hint: S.emptyUnreachableHint,
          more: S.emptyUnreachableMore,
          large: true,
        }
      : { id: 'connecting', title: S.emptyConnecting, hint: S.emptyConnectingHint, large: true };
  }
  if (snapshot.tags.length === 0) {
    // The twin was received before: report its fault, not that there is none.
    if (isOffline) return { ...offline, title: S.emptyNoTags };
    return {
      id: 'no-tags',
      title: S.emptyNoTags,
      hint: S.emptyNoTagsHint,
      more: S.emptyNoTagsMore,
      large: true,
    };
  }
  if (!snapshot.tags.some((tag) => tag.at)) {
    return { id: 'no-pins', title: S.emptyNoPins, hint: S.emptyNoPinsHint };
  }
  const { sensor } = state.view;
  const isMapped = field.value?.sensor === sensor && field.value.sampleCount > 0;
  if (!isMapped && !snapshot.tags.some((tag) => tag.at && tag.readings.get(sensor) != null)) {
    const label = shown(selectSensor(state).label, 32);
    const hint = moment === null ? S.emptyNoReadingHint : '';
    return { id: 'no-reading', title: S.emptyNoReading(label), hint };
  }
  // Without a connection nothing loads; the banner says so.
  if (field.state === 'failed' && phase === 'live') {
    return { id: 'field-failed', title: S.fieldFailed(shown(field.message, 160)) };
  }
  if (!map.value && (!connection.status?.has_map || map.state === 'failed')) {
    return { id: 'no-map', title: S.emptyNoMap, more: S.emptyNoMapMore };
  }
  return null;
}

/** A past moment has nothing to show: still loading, failed, no tag was known then, or deleted. */
function pastNotice({ twin }: AppState, moment: number, came: Snapshot | null): Notice {
  const { pastFault, remembered, latest } = twin;
  const when = rosText(moment);
  if (came) {
    const reach = remembered.value?.reach;
    const begins = reach ? S.pastReach(rosText(reach.from)) : S.pastReachNothing;
    const large = came.tags.length === 0;
    const isBefore = large && (!reach || moment < reach.from);
    const hint = came.isWhole || isBefore ? begins : S.notKnownThenLong;
    return { id: 'past-nothing', title: S.pastNothing(when), hint, large };
  }
  if (pastFault) {
    const isFuture = latest.snapshot !== null && moment > latest.snapshot.at;
    const hint = isFuture && pastFault.isLasting ? S.pastFuture : shown(pastFault.message, 160);
    return { id: 'past-failed', title: S.pastFailed(when), hint, large: true };
  }
  return {
    id: 'past-fetching',
    title: S.pastFetching(when),
    hint: S.pastFetchingHint,
    large: true,
  };
}

/** The notice: in the middle of an empty map, or at the edge of one with content. */
export function Notices({ place }: { place: 'middle' | 'edge' }): JSX.Element | null {
  const notice = useContent(noticeFor);
  const large = notice?.large ?? false;
  if (!notice || large !== (place === 'middle')) return null;
  const { id, title, hint, more } = notice;
  return (
    <div
      className={large ? 'notice notice-large' : 'notice'}
      data-over-map={large ? undefined : true}
      data-testid="notice"
      data-notice={id}
    >
      <strong>{title}</strong>
      {hint && <span>{hint}</span>}
      <More label={S.more} text={more} />
    </div>
  );
}

/** Replaces the rows of an empty table. */
export function EmptyTable(): JSX.Element | null {
  const isEmpty = useApp((state) => selectTags(state).length === 0);
  const notice = useContent(noticeFor);
  if (!isEmpty) return null;
  return (
    <div className="empty-table" data-testid="empty-table">
      <strong>{notice?.title}</strong>
      <p>{notice?.hint}</p>
    </div>
  );
}
