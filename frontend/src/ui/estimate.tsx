/** What the page has of the estimate, loaded when it is first needed. */
import type * as EstimateParts from '../parts/estimate';
import { inTime } from './inTime';

const parts = (): Promise<typeof EstimateParts> => import('../parts/estimate');

export const AdviceMarks = inTime(async () => (await parts()).AdviceMarks);
export const CardEstimate = inTime(async () => (await parts()).CardEstimate);
export const ErrorScale = inTime(async () => (await parts()).ErrorScale);
export const EstimateFacts = inTime(async () => (await parts()).EstimateFacts);
export const EstimateReadout = inTime(async () => (await parts()).EstimateReadout);
