import type { ComponentProps, JSX } from 'react';

interface Props<Value extends string | number> extends Omit<
  ComponentProps<'select'>,
  'value' | 'onChange' | 'children'
> {
  readonly value: Value;
  readonly options: readonly Value[];
  readonly text: (option: Value) => string;
  readonly onChange: (value: Value) => void;
}

/** A choice of one among more than fit beside each other. */
export function Select<Value extends string | number>({
  options,
  text,
  onChange,
  ...rest
}: Props<Value>): JSX.Element {
  return (
    <select
      {...rest}
      onChange={(event) => {
        const chosen = options[event.target.selectedIndex];
        if (chosen !== undefined) onChange(chosen);
      }}
    >
      {options.map((option) => (
        <option key={option} value={option}>
          {text(option)}
        </option>
      ))}
    </select>
  );
}
