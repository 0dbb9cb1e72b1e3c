import type { Alarm } from '../contract/types';
import { shown } from '../domain/text';
import { LANGUAGE, S } from '../strings';
import { COMMENTS } from '../words/comments';

export const C = COMMENTS[LANGUAGE];

/** Which tag a comment is about; null: the greenhouse, or an alarm that the page does not know. */
export function tagOf(subject: string, alarms: readonly Alarm[]): string | null {
  const [kind, id] = [
    subject.slice(0, subject.indexOf(':')),
    subject.slice(subject.indexOf(':') + 1),
  ];
  if (kind === 'tag') return id;
  if (kind !== 'alarm') return null;
  return alarms.find((alarm) => alarm.id === id)?.tag_id || null;
}

/** "Tag 7", "alarm at Tag 7", "greenhouse". */
export function subjectText(subject: string, alarms: readonly Alarm[]): string {
  if (subject === 'site') return C.site;
  const tagId = tagOf(subject, alarms);
  const tag = tagId === null ? '' : S.card(shown(tagId, 24));
  return subject.startsWith('alarm:') ? C.alarm(tag) : tag;
}
