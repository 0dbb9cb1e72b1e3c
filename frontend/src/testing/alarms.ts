/** Alarms as the bridge might send them. */
import type { Alarm, Alarms, HealthReason } from '../contract/types';
import { receive } from '../store/app';
import { reason } from './health';

type Given = Partial<Omit<Alarm, 'reason' | 'raised_at' | 'cleared_at'>> & {
  readonly reason?: Partial<HealthReason>;
  /** ROS seconds. */
  readonly raised?: number;
  readonly cleared?: number | null;
};

export const alarm = (id: string, { raised = 90, cleared = null, ...over }: Given = {}): Alarm => ({
  id,
  tag_id: '1',
  raised_at: raised,
  cleared_at: cleared,
  worst: null,
  ...over,
  reason: reason(over.reason),
});

export const alarms = (list: readonly Alarm[], over: Partial<Alarms> = {}): Alarms => ({
  alarms: list,
  source: 'journal',
  since: 1,
  ...over,
});

export const reportAlarms = (...list: readonly Alarm[]): void => receive({ alarms: alarms(list) });
