/** The estimate as a field: what is needed once somebody has chosen it. */
import type { FieldQuery } from '../contract/api';
import { fetchEstimate } from '../contract/estimate';
import type { Field } from '../contract/types';
import { estimatedField } from '../domain/sureness';

export const fetchEstimated = (query: FieldQuery, signal: AbortSignal): Promise<Field> =>
  fetchEstimate(query, signal).then((estimate) => estimatedField(query.sensor, estimate));
