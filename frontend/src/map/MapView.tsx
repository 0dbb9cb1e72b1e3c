import { useEffect, useRef, useState, type JSX } from 'react';

import { S } from '../strings';
import { runMap } from './controller';

/** The three canvases; everything on them is drawn outside React. */
export function MapView({ kiosk }: { kiosk: boolean }): JSX.Element {
  const element = useRef<HTMLDivElement>(null);
  const still = useRef<HTMLCanvasElement>(null);
  const pins = useRef<HTMLCanvasElement>(null);
  const overlay = useRef<HTMLCanvasElement>(null);
  const [failure, setFailure] = useState<{ readonly error: unknown } | null>(null);
  // If the map fails, the page fails: a frozen map beside "Live" would be believed.
  if (failure) throw failure.error;
  useEffect(() => {
    if (!element.current || !still.current || !pins.current || !overlay.current) return undefined;
    const canvases = { still: still.current, pins: pins.current, overlay: overlay.current };
    const onFailure = (error: unknown): void => setFailure({ error });
    const gone = new AbortController();
    runMap(element.current, canvases, kiosk, onFailure, gone.signal);
    return () => gone.abort();
  }, [kiosk]);
  return (
    <div
      ref={element}
      className="map-view"
      id="map-view"
      data-testid="map"
      // An application: with focus, the map uses the arrow keys itself.
      role={kiosk ? 'img' : 'application'}
      aria-label={kiosk ? S.mapPicture : S.mapLabel}
      tabIndex={kiosk ? undefined : 0}
    >
      <canvas ref={still} data-layer="still" aria-hidden="true" />
      <canvas ref={pins} data-layer="pins" aria-hidden="true" />
      <canvas ref={overlay} data-layer="overlay" data-testid="map-canvas" aria-hidden="true" />
    </div>
  );
}
