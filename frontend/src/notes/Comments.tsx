import { type JSX, type SyntheticEvent, useEffect, useRef, useState } from 'react';

import { Refusal } from '../contract/api';
import { postNote, withdrawComment } from '../contract/people';
import { failureText } from '../domain/format';
import { shown } from '../domain/text';
import { rosText } from '../domain/time';
import { useApp } from '../store/app';
import { mayWithdraw, person, useSelected } from '../store/create';
import { selectShown } from '../store/moment';
import { S } from '../strings';
import { Disclosure, useClose } from '../widgets/controls';
import { C, standingNotes, type StandingNote } from './NoteMarks';

/** Most comments shown per subject: the newest. */
const MOST_SHOWN = 20;

/** A subject's comments up to the shown moment, and a form for users who may write. */
export function Comments({
  subject,
  name,
}: {
  subject: string;
  /** The subject's name, for screen readers. */
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
          className="comment-button"
          aria-label={S.alarmWhat(C.comment, name)}
          aria-expanded={isOpen}
          onClick={() => setOpen(!isOpen)}
        >
          {C.comment}
        </button>
      )}
      <CommentList subject={subject} moment={moment} />
      {isOpen && (
        <CommentField
          subjects={[subject]}
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

/** A subject's comments up to a moment, ROS seconds; null: up to now. */
export function CommentList({
  subject,
  moment,
}: {
  subject: string;
  moment: number | null;
}): JSX.Element | null {
  const all = useSelected(standingNotes);
  const who = useSelected(person);
  const found = all.filter(
    (it) => it.kind === 'comment' && it.subject === subject && (moment === null || it.at <= moment),
  );
  if (found.length === 0) return null;
  return (
    <div className="comments" data-testid="comments">
      <ul aria-label={C.title}>
        {found.slice(-MOST_SHOWN).map((comment) => (
          <CommentRow
            key={comment.id}
            comment={comment}
            mayWithdraw={mayWithdraw(who, comment.by)}
          />
        ))}
      </ul>
    </div>
  );
}

function CommentRow({
  comment: { id, by, at, text },
  mayWithdraw,
}: {
  comment: StandingNote;
  mayWithdraw: boolean;
}): JSX.Element {
  const [fault, setFault] = useState('');
  return (
    <li>
      <strong>
        <bdi>{by}</bdi>
      </strong>{' '}
      <span className="faint">{rosText(at)}</span> <bdi>{shown(text, LONGEST)}</bdi>{' '}
      {mayWithdraw && (
        <button
          type="button"
          className="text-button"
          aria-label={S.alarmWhat(C.withdraw, shown(text, 40))}
          onClick={() => {
            withdrawComment(id).catch((error: unknown) => setFault(C.failed(failureText(error))));
          }}
        >
          {C.withdraw}
        </button>
      )}
      {fault !== '' && <span role="alert">{fault}</span>}
    </li>
  );
}

const LONGEST = 500;

export function CommentField({
  subjects,
  moment,
  name = moment === null ? C.now : C.then(rosText(moment)),
  onDone,
}: {
  /** As of when the field opened; each gets the comment. */
  subjects: readonly string[];
  /** The field's label. */
  name?: string;
  /** The time that the comment is about, ROS seconds; null: now. */
  moment: number | null;
  onDone: () => void;
}): JSX.Element {
  const [text, setText] = useState('');
  const [fault, setFault] = useState('');
  const [isSending, setSending] = useState(false);
  const field = useRef<HTMLTextAreaElement>(null);
  /** Those still without the comment: saving again after a failure repeats none. */
  const left = useRef(subjects);
  useEffect(() => {
    field.current?.focus();
  }, []);
  const send = (event: SyntheticEvent): void => {
    event.preventDefault();
    setSending(true);
    const until = moment === null ? {} : { until: moment.toFixed(3) };
    const post = async (): Promise<void> => {
      let why: Refusal | null = null;
      for (const subject of left.current) {
        try {
          await postNote({ kind: 'comment', subject, text: text.trim(), ...until });
          left.current = left.current.filter((each) => each !== subject);
        } catch (error) {
          // An alarm that is gone by now keeps the comment from no other.
          if (!(error instanceof Refusal) || error.status !== 404) throw error;
          why = error;
        }
      }
      if (why !== null) throw why;
    };
    post().then(onDone, (error: unknown) => {
      setSending(false);
      setFault(C.failed(failureText(error)));
    });
  };
  return (
    <form className="comment-field" onSubmit={send}>
      <label>
        {name}
        <textarea
          ref={field}
          rows={2}
          maxLength={LONGEST}
          value={text}
          required
          onChange={(event) => setText(event.target.value)}
          onKeyDown={(event) => {
            if (event.key !== 'Escape') return;
            // Handled here: it must not close the tag card too.
            event.preventDefault();
            onDone();
          }}
        />
      </label>
      {fault !== '' && <p role="alert">{fault}</p>}
      <button type="submit" className="comment-button" disabled={isSending || text.trim() === ''}>
        {C.send}
      </button>
    </form>
  );
}

/** Beside the time bar: a comment about the greenhouse at the shown moment. */
export function SiteComment(): JSX.Element | null {
  const mayWrite = useSelected(person, (it) => it?.can_write_notes === true);
  if (!mayWrite) return null;
  return (
    <Disclosure
      label={S.alarmWhat(C.comment, C.site)}
      button={C.comment}
      className="site-comment"
      look="text-button"
    >
      <OfMoment />
    </Disclosure>
  );
}

function OfMoment(): JSX.Element {
  const moment = useApp((state) => state.view.moment);
  return <CommentField subjects={['site']} moment={moment} onDone={useClose()} />;
}
