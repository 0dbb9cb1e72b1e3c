import type { JSX } from 'react';

interface Props<Option extends string | number> {
  /** Without counts: the page's views. */
  readonly label?: string;
  readonly options: readonly Option[];
  readonly value: Option;
  readonly onChange: (option: Option) => void;
  readonly text: (option: Option) => string;
  readonly count?: (option: Option) => number | null;
}

export function Choice<Option extends string | number>(props: Props<Option>): JSX.Element {
  const { label, options, value, onChange, text, count = () => null } = props;
  const buttons = options.map((each) => (
    <button key={each} type="button" aria-pressed={each === value} onClick={() => onChange(each)}>
      {text(each)}
      {count(each) !== null && (
        <>
          {' '}
          <span className="fleet-count">{count(each)}</span>
        </>
      )}
    </button>
  ));
  return label === undefined ? (
    <nav className="fleet-filters">{buttons}</nav>
  ) : (
    <div className="fleet-filters" role="group" aria-label={label}>
      {buttons}
    </div>
  );
}
