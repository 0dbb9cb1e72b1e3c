/** What screen readers are told of alarms: one announcement a change, of critical ones at once. */
import { createVoice } from '../store/create';
import { store } from '../store/app';
import { S } from '../strings';
import type { Item, News } from './list';
import { textNow } from './speech';
import { onNews } from './watch';
import { severalText } from './words';

/** Waits until what is being read is read. */
export const politeVoice = createVoice();
/** Cuts in. */
export const urgentVoice = createVoice();

export function newsText({ raised, cleared }: News): string {
  const text = (
    items: readonly Item[],
    say: (texts: readonly string[], more: number) => string,
  ): string[] =>
    items.length === 0
      ? []
      : [
          severalText(
            items.map(({ alarm }) => alarm),
            (alarm) => textNow(store.get(), alarm),
            say,
          ),
        ];
  return [...text(raised, S.alarmsRaised), ...text(cleared, S.alarmsCleared)].join('. ');
}

/** Announces what is new; returns the way to stop. */
export const startVoices = (): (() => void) =>
  onNews((news) => {
    const isUrgent = news.raised.some(({ verdict }) => verdict === 'critical');
    const voice = isUrgent ? urgentVoice : politeVoice;
    voice.dispatch(newsText(news));
  });
