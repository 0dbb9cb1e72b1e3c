/** A count with thousands separators. */
export const whole = (count: number): string => count.toLocaleString('de');

/** A count with its noun in the singular or plural. */
export const counted = (count: number, one: string, many: string): string =>
  `${whole(count)} ${count === 1 ? one : many}`;
