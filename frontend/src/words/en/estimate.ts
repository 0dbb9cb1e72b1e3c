/** The estimate: how sure it is, how well it has foretold, and where another tag would help. */
import { counted } from './counted';

export const ESTIMATE = {
  about: 'What ± means',
  aboutText:
    'Of ten values of the estimate, nine should be off by no more than the ± (a 90 % ' +
    'interval). It counts how far away and how old each reading is, and how the greenhouse goes ' +
    'through its day: the longer nobody measures, the larger the ±.',
  onItsWay: 'The estimate is on its way',
  noService: 'This twin makes no estimate: shown are the nearest readings',
  noneNow: 'There is no estimate just now: shown are the nearest readings',
  noModel: 'No estimate yet: it needs ten scans of a sensor',
  noSensor: 'No tag measures this, so there is nothing to estimate',
  unsure: (error: string): string =>
    `Hatched where it may be off by more than ±${error}, the denser the more. No colour: not known`,
  /** Beside the colours of the error. */
  errorOf: (sensor: string): string => `${sensor}: how far off the estimate may be`,
  foretold: (inside: number, scans: number): string =>
    `${inside} of ${counted(scans, 'scan', 'scans')} lay where the other tags put them`,
  foretoldNone: 'No scan has been compared with it yet',
  foretoldDay: (inside: number, scans: number): string =>
    `Last day: ${inside} of ${counted(scans, 'scan', 'scans')}`,
  foretoldWeek: (inside: number, scans: number): string =>
    `last week: ${inside} of ${counted(scans, 'scan', 'scans')}`,
  fitProblem: (reason: string): string => `Learning the greenhouse is not going well: ${reason}`,
  notTrusted: (count: number): string =>
    `Do not rely on the ±: only ${count} of 10 scans lay where the other tags put them, not 9.`,
  near: (count: number): string =>
    count === 0 ? 'no tag near' : counted(count, 'tag near', 'tags near'),
  oldest: (age: string): string => `oldest reading ${age}`,
  expected: (measured: string, expected: string): string =>
    `measured ${measured}, expected ${expected}`,
  leftOut: (sensor: string): string => `${sensor} changed: left out of the estimate`,
  advice: 'Where another tag would help',
  advised: (place: string, percent: string, isFirst: boolean): string =>
    isFirst
      ? `${place}: a tag here takes the error of the whole map to ${percent} of what it is now`
      : `${place}: a tag here and at each mark before it take the error of the whole map to ${percent} of what it is now`,
  adviceNone: 'No place is known where another tag would help',
  adviceFailed: (reason: string): string => `Where another tag would help is not known: ${reason}`,
  adviceNow: 'Where another tag would help is known of now alone',
} as const;
