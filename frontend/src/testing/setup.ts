/** What jsdom lacks of a browser, as far as the page's modules touch it on import or mount. */
import { cleanup } from '@testing-library/react';
import { afterEach } from 'vitest';

import { FakeContext } from './canvas';

afterEach(cleanup);

window.matchMedia = (query: string) =>
  ({
    matches: false,
    media: query,
    addEventListener: () => undefined,
    removeEventListener: () => undefined,
  }) as unknown as MediaQueryList;

Element.prototype.scrollIntoView = () => undefined;

HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement) {
  return FakeContext.of(this);
} as unknown as HTMLCanvasElement['getContext'];
