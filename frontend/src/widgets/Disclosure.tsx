import {
  createContext,
  useCallback,
  useContext,
  useEffect,
  useId,
  useRef,
  useState,
  type JSX,
  type ReactNode,
} from 'react';

const Close = createContext<() => void>(() => undefined);

/** Closes the panel that the caller is in, and gives the focus back to its button. */
export const useClose = (): (() => void) => useContext(Close);

interface Props {
  readonly label: string;
  readonly button: ReactNode;
  readonly className: string;
  /** Of the button. */
  readonly look?: string;
  readonly children: ReactNode;
}

/** A button that opens a panel beside it; Escape, a click elsewhere or leaving it closes. */
export function Disclosure({
  label,
  button,
  className,
  look = 'icon-button',
  children,
}: Props): JSX.Element {
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
    // A finger that closes a panel does nothing else: it cannot see what it would press behind it.
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
    document.addEventListener('pointerdown', onPointerDown);
    document.addEventListener('click', onClick, true);
    document.addEventListener('keydown', onKeyDown, true);
    document.addEventListener('focusin', onFocusIn);
    return () => {
      document.removeEventListener('pointerdown', onPointerDown);
      document.removeEventListener('click', onClick, true);
      document.removeEventListener('keydown', onKeyDown, true);
      document.removeEventListener('focusin', onFocusIn);
    };
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
          // The second of a double click opens nothing that the first has closed, nor closes it.
          if (event.detail < 2) setOpen(!open);
        }}
      >
        {button}
      </button>
      {/* Takes the focus of a click beside its controls: else what scrolls behind it would. */}
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
