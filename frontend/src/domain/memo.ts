type Frozen<Part> =
  Part extends Map<infer Key, infer Value>
    ? ReadonlyMap<Key, Value>
    : Part extends (infer Item)[]
      ? readonly Item[]
      : Part;

/** A shared object: its fields, lists and maps are read-only. */
export type Shared<Whole> = { readonly [Key in keyof Whole]: Frozen<Whole[Key]> };

/** Caches the last result: the same arguments as last time return the same object. */
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

/** Caches one result per argument while that object exists, so that two states can alternate. */
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

/** `whole` with these parts; the same object if none of them differs. */
export function withParts<Whole extends object>(whole: Whole, parts: Partial<Whole>): Whole {
  const keys = Object.keys(parts) as (keyof Whole)[];
  return keys.every((key) => parts[key] === whole[key]) ? whole : { ...whole, ...parts };
}

/** Returns the previous object while the next one is equal: by its parts, or by `isSame`. */
export function retainEqual<Value extends object>(
  isSame = (last: Value, next: Value): boolean => withParts(last, next) === last,
): (next: Value) => Value {
  let last: Value | null = null;
  return (next) => (last = last && isSame(last, next) ? last : next);
}

/** Items by group, in the order of each group's first item. */
export function groupedBy<Item>(
  items: readonly Item[],
  groupOf: (item: Item) => string,
): ReadonlyMap<string, readonly [Item, ...Item[]]> {
  const groups = new Map<string, [Item, ...Item[]]>();
  for (const item of items) {
    const group = groupOf(item);
    const there = groups.get(group);
    if (there) there.push(item);
    else groups.set(group, [item]);
  }
  return groups;
}
