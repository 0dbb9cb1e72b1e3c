import type { JSX } from 'react';

import { useApp } from '../store/app';
import { useSelected } from '../store/create';
import { person } from '../store/signals';
import { Disclosure, useClose } from '../widgets/Disclosure';
import { Field } from './Field';
import { C } from './subject';

/** Beside the time bar: a word about the greenhouse, at the moment that the page shows. */
export function SiteComment(): JSX.Element | null {
  const mayWrite = useSelected(person, (it) => it?.can_write_notes === true);
  if (!mayWrite) return null;
  return (
    <Disclosure
      label={C.commentOf(C.site)}
      button={C.comment}
      className="say-site"
      look="text-button"
    >
      <OfMoment />
    </Disclosure>
  );
}

function OfMoment(): JSX.Element {
  const moment = useApp((state) => state.view.moment);
  return <Field subject="site" moment={moment} onDone={useClose()} />;
}
