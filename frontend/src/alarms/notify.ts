/** Notifications by the browser, for who looks at something else; only on wish. */
import { store } from '../store/app';
import { createStore } from '../store/create';
import { selectOrigin } from '../store/moment';
import { S } from '../strings';
import { showAlarm } from './follow';
import type { Item } from './list';
import { own, preferTold } from './own';
import { wishPush } from './push';
import { textNow } from './speech';
import { onNews } from './watch';
import { severalText } from './words';

/**
 * What the browser says to it. "asks": it will ask the operator. "insecure": it allows them only on
 * https or localhost. "none": it has none, or only such as a page cannot make by itself.
 */
export type NotifyState = 'granted' | 'asks' | 'refused' | 'insecure' | 'none';

function stateNow(): NotifyState {
  if (!window.isSecureContext) return 'insecure';
  if (!('Notification' in window)) return 'none';
  const { permission } = Notification;
  return permission === 'granted' ? 'granted' : permission === 'denied' ? 'refused' : 'asks';
}

export const notifyState = createStore<NotifyState, NotifyState>('none', (_, next) => next);

/** The operator's wish, told by a click: only then the browser is asked. */
export async function wishNotify(isWished: boolean): Promise<void> {
  notifyState.dispatch(stateNow());
  if (isWished && notifyState.get() === 'asks') {
    await Notification.requestPermission();
    notifyState.dispatch(stateNow());
  }
  const isOn = isWished && notifyState.get() === 'granted';
  preferTold({ notify: isOn });
  // Beside it: the page notifies by itself while it is open.
  await wishPush(isOn).catch(() => {
    // No push service, or a bridge that is gone meanwhile: the page still notifies.
  });
}

let last: Notification | null = null;

/** One for all that is new, in whichever tabs of the browser; a later one takes its place. */
function show(raised: readonly Item[]): void {
  const [first] = raised;
  if (!first) return;
  const body = severalText(
    raised.map(({ alarm }) => alarm),
    (alarm) => textNow(store.get(), alarm),
    S.alarmsRaised,
  );
  try {
    const origin = selectOrigin(store.get());
    const title = S.alarmNotifyTitle(raised.length);
    last?.close();
    const shown = new Notification(origin === null ? title : `${S.origin[origin]}: ${title}`, {
      body,
      // Other news has another name: under the same one a browser does so in silence.
      tag: `lupin-twin.alarms ${first.alarm.id} ${first.verdict}`,
    });
    last = shown;
    shown.onclick = () => {
      window.focus();
      showAlarm(first.alarm);
      shown.close();
    };
  } catch {
    // Some browsers let no page make them, and say so only now.
    notifyState.dispatch('none');
    preferTold({ notify: false });
  }
}

/** Tells of what is new where that is wished and nobody looks; returns the way to stop. */
export function startNotify(): () => void {
  notifyState.dispatch(stateNow());
  return onNews(({ raised }) => {
    notifyState.dispatch(stateNow());
    const isLooking = document.visibilityState === 'visible' && document.hasFocus();
    if (own.get().notify && notifyState.get() === 'granted' && !isLooking) show(raised);
  });
}
