/** Single keys that work anywhere in the page, unless somebody is typing. */
import { shown } from '../domain/text';
import { commandMap } from '../map/commands';
import { act, prefer, store } from '../store/app';
import { selectRows, selectSensors } from '../store/derived';
import { isDark } from '../store/theme';
import { S } from '../strings';
import { chosenTag } from './announce';
import { openHelp } from './HelpDialog';
import { FILTER_ID } from './TagsPanel';

export function startShortcuts(): () => void {
  const onKeyDown = (event: KeyboardEvent): void => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    if (document.querySelector('dialog[open]')) return;
    if (event.key === 'Escape') {
      escape(event);
      return;
    }
    if (!store.get().settings.shortcuts || isTyping(event.target)) return;
    if (runKey(event.key)) event.preventDefault();
  };
  document.addEventListener('keydown', onKeyDown);
  return () => {
    document.removeEventListener('keydown', onKeyDown);
  };
}

function isTyping(target: EventTarget | null): boolean {
  return (
    target instanceof HTMLTextAreaElement ||
    (target instanceof HTMLInputElement && target.type !== 'radio' && target.type !== 'checkbox')
  );
}

function escape(event: KeyboardEvent): void {
  if (event.target instanceof HTMLInputElement && event.target.id === FILTER_ID) {
    act({ type: 'filter', text: '' });
    return;
  }
  act({ type: 'select', tagId: null });
}

/** Does what a key stands for; false: nothing. */
function runKey(key: string): boolean {
  const state = store.get();
  const { settings, view } = state;
  if (/^[1-9]$/.test(key)) {
    const sensor = selectSensors(state)[Number(key) - 1];
    if (sensor) act({ type: 'sensor', sensor: sensor.name });
    return sensor !== undefined;
  }
  switch (key.toLowerCase()) {
    case '/':
      act({ type: 'pane', pane: 'tags' });
      // The pane may only now become visible.
      requestAnimationFrame(() => document.getElementById(FILTER_ID)?.focus());
      return true;
    case 'f':
      commandMap({ type: 'fit' });
      return true;
    case 'n':
      stepTag(1);
      return true;
    case 'p':
      stepTag(-1);
      return true;
    case 's':
      act({ type: 'layer', layer: 'smooth', on: !view.layers.has('smooth') });
      return true;
    case 'l':
      document.querySelector<HTMLButtonElement>('.layers > button')?.click();
      return true;
    case 'u':
      prefer({ unit: settings.unit === 'C' ? 'F' : 'C' });
      return true;
    case 't':
      prefer({ theme: isDark() ? 'light' : 'dark' });
      return true;
    case '?':
      openHelp();
      return true;
    default:
      return false;
  }
}

/** The tag after or before the chosen one, in the table's order. */
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
  act({ type: 'select', tagId: tag.id });
  chosenTag.dispatch(S.tagChosen(shown(tag.id, 24), S.health[health.status], at + 1, rows.length));
}
