type Frozen<Part> =
  Part extends Map<infer Key, infer Value>
    ? ReadonlyMap<Key, Value>
    : Part extends (infer Item)[]
      ? readonly Item[]
      : Part;

/** Of what several places hold at once: nobody changes its fields, nor its lists and maps. */
export type Shared<Whole> = { readonly [Key in keyof Whole]: Frozen<Whole[Key]> };

/** The same function, but the same arguments as last time give the same object back. */
export function memoLast<Args extends readonly unknown[], Result>(
  compute: (...args: Args) => Result,
): (...args: Args) => Result {
  let last: { readonly args: Args; readonly result: Result } | null = null;
  return (...args) => {
    const hit = last?.args.every((arg, index) => Object.is(arg, args[index]));
    if (last && hit) return last.result;
    const result = compute(...args);
    last = { args, result };
    return result;
  };
}

/** The same for one object, and for each one that is still about: two states can be compared. */
export function memoOne<Arg extends object, Result>(
  compute: (arg: Arg) => Result,
): (arg: Arg) => Result {
  const results = new WeakMap<Arg, { readonly result: Result }>();
  return (arg) => {
    let known = results.get(arg);
    if (!known) results.set(arg, (known = { result: compute(arg) }));
    return known.result;
  };
}

/** With these parts; the very same object where none of them is another. */
export function withParts<Whole extends object>(whole: Whole, parts: Partial<Whole>): Whole {
  const keys = Object.keys(parts) as (keyof Whole)[];
  return keys.every((key) => parts[key] === whole[key]) ? whole : { ...whole, ...parts };
}

/** What it was given last time, as long as that is the same: by its parts, or as `isSame` says. */
export function retainEqual<Value extends object>(
  isSame = (last: Value, next: Value): boolean => withParts(last, next) === last,
): (next: Value) => Value {
  let last: Value | null = null;
  return (next) => (last = last && isSame(last, next) ? last : next);
}

/** Items by their groups, which stand in the order in which the first of each comes. */
export function groupedBy<Item>(
  items: readonly Item[],
  groupOf: (item: Item) => string,
): ReadonlyMap<string, readonly Item[]> {
  const groups = new Map<string, Item[]>();
  for (const item of items) {
    const group = groupOf(item);
    const there = groups.get(group);
    if (there) there.push(item);
    else groups.set(group, [item]);
  }
  return groups;
}
