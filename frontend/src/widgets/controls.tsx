import {
  type ComponentProps,
  createContext,
  type JSX,
  type ReactNode,
  type RefObject,
  useCallback,
  useContext,
  useEffect,
  useId,
  useLayoutEffect,
  useRef,
  useState,
} from 'react';

const PATHS = {
  plus: 'M12 5v14M5 12h14',
  minus: 'M5 12h14',
  chevron: 'm6 9 6 6 6-6',
  dots: 'M5 12h.01M12 12h.01M19 12h.01',
  fit: 'M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5',
  layers: 'M12 3 3 8l9 5 9-5-9-5ZM3 12.5l9 5 9-5M3 17l9 5 9-5',
  menu: 'M4 7h16M4 12h16M4 17h16',
  columns: 'M4 5h16v14H4ZM9.5 5v14M14.5 5v14',
  close: 'M6 6l12 12M18 6 6 18',
  download: 'M12 4v11m0 0-4-4m4 4 4-4M5 20h14',
  search: 'M11 4a7 7 0 1 0 0 14 7 7 0 0 0 0-14Zm5 12 4 4',
  map: 'M9 4 3 6v14l6-2 6 2 6-2V4l-6 2-6-2Zm0 0v14m6-12v14',
  list: 'M8 6h12M8 12h12M8 18h12M4 6h.01M4 12h.01M4 18h.01',
  up: 'M12 19V5m0 0-6 6m6-6 6 6',
  down: 'M12 5v14m0 0 6-6m-6 6-6-6',
  chart: 'M4 4v16h16M7 15l4-5 3 3 5-7',
  bell: 'M6 17V11a6 6 0 0 1 12 0v6M4 17h16M10 20.500h4M12 5V3',
  later: 'M12 4a8 8 0 1 0 0 16 8 8 0 0 0 0-16Zm0 4v4l3 2',
  check: 'M5 12.500l4.500 4.500L19 7',
} as const;

export type IconName = keyof typeof PATHS;

/** A line icon; always beside text or in a labelled button, so hidden from screen readers. */
export function Icon({ name, size = 20 }: { name: IconName; size?: number }): JSX.Element {
  return (
    <svg className="icon" viewBox="0 0 24 24" width={size} height={size} aria-hidden="true">
      <path d={PATHS[name]} />
    </svg>
  );
}

interface IconButtonProps extends ComponentProps<'button'> {
  readonly icon: IconName;
  readonly label: string;
}

/** An icon button with an accessible name. */
export const IconButton = ({ icon, label, ...rest }: IconButtonProps): JSX.Element => (
  <button type="button" className="icon-button" aria-label={label} title={label} {...rest}>
    <Icon name={icon} />
  </button>
);

interface CheckProps extends Omit<ComponentProps<'input'>, 'type' | 'checked' | 'onChange'> {
  readonly label: ReactNode;
  readonly isOn: boolean;
  readonly onChange: (isOn: boolean) => void;
}

export const Check = ({ label, isOn, onChange, ...rest }: CheckProps): JSX.Element => (
  <label className="check">
    <input
      {...rest}
      type="checkbox"
      checked={isOn}
      onChange={(event) => onChange(event.target.checked)}
    />
    <span>{label}</span>
  </label>
);

/** Collapsed detail for whoever maintains the system; `english`, from the twin or the server, comes first. */
export function More({
  label,
  text = '',
  english = '',
}: {
  label: string;
  text?: string | undefined;
  english?: string | undefined;
}): JSX.Element | null {
  if (text === '' && english === '') return null;
  return (
    <details className="more">
      <summary>{label}</summary>
      {english && <span lang="en">{english} </span>}
      {text}
    </details>
  );
}

interface ChoiceProps<Value, Text> {
  readonly value: Value;
  readonly options: readonly Value[];
  readonly text: (option: Value) => Text;
  readonly onChange: (value: Value) => void;
}

interface SegmentedProps<Value> extends ChoiceProps<Value, ReactNode> {
  readonly legend: string;
  readonly className?: string;
}

/** A choice among a few, as native radio buttons, which arrow keys and screen readers support. */
export function Segmented<Value extends string>({
  legend,
  value,
  options,
  text,
  onChange,
  className = '',
}: SegmentedProps<Value>): JSX.Element {
  const name = useId();
  return (
    <fieldset className={`segmented ${className}`}>
      <legend className="unseen">{legend}</legend>
      {options.map((option) => (
        <label key={option}>
          <input
            type="radio"
            name={name}
            value={option}
            checked={option === value}
            onChange={() => onChange(option)}
          />
          <span>{text(option)}</span>
        </label>
      ))}
    </fieldset>
  );
}

type SelectProps<Value> = ChoiceProps<Value, string> &
  Omit<ComponentProps<'select'>, 'value' | 'onChange' | 'children'>;

/** A choice among more options than fit side by side. */
export function Select<Value extends string | number>({
  options,
  text,
  onChange,
  ...rest
}: SelectProps<Value>): JSX.Element {
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

const Close = createContext<() => void>(() => undefined);

/** Closes the caller's panel, and returns the focus to its button. */
export const useClose = (): (() => void) => useContext(Close);

interface DisclosureProps {
  readonly label: string;
  readonly button: ReactNode;
  readonly className: string;
  readonly look?: string;
  readonly children: ReactNode;
}

/** A button that opens a panel; Escape, a click elsewhere or moving the focus out closes it. */
export function Disclosure({
  label,
  button,
  className,
  look = 'icon-button',
  children,
}: DisclosureProps): JSX.Element {
  const [open, setOpen] = useState(false);
  const root = useRef<HTMLDivElement>(null);
  const trigger = useRef<HTMLButtonElement>(null);
  const id = useId();
  const close = useCallback(() => {
    setOpen(false);
    trigger.current?.focus();
  }, []);

  useEffect(() => {
    if (!open) return;
    const isOutside = ({ target }: Event): boolean => !root.current?.contains(target as Node);
    let byFinger = false;
    const onPointerDown = (event: PointerEvent): void => {
      byFinger = event.pointerType === 'touch';
      if (!byFinger && isOutside(event)) setOpen(false);
    };
    // A tap that closes a panel does nothing else: the panel hid what it would press.
    const onClick = (event: MouseEvent): void => {
      if (!byFinger || !isOutside(event)) return;
      event.preventDefault();
      event.stopPropagation();
      setOpen(false);
    };
    const onKeyDown = (event: KeyboardEvent): void => {
      if (event.key !== 'Escape') return;
      event.stopPropagation();
      setOpen(false);
      trigger.current?.focus();
    };
    const onFocusIn = (event: FocusEvent): void => {
      if (!byFinger && isOutside(event)) setOpen(false);
    };
    const closed = new AbortController();
    const { signal } = closed;
    document.addEventListener('pointerdown', onPointerDown, { signal });
    document.addEventListener('click', onClick, { signal, capture: true });
    document.addEventListener('keydown', onKeyDown, { signal, capture: true });
    document.addEventListener('focusin', onFocusIn, { signal });
    return () => closed.abort();
  }, [open]);

  return (
    <div className={`disclosure ${className}`} ref={root}>
      <button
        type="button"
        className={look}
        ref={trigger}
        aria-label={label}
        title={label}
        aria-expanded={open}
        aria-controls={id}
        onClick={(event) => {
          // The second click of a double click must not reverse the first.
          if (event.detail < 2) setOpen(!open);
        }}
      >
        {button}
      </button>
      {/* Focusable, to take a click beside its controls: otherwise the scroll area behind it would. */}
      <div
        id={id}
        className="disclosure-panel"
        hidden={!open}
        role="group"
        aria-label={label}
        tabIndex={-1}
      >
        {open && <Close value={close}>{children}</Close>}
      </div>
    </div>
  );
}

/**
 * Returns the focus to where the panel was opened from, if it is still in the panel. A layout effect,
 * because its cleanup runs before the panel leaves the page, and the focus with it.
 */
export function useFocusBack(panel: RefObject<HTMLElement | null>): void {
  useLayoutEffect(() => {
    const element = panel.current;
    const cameFrom = document.activeElement;
    return () => {
      const hadFocus = element?.contains(document.activeElement);
      if (hadFocus && cameFrom instanceof HTMLElement) cameFrom.focus();
    };
  }, [panel]);
}
