import { useRef, useState, type JSX } from 'react';

import { withdrawComment } from '../contract/comments';
import { failureText } from '../domain/failure';
import { rosText } from '../domain/rostime';
import { shown } from '../domain/text';
import { useApp } from '../store/app';
import { useSelected } from '../store/create';
import { selectShown } from '../store/moment';
import { person } from '../store/signals';
import { comments, type Comment } from './comments';
import { Field, LONGEST } from './Field';
import { C } from './subject';

/** Of one subject, the newest. */
const MOST_SHOWN = 20;

/** What was said of a subject until the moment that is shown; who may write says more. */
export function Comments({
  subject,
  name,
}: {
  subject: string;
  /** What it is about, for a screen reader. */
  name: string;
}): JSX.Element {
  const mayWrite = useSelected(person, (who) => who?.can_write_notes === true);
  const moment = useApp((state) => selectShown(state).moment);
  const [isOpen, setOpen] = useState(false);
  const button = useRef<HTMLButtonElement>(null);
  return (
    <>
      {mayWrite && (
        <button
          ref={button}
          type="button"
          className="say"
          aria-label={C.commentOf(name)}
          aria-expanded={isOpen}
          onClick={() => {
            setOpen(!isOpen);
          }}
        >
          {C.comment}
        </button>
      )}
      <Said subject={subject} moment={moment} />
      {isOpen && (
        <Field
          subject={subject}
          moment={moment}
          onDone={() => {
            setOpen(false);
            button.current?.focus();
          }}
        />
      )}
    </>
  );
}

/** What was said of a subject until a moment, ROS seconds; null: until now. */
export function Said({
  subject,
  moment,
}: {
  subject: string;
  moment: number | null;
}): JSX.Element | null {
  const all = useSelected(comments, (it) => it);
  const who = useSelected(person, (it) => it);
  const found = all.filter((it) => it.subject === subject && (moment === null || it.at <= moment));
  if (found.length === 0) return null;
  const mayWithdraw = ({ by }: Comment): boolean =>
    who?.can_write_notes === true && (by === who.name || who.role === 'admin');
  return (
    <div className="comments" data-testid="comments">
      <ul aria-label={C.title}>
        {found.slice(-MOST_SHOWN).map((comment) => (
          <One key={comment.id} comment={comment} mayWithdraw={mayWithdraw(comment)} />
        ))}
      </ul>
    </div>
  );
}

function One({
  comment: { id, by, at, text },
  mayWithdraw,
}: {
  comment: Comment;
  mayWithdraw: boolean;
}): JSX.Element {
  const [fault, setFault] = useState('');
  return (
    <li data-comment={id}>
      <strong>
        <bdi>{by}</bdi>
      </strong>{' '}
      <span className="faint">{rosText(at)}</span> <bdi>{shown(text, LONGEST)}</bdi>{' '}
      {mayWithdraw && (
        <button
          type="button"
          className="text-button"
          aria-label={C.withdrawOf(shown(text, 40))}
          onClick={() => {
            withdrawComment(id).catch((error: unknown) => {
              setFault(C.failed(failureText(error)));
            });
          }}
        >
          {C.withdraw}
        </button>
      )}
      {fault !== '' && <span role="alert">{fault}</span>}
    </li>
  );
}
