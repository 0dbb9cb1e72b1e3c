/** Wheel, pinch and drag on the map, by d3-zoom, which stores a copy of the view on the element. */
import { select } from 'd3-selection';
import { zoom, zoomIdentity, type D3ZoomEvent, type ZoomTransform } from 'd3-zoom';

import { MAX_SCALE, type View } from '../geometry/coordinates';
import { moveViewport, store } from '../store/app';
import { gestures, type Hand, type Held } from './camera';

const transformOf = ({ x, y, scale }: View): ZoomTransform =>
  zoomIdentity.translate(x, y).scale(scale);

const toView = ({ x, y, k }: ZoomTransform): View => ({ x, y, scale: k });

function takeHold(element: HTMLElement, held: Held): Hand {
  const selection = select<HTMLElement, unknown>(element);
  /** During a programmed move: it is not the operator's choice. */
  let isFollowing = false;
  const behaviour = zoom<HTMLElement, unknown>()
    // Avoids a layout: the resize observer has the size.
    .extent(() => [
      [0, 0],
      [store.get().viewport.size.width, store.get().viewport.size.height],
    ])
    .constrain((transform) => transformOf(held.inSight(toView(transform))))
    .clickDistance(6)
    // At once, also for the double click: nothing is animated (see `instantly.ts`).
    .duration(0);
  const follow = (view: View): void => {
    isFollowing = true;
    behaviour.scaleExtent([held.leastScale(), MAX_SCALE]);
    behaviour.transform(selection, transformOf(view));
    isFollowing = false;
  };
  const byHand = (listener: (event: D3ZoomEvent<HTMLElement, unknown>) => void) => {
    return (event: D3ZoomEvent<HTMLElement, unknown>): void => {
      if (!isFollowing) listener(event);
    };
  };
  selection.call(behaviour);
  // A map that returns to the page continues where it was.
  follow(store.get().viewport.view);
  behaviour
    .on('start', byHand(held.onStart))
    .on(
      'zoom',
      byHand(({ transform }) => moveViewport({ view: toView(transform) })),
    )
    .on('end', byHand(held.onEnd));
  return {
    follow,
    stop: () => selection.on('.zoom', null),
  };
}

export const startGestures = (): void => gestures.set(takeHold);
