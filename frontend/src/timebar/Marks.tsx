import type { JSX, ReactNode } from 'react';

import { S } from '../strings';
import { Disclosure } from '../widgets/Disclosure';

/** What the marks of the bar mean, in words, each beside its shape. */
export function Marks(): JSX.Element {
  const mark = (name: keyof typeof S.timebarMark, picture: ReactNode): JSX.Element => (
    <li>
      <svg viewBox="0 0 16 16" width="16" height="16" aria-hidden="true" data-mark={name}>
        {picture}
      </svg>
      {S.timebarMark[name]}
    </li>
  );
  return (
    <Disclosure
      label={S.timebarMarks}
      className="timebar-marks"
      button={<span aria-hidden="true">?</span>}
    >
      <ul>
        {mark('scans', <path d="M2 14V8h3v6zM6 14V3h3v11zM10 14v-4h3v4z" />)}
        {mark('failures', <path d="M2 2h3v6H2zM6 2h3v11H6zM10 2h3v4h-3z" />)}
        {mark('pest', <path d="M2 3h12L8 14z" />)}
        {mark('cleared', <circle cx="8" cy="8" r="5" />)}
        {mark('silence', <path d="M0 8l8 8M0 0l16 16M8 0l8 8" />)}
        {mark('before', <path d="M0 8l8-8M0 16L16 0M8 16l8-8" />)}
        {mark('run', <path d="M8 0v16" strokeDasharray="4 3" />)}
      </ul>
    </Disclosure>
  );
}
