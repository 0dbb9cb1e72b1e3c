import { useState, type FocusEvent } from 'react';

import { heldList, itemsOf, type AlarmList, type HeldList } from '../../alarms/list';

interface HeldOrder extends HeldList {
  /** Shows what is new, and holds that. */
  readonly release: () => void;
  readonly onPointerEnter: () => void;
  readonly onPointerLeave: () => void;
  readonly onFocus: (event: FocusEvent) => void;
  readonly onBlur: (event: FocusEvent) => void;
}

/** While a pointer, a finger or the keyboard's focus is in the list, no row of it moves. */
export function useHeldOrder(list: AlarmList): HeldOrder {
  const [hasPointer, setPointer] = useState(false);
  const [hasFocus, setFocus] = useState(false);
  const [held, setHeld] = useState<AlarmList | null>(null);
  const isHeld = hasPointer || hasFocus;
  // Where there is no row, none can move.
  const hasRows = held !== null && itemsOf(held).length > 0;
  if (isHeld ? !hasRows && held !== list : held !== null) setHeld(isHeld ? list : null);
  return {
    ...heldList(held ?? list, list),
    release: () => {
      setHeld(null);
    },
    onPointerEnter: () => {
      setPointer(true);
    },
    onPointerLeave: () => {
      setPointer(false);
    },
    // A button that was clicked keeps the focus, and holds nothing once the pointer has left.
    onFocus: ({ target, currentTarget }) => {
      setFocus(target !== currentTarget && target.matches(':focus-visible'));
    },
    onBlur: ({ relatedTarget, currentTarget }) => {
      if (!currentTarget.contains(relatedTarget)) setFocus(false);
    },
  };
}
