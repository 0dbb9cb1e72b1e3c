/** A number and the word for so many. */
export const counted = (count: number, one: string, many: string): string =>
  `${count.toLocaleString('nl')} ${count === 1 ? one : many}`;
