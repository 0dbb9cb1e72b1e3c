/** Type of a language's catalogue: exactly the keys and kinds of the English one. */
import type { ENGLISH } from './en';

/** `T` with any text in place of each text; functions keep their parameters. */
export type In<T> = T extends string
  ? string
  : T extends (...of: infer Of) => string
    ? (...of: Of) => string
    : { readonly [Key in keyof T]: In<T[Key]> };

export type Words = In<typeof ENGLISH>;
