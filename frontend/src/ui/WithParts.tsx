import type { JSX } from 'react';

import { useSelected } from '../store/create';
import { later, type Parts } from './later';

/** What needs the parts that come behind the first view; nothing until they are here. */
export function WithParts({
  children,
}: {
  children: (parts: Parts) => JSX.Element | null;
}): JSX.Element | null {
  const parts = useSelected(later, (it) => it.parts);
  return parts && children(parts);
}
