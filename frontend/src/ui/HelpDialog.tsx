import { useEffect, useRef, type JSX } from 'react';

import { shown } from '../domain/text';
import { theMap } from '../map/commands';
import { act, prefer, store, useApp } from '../store/app';
import { announce } from '../store/create';
import { selectRows, selectSensors } from '../store/derived';
import { backToLive } from '../store/moment';
import { type ViewState, withChart, withList, withTag } from '../store/view';
import { S } from '../strings';
import { togglePlayback } from '../timebar/playback';
import { Check, Icon } from '../widgets/controls';
import { ALARMS_ID, FILTER_ID } from './alarms/ListChoice';
import { chosenTag } from './Announcer';

const ID = 'help-dialog';

export function openHelp(): void {
  const dialog = document.getElementById(ID);
  if (dialog instanceof HTMLDialogElement && !dialog.open) dialog.showModal();
}

export function HelpDialog(): JSX.Element {
  const dialog = useRef<HTMLDialogElement>(null);
  const shortcuts = useApp((state) => state.settings.shortcuts);
  // The backdrop's clicks arrive at the dialog itself, not at its content.
  useEffect(() => {
    const element = dialog.current;
    element?.addEventListener('click', ({ target }) => {
      if (target === element) element.close();
    });
  }, []);
  return (
    <dialog id={ID} className="help" ref={dialog} aria-labelledby="help-title">
      <div className="help-content">
        <header>
          <h2 id="help-title">{S.help}</h2>
          <form method="dialog">
            <button type="submit" className="icon-button" aria-label={S.cardClose}>
              <Icon name="close" />
            </button>
          </form>
        </header>
        <Keys title={S.helpGlobal} keys={S.keys.global} />
        <Keys title={S.helpTime} keys={S.keys.time} />
        <Keys title={S.helpMap} keys={S.keys.map} />
        <Check
          label={S.helpToggle}
          isOn={shortcuts}
          onChange={(isOn) => prefer({ shortcuts: isOn })}
        />
      </div>
    </dialog>
  );
}

function Keys({
  title,
  keys,
}: {
  title: string;
  keys: readonly (readonly [string, string])[];
}): JSX.Element {
  return (
    <>
      <h3>{title}</h3>
      <dl className="keys">
        {keys.map(([key, action]) => (
          <div key={key}>
            <dt>
              <kbd>{key}</kbd>
            </dt>
            <dd>{action}</dd>
          </div>
        ))}
      </dl>
    </>
  );
}

/** Handles a pressed key. */
export function onKey(event: KeyboardEvent): void {
  if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
  if (document.querySelector('dialog[open]')) return;
  if (event.key === 'Escape') {
    escape();
    return;
  }
  if (!store.get().settings.shortcuts || isTyping(event.target)) return;
  if (event.key === ' ' && takesSpace(event.target)) return;
  if (runKey(event.key)) event.preventDefault();
}

function isTyping(target: EventTarget | null): boolean {
  return (
    target instanceof HTMLTextAreaElement ||
    target instanceof HTMLSelectElement ||
    (target instanceof HTMLInputElement && target.type !== 'radio' && target.type !== 'checkbox')
  );
}

function escape(): void {
  // Close the topmost layer first.
  const { chart, selected } = store.get().view;
  if (chart) act(withChart(null));
  else if (selected !== null) act(withTag(null));
  else backToLive();
}

/** Whether the element uses the space bar itself, as buttons and the map do. */
const takesSpace = (target: EventTarget | null): boolean =>
  target instanceof Element &&
  target.closest('button, a, input, select, [role=application]') !== null;

/** Runs a key's shortcut; false: the key did nothing. */
function runKey(key: string): boolean {
  const state = store.get();
  const { view } = state;
  if (/^[1-9]$/.test(key)) {
    const sensor = selectSensors(state)[Number(key) - 1];
    if (sensor) act({ sensor: sensor.name });
    return sensor !== undefined;
  }
  switch (key.toLowerCase()) {
    case '/':
      act(withList('tags'));
      // The pane may become visible only in the next frame.
      requestAnimationFrame(() => document.getElementById(FILTER_ID)?.focus());
      return true;
    case 'f':
      theMap.get()?.fit();
      return true;
    case 'n':
      stepTag(1);
      return true;
    case 'p':
      stepTag(-1);
      return true;
    case 'l':
      if (view.moment === null) return false;
      backToLive();
      return true;
    case 'y':
      document.querySelector<HTMLButtonElement>('.layers > button')?.click();
      return true;
    case 'c':
      return toggleCharts(view);
    case ' ':
      togglePlayback();
      return true;
    case 'a':
      act(withList('alarms'));
      requestAnimationFrame(() => document.getElementById(ALARMS_ID)?.focus());
      return true;
    case '?':
      openHelp();
      return true;
    default:
      return false;
  }
}

/** Opens or closes the selected tag's charts; false: no tag is selected. */
function toggleCharts({ chart, selected }: ViewState): boolean {
  if (!chart && selected === null) return false;
  act(withChart(chart ? null : { by: 'tag', tagIds: [selected ?? ''] }));
  return true;
}

/** Selects the next or previous tag, in the table's order. */
function stepTag(by: 1 | -1): void {
  const state = store.get();
  const rows = selectRows(state);
  if (rows.length === 0) return;
  const index = rows.findIndex(({ tag }) => tag.id === state.view.selected);
  const next = index < 0 ? (by > 0 ? 0 : rows.length - 1) : index + by;
  const at = (next + rows.length) % rows.length;
  const row = rows[at];
  if (!row) return;
  const { tag, health } = row;
  act(withTag(tag.id));
  announce(
    chosenTag,
    S.tagChosen(shown(tag.id, 24), S.health[health.verdict], at + 1, rows.length),
  );
}
