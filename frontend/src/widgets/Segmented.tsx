import { useId, type JSX, type ReactNode } from 'react';

interface Option<Value extends string> {
  readonly value: Value;
  readonly label: ReactNode;
}

interface Props<Value extends string> {
  readonly legend: string;
  readonly options: readonly Option<Value>[];
  readonly value: Value;
  readonly onChange: (value: Value) => void;
  readonly className?: string;
}

/** A choice of one among a few, as native radio buttons: arrow keys and screen readers know them. */
export function Segmented<Value extends string>({
  legend,
  options,
  value,
  onChange,
  className = '',
}: Props<Value>): JSX.Element {
  const name = useId();
  return (
    <fieldset className={`segmented ${className}`}>
      <legend className="unseen">{legend}</legend>
      {options.map((option) => (
        <label key={option.value}>
          <input
            type="radio"
            name={name}
            value={option.value}
            checked={option.value === value}
            onChange={() => {
              onChange(option.value);
            }}
          />
          <span>{option.label}</span>
        </label>
      ))}
    </fieldset>
  );
}
