import { Fragment, useMemo, useRef, useState, type FocusEvent, type JSX } from 'react';

import {
  alarmsCsv,
  arranged,
  filtered,
  ORDERS,
  type Block,
  type Order,
} from '../../alarms/arrange';
import { calling, countText, heldList, itemsOf, type AlarmList } from '../../alarms/list';
import { acknowledgeAlarms } from '../../alarms/own';
import { selectNow, worstNowFirst } from '../../alarms/latest';
import { alarmList } from '../../alarms/watch';
import { timeOfDay } from '../../clock';
import { saveCsv } from '../../export/save';
import { store, useApp, useContent } from '../../store/app';
import { person, useSelected } from '../../store/create';
import { selectCatalogue } from '../../store/derived';
import { selectLatestTag } from '../../store/moment';
import { S } from '../../strings';
import { Disclosure, Icon, Select } from '../../widgets/controls';
import { useChosenInSight, usePaper, useTopAfter } from '../visibleRows';
import { AlarmNotes, AlarmsWait, LastActionLine, NotifySettings } from './AlarmNotes';
import { AlarmRow } from './AlarmRow';
import { ignoreDoubleClick } from './AlarmTools';
import { CauseHeading } from './CauseHeading';
import { ALARMS_ID, CsvButton, ListChoice, SearchField } from './ListChoice';
import { sharingText, useActing } from './people';

/** Rows shown at first, and with each "more". */
const MOST_ROWS = 100;

const isTag = (id: string): boolean => selectLatestTag(store.get(), id) !== undefined;

/** The current alarms, beside the map: active, shelved and resolved. */
export function AlarmPanel(): JSX.Element {
  const listed = useSelected(alarmList);
  const active = useContent((state) => worstNowFirst(state, listed.active));
  const all = useMemo(() => ({ ...listed, active }), [listed, active]);
  const sensors = useApp(selectCatalogue);
  const [filter, setFilter] = useState('');
  const [order, setOrder] = useState<Order>('cause');
  const { shown, added, showNew, ...hold } = useHeldOrder(all);
  const seen = filtered(shown, filter, sensors, isTag);
  // Counts follow the live list, like all others on the page, even while the order is held.
  const counted = filtered(all, filter, sensors, isTag);
  const waiting = calling(seen);
  const who = useSelected(person);
  const { isAble, isRefused } = useActing();
  const count = seen.active.length + seen.shelved.length + seen.resolved.length;
  const list = useRef<HTMLDivElement>(null);
  useChosenInSight(
    list,
    useApp((state) => state.view.selected),
    active,
  );
  useTopAfter(list, filter);
  const hasAny = all.active.length + all.shelved.length > 0;
  return (
    <>
      <div className="filter-bar alarm-bar">
        <ListChoice />
        <SearchField
          label={S.alarmFilter}
          placeholder={S.alarmFilterHint}
          value={filter}
          onChange={setFilter}
        />
        <Select
          aria-label={S.alarmOrder}
          value={order}
          options={ORDERS}
          text={(each) => S.alarmOrders[each]}
          onChange={setOrder}
        />
        <CsvButton
          title={S.alarmSaveCsv}
          save={() => {
            const found = filtered(alarmList.get(), filter, sensors, isTag);
            const text = alarmsCsv(found, sensors, (alarm) => selectNow(store.get(), alarm));
            saveCsv('alarms', text, timeOfDay());
          }}
        />
      </div>
      <LastActionLine added={added.length} onShow={showNew}>
        {isAble && (
          <button
            type="button"
            className="text-button acknowledge-all"
            disabled={waiting.length === 0 || isRefused}
            onClick={ignoreDoubleClick(() => acknowledgeAlarms(waiting))}
          >
            <Icon name="check" size={18} /> {S.alarmAll(S.alarmAcknowledge, waiting.length)}
          </button>
        )}
        <Disclosure
          label={S.alarmNotifyMe}
          button={<Icon name="bell" />}
          className="notify-settings"
        >
          <NotifySettings />
        </Disclosure>
      </LastActionLine>
      <div
        ref={list}
        className="alarms"
        id={ALARMS_ID}
        role="region"
        aria-label={S.alarms}
        // A scroll container, so the keyboard must be able to reach it.
        // eslint-disable-next-line jsx-a11y/no-noninteractive-tabindex
        tabIndex={0}
        data-testid="alarms"
        {...hold}
      >
        <AlarmNotes isEmpty={!hasAny} />
        {filter !== '' && count === 0 && <p className="faint">{S.alarmsNoMatch}</p>}
        {(['active', 'shelved', 'resolved'] as const).map((name) => (
          <Fragment key={name}>
            {/* A filter that hides all active alarms must not look as if there were none. */}
            {(name === 'active' ? shown : seen)[name].length > 0 && (
              <Group
                name={name}
                count={`${filter === '' ? '' : `${counted[name].length}/`}${countText(all, name)}`}
                blocks={arranged(seen[name], order, sensors)}
              />
            )}
            {/* Below the rows, so that they do not move as it comes and goes. */}
            {name === 'active' && hasAny && <AlarmsWait />}
          </Fragment>
        ))}
        {/* Whether actions stay in this browser or are shared. */}
        {hasAny && <p className="sharing-note faint">{sharingText(who)}</p>}
      </div>
    </>
  );
}

/** One group of the list; "resolved" starts collapsed, because it needs no action. */
function Group({
  name,
  count,
  blocks,
}: {
  name: keyof AlarmList;
  count: string;
  blocks: readonly Block[];
}): JSX.Element {
  const [isOpen, setOpen] = useState(name !== 'resolved');
  const heading = S.alarmGroups[name](count);
  return (
    <section data-group={name}>
      <h3>
        {name === 'resolved' ? (
          <button
            type="button"
            className="text-button"
            aria-expanded={isOpen}
            onClick={() => setOpen(!isOpen)}
          >
            {heading} <Icon name="chevron" />
          </button>
        ) : (
          heading
        )}
      </h3>
      {isOpen && blocks.map((block) => <Rows key={block.key} block={block} group={name} />)}
    </section>
  );
}

/** Alarm rows of a block; those of a shared cause once its heading is clicked. */
function Rows({
  block: { cause, items },
  group,
}: {
  block: Block;
  group: keyof AlarmList;
}): JSX.Element {
  const [most, setMost] = useState(cause === null ? MOST_ROWS : 0);
  // On paper everything is expanded.
  const isPaper = usePaper();
  const shown = isPaper ? items : items.slice(0, most);
  const rest = items.length - shown.length;
  return (
    <>
      {cause !== null && (
        <CauseHeading
          cause={cause}
          items={items}
          group={group}
          isOpen={shown.length > 0}
          onToggle={() => setMost(most > 0 ? 0 : MOST_ROWS)}
        />
      )}
      {shown.length > 0 && (
        <ul data-caused={cause !== null}>
          {shown.map((item) => (
            <AlarmRow key={item.alarm.id} item={item} group={group} />
          ))}
        </ul>
      )}
      {rest > 0 && most > 0 && (
        <button
          type="button"
          className="text-button alarm-more"
          onClick={() => setMost(most + MOST_ROWS)}
        >
          {S.attentionMore(Math.min(rest, MOST_ROWS))}
        </button>
      )}
    </>
  );
}

/** Holds the order while the pointer or keyboard focus is in the list: no row moves. */
function useHeldOrder(list: AlarmList) {
  const [hasPointer, setPointer] = useState(false);
  const [hasFocus, setFocus] = useState(false);
  const [held, setHeld] = useState<AlarmList | null>(null);
  const isHeld = hasPointer || hasFocus;
  // An empty list has nothing to hold.
  const hasRows = held !== null && itemsOf(held).length > 0;
  if (isHeld ? !hasRows && held !== list : held !== null) setHeld(isHeld ? list : null);
  return {
    ...heldList(held ?? list, list),
    /** Shows the new alarms, and holds that order. */
    showNew: () => setHeld(null),
    onPointerEnter: () => setPointer(true),
    onPointerLeave: () => setPointer(false),
    // A clicked button keeps the focus; without `:focus-visible` it holds nothing once the pointer leaves.
    onFocus: ({ target, currentTarget }: FocusEvent) => {
      setFocus(target !== currentTarget && target.matches(':focus-visible'));
    },
    onBlur: ({ relatedTarget, currentTarget }: FocusEvent) => {
      if (!currentTarget.contains(relatedTarget)) setFocus(false);
    },
  };
}
