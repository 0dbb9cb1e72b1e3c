import { now as pageNow, timeZone } from '../clock';
import { type Span, spanOf } from '../domain/period';
import { store } from '../store/app';
import { rosNow } from '../store/moment';
import { toFragment } from '../store/permalink';
import { isChosen } from '../store/view';
import { LANGUAGE } from '../strings';

/** Of the view as it is: that of the page comes behind, and waits while the past is played. */
export function viewAddress(): URL {
  const url = new URL(window.location.href);
  url.hash = toFragment(store.get().view);
  return url;
}

/** Copies the address of this view; true when the clipboard took it. */
export async function copyLink(): Promise<boolean> {
  // Only secure contexts have a clipboard, and a greenhouse's plain http is none: hence the
  // look at a property whose type claims that it is always there.
  const clipboard = navigator.clipboard as Clipboard | undefined;
  if (!clipboard) return false;
  return clipboard.writeText(viewAddress().href).then(
    () => true,
    () => false,
  );
}

/** The address of the shift report, a page of the bridge's own. */

const SHIFT_S = 8 * 3_600;
/** The bridge reports of no longer a period. */
const LONGEST_S = 31 * 86_400;

/** Of the period chosen on the time bar; of the last eight hours where none was. */
export function reportLink(): string {
  const state = store.get();
  const now = rosNow(state, pageNow());
  const query = new URLSearchParams({ lang: LANGUAGE, time_zone: timeZone() });
  if (now !== null) {
    const { period } = state.view;
    const oldest = state.twin.remembered.value?.reach?.from ?? null;
    const { from, to } = reported(isChosen(period) ? spanOf(period, now, oldest) : null, now);
    query.set('from', String(from));
    query.set('to', String(to));
  }
  return `api/report.html?${query.toString()}`;
}

/** In whole seconds; what is to come is no part of it. */
export function reported(span: Span | null, now: number): Span {
  const to = Math.max(1, Math.floor(Math.min(span?.to ?? now, now)));
  const from = Math.floor(span?.from ?? to - SHIFT_S);
  return { from: Math.max(0, to - LONGEST_S, Math.min(from, to - 1)), to };
}
