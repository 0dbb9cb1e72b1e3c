import { useEffect, useRef, useState, type JSX, type SyntheticEvent } from 'react';

import { postNote } from '../contract/people';
import { failureText } from '../domain/failure';
import { rosText } from '../domain/rostime';
import { C } from './subject';

/** As the bridge has it. */
export const LONGEST = 500;

/** Where a comment is written. */
export function Field({
  subject,
  moment,
  onDone,
}: {
  subject: string;
  /** What the comment is about, ROS seconds; null: now. */
  moment: number | null;
  onDone: () => void;
}): JSX.Element {
  const [text, setText] = useState('');
  const [fault, setFault] = useState('');
  const [isSending, setSending] = useState(false);
  const field = useRef<HTMLTextAreaElement>(null);
  useEffect(() => {
    field.current?.focus();
  }, []);
  const send = (event: SyntheticEvent): void => {
    event.preventDefault();
    setSending(true);
    const until = moment === null ? {} : { until: moment.toFixed(3) };
    postNote({ kind: 'comment', subject, text: text.trim(), ...until }).then(
      onDone,
      (error: unknown) => {
        setSending(false);
        setFault(C.failed(failureText(error)));
      },
    );
  };
  return (
    <form className="comment-field" onSubmit={send}>
      <label>
        {moment === null ? C.now : C.then(rosText(moment))}
        <textarea
          ref={field}
          rows={2}
          maxLength={LONGEST}
          value={text}
          required
          onChange={(event) => {
            setText(event.target.value);
          }}
          onKeyDown={(event) => {
            if (event.key !== 'Escape') return;
            // It has been of use here, and is not to close the tag's card too.
            event.preventDefault();
            onDone();
          }}
        />
      </label>
      {fault !== '' && <p role="alert">{fault}</p>}
      <button type="submit" className="text-button" disabled={isSending || text.trim() === ''}>
        {C.send}
      </button>
    </form>
  );
}
