/** The estimate: its uncertainty, how well it has predicted, and where another tag would help. */
import { counted, whole } from './counted';

export const ESTIMATE = {
  about: 'What ± means',
  aboutText:
    'Nine out of ten estimated values should be off by no more than the ± (a 90 % interval). ' +
    'The ± depends on the distance and age of the readings, and on the time of day. The longer ' +
    'nothing is measured, the larger it gets.',
  onItsWay: 'Loading the estimate',
  noneNow: 'No estimate at the moment: the nearest readings are shown',
  computed: 'A computed quantity has no estimate: the nearest readings are shown',
  noModel: 'No estimate yet: ten scans of a sensor are needed',
  unsure: (error: string): string =>
    `Hatched colour: less certain than ±${error}. No colour: no data`,
  /** Beside the error's colour scale. */
  error: 'Uncertainty of the estimate',
  predicted: (inside: number, scans: number): string =>
    `${whole(inside)} of ${counted(scans, 'scan', 'scans')} within the predicted range`,
  predictedNone: 'No scan has been compared with it yet',
  fitProblem: (reason: string): string => `The model does not fit this greenhouse well: ${reason}`,
  notTrusted: (count: number): string =>
    `Error range is too narrow: only ${count} of 10 scans were within it; it should be 9.`,
  near: (count: number): string =>
    count === 0 ? 'no tag nearby' : counted(count, 'tag nearby', 'tags nearby'),
  oldest: (age: string): string => `oldest reading ${age} ago`,
  expected: (measured: string, expected: string): string =>
    `measured ${measured}, expected ${expected}`,
  leftOut: (sensor: string): string => `${sensor}: possible sensor fault, not used in the estimate`,
  advised: (place: string, percent: string, isFirst: boolean): string =>
    isFirst
      ? `${place}: a tag here reduces the map’s error to ${percent} of its current value`
      : `${place}: tags here and at all earlier marks reduce the map’s error to ${percent} of its current value`,
  adviceNone: 'No suggestion for another tag',
  adviceFailed: (reason: string): string => `No suggestion for another tag: ${reason}`,
  adviceNow: 'Suggestions for another tag are shown for the present only',
} as const;
