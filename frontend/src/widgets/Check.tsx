import type { ComponentProps, JSX, ReactNode } from 'react';

interface Props extends Omit<ComponentProps<'input'>, 'type' | 'checked' | 'onChange'> {
  readonly label: ReactNode;
  readonly isOn: boolean;
  readonly onChange: (isOn: boolean) => void;
}

/** What is on or off. */
export const Check = ({ label, isOn, onChange, ...rest }: Props): JSX.Element => (
  <label className="check">
    <input
      {...rest}
      type="checkbox"
      checked={isOn}
      onChange={(event) => {
        onChange(event.target.checked);
      }}
    />
    <span>{label}</span>
  </label>
);
