/** What a language has to say: as much as English, of the same kind, and nothing more. */
import type { ENGLISH } from './en';

/** The same in other words: texts are any texts, what makes a text takes the same to make it of. */
export type In<T> = T extends string
  ? string
  : T extends (...of: infer Of) => string
    ? (...of: Of) => string
    : { readonly [Key in keyof T]: In<T[Key]> };

export type Words = In<typeof ENGLISH>;
