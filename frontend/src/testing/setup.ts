/** Browser features that jsdom lacks, as far as modules need them on import or mount. */
import { cleanup, configure } from '@testing-library/react';
import { afterAll, afterEach } from 'vitest';

import { asFound } from './asFound';
import { FakeContext } from './canvas';

afterAll(asFound());

// Tolerates a busy machine.
configure({ asyncUtilTimeout: 20_000 });
afterEach(cleanup);

window.matchMedia = (query: string) =>
  ({
    matches: false,
    media: query,
    addEventListener: () => undefined,
    removeEventListener: () => undefined,
  }) as unknown as MediaQueryList;

Element.prototype.scrollIntoView = () => undefined;
Element.prototype.setPointerCapture = () => undefined;
Object.defineProperty(document, 'fonts', { configurable: true, value: new EventTarget() });

HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement) {
  return FakeContext.of(this);
} as unknown as HTMLCanvasElement['getContext'];

// Used as data only.
globalThis.ImageData = class {
  constructor(
    readonly data: Uint8ClampedArray,
    readonly width: number,
    readonly height: number,
  ) {}
} as unknown as typeof ImageData;

globalThis.Path2D = class {
  constructor(readonly d: string) {}
} as unknown as typeof Path2D;

// In jsdom nothing has a size.
const nothing = (): void => undefined;
globalThis.ResizeObserver = class {
  observe = nothing;
  unobserve = nothing;
  disconnect = nothing;
};
