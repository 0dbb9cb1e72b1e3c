import type { JSX } from 'react';

import { sensorNamed } from '../domain/sensors';
import { shown } from '../domain/text';
import { useApp, type AppState } from '../store/app';
import { selectShown, selectTags } from '../store/moment';
import { S } from '../strings';
import { offlineReason } from './FrozenBanner';

interface Notice {
  readonly id: string;
  readonly title: string;
  readonly hint?: string;
  /** In the middle of an otherwise empty map. */
  readonly large?: boolean;
}

/** What is missing, and what to do about it; the most basic lack first and alone. */
export function noticeFor(state: AppState): Notice | null {
  const { phase, connection } = state.twin;
  const { snapshot, field, map } = selectShown(state);
  const offline = {
    id: 'no-twin',
    title: S.emptyNoTwin,
    hint: offlineReason(connection.status),
    large: true,
  };
  if (!snapshot) {
    if (phase === 'offline') return offline;
    return phase === 'connecting'
      ? { id: 'connecting', title: S.emptyConnecting, hint: S.emptyConnectingHint, large: true }
      : { id: 'unreachable', title: S.emptyUnreachable, hint: S.emptyUnreachableHint, large: true };
  }
  if (snapshot.tags.length === 0) {
    if (phase === 'offline') return offline;
    return { id: 'no-tags', title: S.emptyNoTags, hint: S.emptyNoTagsHint, large: true };
  }
  if (!snapshot.tags.some((tag) => tag.at)) {
    return { id: 'no-pins', title: S.emptyNoPins, hint: S.emptyNoPinsHint };
  }
  if (!snapshot.tags.some((tag) => tag.at && tag.readings.get(state.view.sensor) != null)) {
    const label = shown(sensorNamed(state.view.sensor).label, 32);
    return { id: 'no-reading', title: S.emptyNoReading(label), hint: S.emptyNoReadingHint };
  }
  if (field.state === 'failed') {
    return { id: 'field-failed', title: S.fieldFailed(shown(field.message, 160)) };
  }
  if (!map.value && (!connection.status?.has_map || map.state === 'failed')) {
    return { id: 'no-map', title: S.emptyNoMap };
  }
  return null;
}

/** In the middle of an empty map, or at the edge of one that has something to show. */
export function Notices({ place }: { place: 'middle' | 'edge' }): JSX.Element | null {
  const id = useApp((state) => noticeFor(state)?.id);
  const title = useApp((state) => noticeFor(state)?.title);
  const hint = useApp((state) => noticeFor(state)?.hint);
  const large = useApp((state) => noticeFor(state)?.large ?? false);
  if (!id || large !== (place === 'middle')) return null;
  return (
    <div
      className={large ? 'notice notice-large' : 'notice'}
      data-over-map={large ? undefined : true}
      data-testid="notice"
      data-notice={id}
    >
      <strong>{title}</strong>
      {hint && <span>{hint}</span>}
    </div>
  );
}

/** In place of the rows of a table that has none. */
export function EmptyTable(): JSX.Element | null {
  const isEmpty = useApp((state) => selectTags(state).length === 0);
  const title = useApp((state) => noticeFor(state)?.title);
  const hint = useApp((state) => noticeFor(state)?.hint);
  if (!isEmpty) return null;
  return (
    <div className="empty-table" data-testid="empty-table">
      <strong>{title}</strong>
      <p>{hint}</p>
    </div>
  );
}
