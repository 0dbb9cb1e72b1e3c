/** Components that load when first shown. */
import { createElement, lazy, Suspense, type ComponentType, type JSX } from 'react';

import type * as EstimateParts from '../parts/estimate';
import { ErrorBoundary, PartMissing } from './ErrorBoundary';

/** A lazy component; if it cannot be loaded, it says so and the rest of the page keeps working. */
export function lazyPart<Props extends object>(
  load: () => Promise<ComponentType<Props>>,
): (props: Props) => JSX.Element {
  const Part = lazy(async (): Promise<{ default: ComponentType<Props> }> => {
    try {
      return { default: await load() };
    } catch {
      return { default: () => <PartMissing /> };
    }
  });
  return function LazyPart(props: Props): JSX.Element {
    return (
      <ErrorBoundary isPart>
        <Suspense>{createElement(Part as ComponentType<Props>, props)}</Suspense>
      </ErrorBoundary>
    );
  };
}

const parts = (): Promise<typeof EstimateParts> => import('../parts/estimate');

export const AdviceMarks = lazyPart(async () => (await parts()).AdviceMarks);
export const CardEstimate = lazyPart(async () => (await parts()).CardEstimate);
export const ErrorScale = lazyPart(async () => (await parts()).ErrorScale);
export const EstimateFacts = lazyPart(async () => (await parts()).EstimateFacts);
export const EstimateReadout = lazyPart(async () => (await parts()).EstimateReadout);
