/** What became of a try, by the status of its observation (lupin_msgs/Observation). */
export type TryKind = 'ok' | 'unreachable' | 'undecoded' | 'skipped' | 'failed';

const KINDS: readonly TryKind[] = ['ok', 'unreachable', 'undecoded', 'skipped'];

/** A status that is not known yet is a failure of some kind. */
export const tryKind = (status: number): TryKind => KINDS[status] ?? 'failed';
