import type { JSX } from 'react';

import { S } from '../strings';
import { Disclosure, Icon } from '../widgets/controls';
import { WithParts } from './WithParts';

/** Which columns the table has, and how high its rows are: kept in this browser. */
export function TableSettings(): JSX.Element {
  return (
    <Disclosure label={S.tableButton} button={<Icon name="columns" />} className="table-settings">
      <WithParts>{(parts) => <parts.TableChoices />}</WithParts>
    </Disclosure>
  );
}
