import { fireEvent } from '@testing-library/react';
import { expect, test } from 'vitest';

import { store } from '../store/app';
import { started } from '../testing/life';
import { showTags } from '../testing/page';
import { wireTag } from '../testing/tags';
import { startKeys } from './keys';
import { deferred, loadParts } from './loadDeferred';

test('a key that comes before what it is for is not lost, and from then on each is taken at once', async () => {
  showTags([wireTag()]);
  const stop = started(startKeys);
  fireEvent.keyDown(document.body, { key: 'a' });
  expect(deferred.get().parts).toBeNull();
  expect(store.get().view.list).toBe('tags');
  await loadParts();
  expect(store.get().view.list).toBe('alarms');
  fireEvent.keyDown(document.body, { key: '/' });
  expect(store.get().view.list).toBe('tags');
  stop();
  fireEvent.keyDown(document.body, { key: 'a' });
  expect(store.get().view.list).toBe('tags');
});
