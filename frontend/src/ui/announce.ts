/** What screen readers are told of, beside what they are led to. */
import { readingText } from '../domain/format';
import { newlyCritical, type HouseHealth, type TagHealth } from '../domain/health';
import { sensorNamed } from '../domain/sensors';
import { shown } from '../domain/text';
import type { TemperatureUnit } from '../domain/units';
import { store } from '../store/app';
import { createStore } from '../store/create';
import { selectNewestHealth } from '../store/derived';
import { S } from '../strings';

/** So many tags by name in one breath; the table counts the rest. */
const MOST_NAMED = 3;

export interface Announcement {
  readonly text: string;
  /** Another one each time: the same words said again are news too. */
  readonly key: number;
}

const makeStore = (): ReturnType<typeof createStore<Announcement, string>> =>
  createStore({ text: '', key: 0 }, ({ key }, text: string) => ({ text, key: key + 1 }));

/** The tag that a key has chosen. */
export const chosenTag = makeStore();
/** Tags that have become critical. */
export const criticalTags = makeStore();

/** Announces each tag that becomes critical while the page is open; returns the way to stop. */
export function startAnnouncing(): () => void {
  // The first state is what the page opens with, and is to be read there.
  let before: HouseHealth | null = null;
  const onStore = (): void => {
    const state = store.get();
    const health = selectNewestHealth(state);
    if (!health) return;
    const news = before ? newlyCritical(before, health) : [];
    before = health;
    if (news.length > 0) criticalTags.dispatch(criticalText(news, state.settings.unit));
  };
  onStore();
  return store.subscribe(onStore);
}

function criticalText(news: readonly TagHealth[], unit: TemperatureUnit): string {
  const texts = news.slice(0, MOST_NAMED).map(({ tagId, sensor, value }) => {
    const name = S.card(shown(tagId, 24));
    if (sensor === null || value === null) return name;
    const known = sensorNamed(sensor);
    return `${name}, ${shown(known.label, 32)} ${readingText(known, value, unit)}`;
  });
  return S.tagsCritical(texts, news.length - texts.length);
}
