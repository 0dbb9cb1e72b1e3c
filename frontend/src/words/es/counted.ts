/** A number of things, its thousands set apart. */
export const whole = (count: number): string => count.toLocaleString('es');

/** A number and the word for so many. */
export const counted = (count: number, one: string, many: string): string =>
  `${whole(count)} ${count === 1 ? one : many}`;
