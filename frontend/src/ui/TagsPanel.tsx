import { useRef, type JSX } from 'react';

import { act, useApp } from '../store/app';
import { selectRows } from '../store/derived';
import { selectHasSnapshot, selectTags } from '../store/moment';
import { S } from '../strings';
import { Disclosure, Icon } from '../widgets/controls';
import { CsvButton, FILTER_ID, ListChoice, SearchField } from './alarms/ListChoice';
import { HealthSummary } from './HealthSummary';
import { loadParts, WithParts } from './loadDeferred';
import { EmptyTable } from './Notices';
import { TagTable } from './TagTable';
import { LONGEST_ON_PAPER, useTopAfter } from './visibleRows';

export function TagsPanel({
  kiosk,
  hasStatus,
}: {
  kiosk: boolean;
  hasStatus: boolean;
}): JSX.Element {
  const list = useApp((state) => state.view.list);
  return (
    <section className="tags-panel" aria-label={S.tags} id="tags" tabIndex={-1}>
      {hasStatus && <HealthSummary kiosk={kiosk} />}
      {kiosk ? (
        <WithParts>{(parts) => <parts.AttentionList />}</WithParts>
      ) : (
        <div className="list">
          {list === 'alarms' ? (
            <WithParts>{(parts) => <parts.AlarmPanel />}</WithParts>
          ) : (
            <>
              <FilterBar />
              <Rows />
            </>
          )}
        </div>
      )}
    </section>
  );
}

/** The table in its scroll frame; a new filter scrolls back to the first row. */
function Rows(): JSX.Element {
  const filter = useApp(({ view }) => view.filter);
  const status = useApp(({ view }) => view.health);
  const frame = useRef<HTMLDivElement>(null);
  useTopAfter(frame, `${status ?? ''} ${filter}`);
  return (
    // A scroll container, so the keyboard must be able to reach it.
    <div
      ref={frame}
      className="table-scroll"
      role="region"
      aria-label={S.tableCaption}
      // eslint-disable-next-line jsx-a11y/no-noninteractive-tabindex
      tabIndex={0}
    >
      <TagTable />
      <PaperRest />
      <EmptyTable />
    </div>
  );
}

const saveTable = (): void => {
  void loadParts().then((parts) => parts.saveTable());
};

/** On paper: says that the table has more rows than are printed. */
function PaperRest(): JSX.Element | null {
  const count = useApp((state) => selectRows(state).length);
  if (count <= LONGEST_ON_PAPER) return null;
  return <p className="paper-rest">{S.paperRest(LONGEST_ON_PAPER, count)}</p>;
}

function FilterBar(): JSX.Element {
  const filter = useApp((state) => state.view.filter);
  const status = useApp((state) => state.view.health);
  const all = useApp((state) => selectTags(state).length);
  const count = useApp((state) => selectRows(state).length);
  const hasSnapshot = useApp(selectHasSnapshot);
  return (
    <div className="filter-bar">
      <ListChoice />
      <SearchField
        id={FILTER_ID}
        label={S.filter}
        placeholder={S.filterHint}
        value={filter}
        onChange={(text) => act({ filter: text })}
      />
      <span className="count" role="status" data-all={count === all} data-testid="row-count">
        {hasSnapshot && S.shownOf(count, all)}
        {status && ` · ${S.health[status]}`}
      </span>
      <CsvButton title={S.saveCsv} save={saveTable} />
      <Disclosure label={S.tableButton} button={<Icon name="columns" />} className="table-settings">
        <WithParts>{(parts) => <parts.TableChoices />}</WithParts>
      </Disclosure>
    </div>
  );
}
